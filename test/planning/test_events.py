from __future__ import annotations

import math

import numpy as np
import pytest
from planning.scenes import (
    BASE,
    FEET,
    HALF,
    RIGHT,
    TIPS,
    at,
    formation,
    leaning_angles,
    leaning_fingers,
    pushed_angles,
    pushed_block,
)

from cfplan_core.contact.elements import parse_contact
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.model import Problem
from cfplan_core.planning.events import EventKind, Sighting, sight

# Its corner, vertex 2, stops the block's left side at x = -0.003.
WALL = [(-0.03, 0.004), (-0.025, 0.004), (-0.023, 0.007), (-0.025, 0.01), (-0.03, 0.01)]
WALL_CONTACT = 'object.e3|palm.1.v2'
# Joint angles that keep the fingers away.
ASIDE = (2.9, 0.2)
PLACES = np.array([0.0, -0.001, -0.002, -0.0025, -0.0041])


def look(
    problem: Problem,
    samples: FloatArray,
    names: tuple[str, ...] = (*FEET, *TIPS),
) -> Sighting:
    system = ContactSystem(problem)
    return sight(system, formation(system, *names), samples, system.place(samples))


def slide(problem: Problem, places: FloatArray = PLACES) -> FloatArray:
    system = ContactSystem(problem)
    return np.array([at(system, x, pushed_angles(x)) for x in places])


def seen(sighting: Sighting) -> set[tuple[EventKind, int]]:
    return {(candidate.kind, candidate.index) for candidate in sighting.candidates}


def test_motion_without_events_has_none() -> None:
    problem = pushed_block()
    sighting = look(problem, slide(problem))
    assert sighting == (len(PLACES) - 1, (), False)


def test_wall_is_seen_in_the_interval_where_its_gap_closes() -> None:
    """The gap is x + 0.003, so that linear interpolation is exact."""
    problem = pushed_block(palms=[WALL])
    sighting = look(problem, slide(problem))
    (candidate,) = sighting.candidates
    assert sighting.interval == 3
    assert candidate.kind is EventKind.CONTACT
    assert ContactSystem(problem).contact_names([candidate.index]) == (WALL_CONTACT,)
    assert candidate.fraction == pytest.approx(0.0005 / 0.0016, abs=1e-12)


def test_kept_contact_does_not_close() -> None:
    """Samples that leave the manifold by rounding must not make events."""
    problem = pushed_block(palms=[WALL])
    samples = slide(problem, np.array([-0.003 + 1e-15, -0.003 - 1e-15]))
    names = (*FEET, TIPS[1], WALL_CONTACT)
    assert look(problem, samples, names).candidates == ()


def test_gap_that_is_closed_to_begin_with_does_not_close() -> None:
    problem = pushed_block(palms=[WALL])
    samples = slide(problem, np.array([-0.003 + 1e-13, -0.002, -0.001]))
    assert look(problem, samples).candidates == ()


def test_fingertip_that_leaves_the_top_of_its_side_is_seen() -> None:
    """The left tip rises above the block's height of 0.035 m at x = -0.0043."""
    problem = pushed_block(height=0.035)
    system = ContactSystem(problem)
    samples = slide(problem, np.array([0.0, -0.002, -0.004, -0.0045]))
    sighting = look(problem, samples)
    (candidate,) = (c for c in sighting.candidates if c.kind is EventKind.EDGE_END)
    assert sighting.interval == 2
    assert candidate.index == system.pair(parse_contact(TIPS[0]))
    # Edge 3 runs down: its beginning is at the top.
    assert candidate.target == 0.0
    assert 0.0 < candidate.fraction < 1.0


@pytest.mark.parametrize('joint', [0, 1])
@pytest.mark.parametrize('side', [-1.0, 1.0])
def test_joint_limit_is_seen_with_its_angle(joint: int, side: float) -> None:
    problem = pushed_block(limits=(0.2, 2.9))
    system = ContactSystem(problem)
    limit = 2.9 if side > 0.0 else 0.2
    samples = np.tile(at(system, 0.0, pushed_angles(0.0)), (3, 1))
    samples[:, 3 + joint] = limit + side * np.array([-0.1, -0.03, 0.01])
    sighting = look(problem, samples)
    assert sighting.interval == 1
    (candidate,) = (c for c in sighting.candidates if c.kind is EventKind.JOINT_LIMIT)
    assert (candidate.index, candidate.target) == (joint, limit)
    assert candidate.fraction == pytest.approx(0.75)


def test_joint_limit_is_seen_on_the_way_of_the_right_finger() -> None:
    problem = pushed_block(limits=(0.01, 2.9))
    x = BASE - HALF + RIGHT * math.cos(2.9)
    sighting = look(problem, slide(problem))
    assert PLACES[sighting.interval] > x > PLACES[sighting.interval + 1]
    assert seen(sighting) == {(EventKind.JOINT_LIMIT, 1)}


def test_links_that_meet_are_told_from_contacts() -> None:
    """The right finger's end meets the left finger at x = 0.0047 (see `leaning_fingers`)."""
    problem = leaning_fingers()
    system = ContactSystem(problem)
    places = np.array([0.0, 0.002, 0.004, 0.006])
    samples = np.array([at(system, x, leaning_angles(x)) for x in places])
    names = (*FEET, 'object.v3|left.link.e0', 'object.v2|right.link.e2')
    sighting = look(problem, samples, names)
    assert sighting.interval == 2
    assert {c.kind for c in sighting.candidates} == {EventKind.LINKS_MEET}
    assert all(c.index >= system.contact_count for c in sighting.candidates)


@pytest.mark.parametrize(
    ('foot', 'kind', 'turn'),
    [(0, EventKind.FLUSH_AFTER, 1.0), (1, EventKind.FLUSH_BEFORE, -1.0)],
)
def test_edge_that_comes_to_lie_on_the_palm_is_seen(
    foot: int, kind: EventKind, turn: float
) -> None:
    """The block stands on one corner and is turned back onto its base, and further."""
    problem = pushed_block()
    system = ContactSystem(problem)
    # The frame lies half way between the feet.
    corner = (-HALF, HALF)[foot]
    angles = turn * np.array([0.05, 0.03, -0.01])
    samples = np.tile(at(system, 0.0, ASIDE), (3, 1))
    poses = [(corner - corner * math.cos(a), -corner * math.sin(a), a) for a in angles]
    offset = complex(0.0, problem.object.center_of_mass[1])
    for z, (x, y, a) in zip(samples, poses, strict=True):
        center = (complex(x, y) + offset * np.exp(1j * a)) / system.size
        z[:3] = center.real, center.imag, a
    sighting = look(problem, samples, (FEET[foot],))
    assert sighting.interval == 1
    (flush,) = (c for c in sighting.candidates if c.kind is kind)
    assert flush.index == system.pair(parse_contact(FEET[foot]))
    # The block's other foot comes down at the same time.
    others = {(EventKind.CONTACT, system.pair(parse_contact(FEET[1 - foot])))}
    assert seen(sighting) == {(kind, flush.index)} | others


@pytest.mark.parametrize(
    ('clearance', 'closer'), [(-1e-5, True), (-3e-4, True), (1e-5, False), (1e-3, False)]
)
def test_gap_that_may_close_and_open_between_samples_gets_a_closer_look(
    clearance: float, closer: bool
) -> None:
    """A corner swings past the palm, lowest between the second and the third sample.

    Its distance from the palm is that from the centre, less cosine times the corner's radius.
    """
    problem = pushed_block()
    system = ContactSystem(problem)
    x, y = problem.object.vertices[0] - problem.object.center_of_mass
    radius = math.hypot(x, y) / system.size
    hanging = -math.pi / 2 - math.atan2(y, x)
    swing = hanging + np.array([-0.16, -0.06, 0.04, 0.14])
    samples = np.tile(at(system, 0.0, ASIDE), (4, 1))
    samples[:, 1] = radius + clearance
    samples[:, 2] = swing
    sighting = sight(system, Formation(()), samples, system.place(samples))
    assert (sighting.closer, sighting.candidates) == (closer, ())
    assert sighting.interval == (1 if closer else 3)


def test_first_of_two_events_counts() -> None:
    """The wall stops the block before the joint limit at x = -0.0037."""
    problem = pushed_block(limits=(0.01, 2.9), palms=[WALL])
    sighting = look(problem, slide(problem, np.array([0.0, -0.0035, -0.0041])))
    assert sighting.interval == 0
    assert {kind for kind, _ in seen(sighting)} == {EventKind.CONTACT}


def test_both_events_of_one_interval_are_candidates() -> None:
    problem = pushed_block(limits=(0.01, 2.9), palms=[WALL])
    sighting = look(problem, slide(problem, np.array([0.0, -0.0025, -0.0041])))
    assert {kind for kind, _ in seen(sighting)} == {EventKind.CONTACT, EventKind.JOINT_LIMIT}
