from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from planning.scenes import (
    BASE,
    EQUAL_HEIGHTS,
    FEET,
    HALF,
    LEFT,
    RIGHT,
    TIPS,
    at,
    formation,
    leaning_angles,
    leaning_fingers,
    leaning_tower,
    onwards,
    pushed_angles,
    pushed_block,
    squeezed_angles,
    squeezed_trapezoid,
    tracer_of,
    x_of,
)
from random_problems import explore, random_problem

from cfplan_core.contact.elements import parse_contact
from cfplan_core.contact.gaps import gaps, wedge_lifts
from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import Stability
from cfplan_core.model import Problem
from cfplan_core.planning import tracing
from cfplan_core.planning.events import OPEN_EVENTS, EventKind
from cfplan_core.planning.tracing import STEP, Trace, classify

# Its corner, vertex 2, stops the block's left side at x = -0.003.
WALL = [(-0.03, 0.004), (-0.025, 0.004), (-0.023, 0.007), (-0.025, 0.01), (-0.03, 0.01)]
LEFTWARDS, RIGHTWARDS = -np.eye(5)[0], np.eye(5)[0]
CORNERS = ('object.v3|left.link.e0', 'object.v2|right.link.e2')


def slide(
    problem: Problem,
    heading: FloatArray,
    x: float = 0.0,
    longest: float = 100.0,
    names: Sequence[str] = (*FEET, *TIPS),
) -> tuple[ContactSystem, Trace]:
    system = ContactSystem(problem)
    angles = pushed_angles(x) if TIPS[0] in names else leaning_angles(x)
    kept = formation(system, *names)
    start = at(system, x, angles)
    return system, tracer_of(system).follow(kept, start, onwards(heading), longest=longest)


def largest_gap(system: ContactSystem, z: FloatArray, pairs: Sequence[int]) -> float:
    index = np.array(pairs, dtype=np.intp)
    return float(np.abs(gaps(system, system.place(z[None]), index).gap).max())


def test_pushed_block_slides_straight_with_the_fingertips_on_their_circles() -> None:
    system, trace = slide(pushed_block(), LEFTWARDS)
    places = system.object_poses(trace.points)[:, 0]
    expected = [at(system, x, pushed_angles(x)) for x in places]
    assert len(places) > 5
    np.testing.assert_allclose(trace.points, expected, atol=1e-9)
    assert (np.diff(places) < 0.0).all()


def test_steps_are_not_longer_than_asked_for() -> None:
    _, trace = slide(pushed_block(), LEFTWARDS)
    assert np.abs(np.diff(trace.points, axis=0)).max() <= 1.5 * STEP


@pytest.mark.parametrize('fraction', [0.25, 0.5])
def test_shorter_steps_follow_the_same_curve_to_the_same_end(
    fraction: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = pushed_block(palms=[WALL])
    _, coarse = slide(problem, LEFTWARDS)
    monkeypatch.setattr(tracing, 'STEP', fraction * STEP)
    _, fine = slide(problem, LEFTWARDS)
    assert len(fine.points) > 1.5 * len(coarse.points)
    assert (fine.kind, fine.pairs) == (coarse.kind, coarse.pairs)
    np.testing.assert_allclose(fine.end, coarse.end, atol=1e-10)


def test_wall_ends_the_curve_where_the_block_touches_it() -> None:
    system, trace = slide(pushed_block(palms=[WALL]), LEFTWARDS)
    assert (trace.kind, system.contact_names(trace.pairs)) == (
        EventKind.CONTACT,
        ('object.e3|palm.1.v2',),
    )
    assert x_of(system, trace.end) == pytest.approx(-0.003, abs=1e-12)
    assert largest_gap(system, trace.end, trace.pairs) < 1e-9


def test_joint_limit_ends_the_curve_at_its_angle() -> None:
    system, trace = slide(pushed_block(limits=(0.01, 2.9)), LEFTWARDS)
    assert (trace.kind, trace.pairs) == (EventKind.JOINT_LIMIT, (1,))
    assert trace.end[4] == pytest.approx(2.9, abs=1e-12)
    expected = BASE - HALF + RIGHT * math.cos(2.9)
    assert x_of(system, trace.end) == pytest.approx(expected, abs=1e-12)


def test_end_of_an_edge_ends_the_curve_where_the_fingertip_reaches_the_corner() -> None:
    height = 0.035
    system, trace = slide(pushed_block(height=height), LEFTWARDS)
    # At the same place the corner reaches the edges beside the fingertip.
    assert trace.kind in OPEN_EVENTS
    expected = HALF - BASE + math.sqrt(LEFT**2 - height**2)
    assert x_of(system, trace.end) == pytest.approx(expected, abs=1e-12)
    tip = formation(system, TIPS[0]).array
    assert abs(gaps(system, system.place(trace.end[None]), tip).offset[0, 0]) < 1e-9


def test_stability_ends_where_the_fingertips_are_level() -> None:
    system, trace = slide(leaning_tower(), RIGHTWARDS)
    assert trace.kind is EventKind.UNSTABLE
    assert x_of(system, trace.end) == pytest.approx(EQUAL_HEIGHTS, abs=1e-6)
    margins = tracer_of(system).margins(formation(system, *FEET, *TIPS), trace.end[None])
    assert 0.0 < margins.stable[0] < 1e-4


@pytest.mark.parametrize('longer', [0.08, 0.083])
def test_links_end_the_curve_where_one_reaches_the_other(longer: float) -> None:
    """The crossing is at 1.5 times the corner's distance from the right finger's base."""
    problem = leaning_fingers(right=longer)
    system, trace = slide(problem, RIGHTWARDS, names=(*FEET, *CORNERS))
    assert trace.kind is EventKind.LINKS_MEET
    expected = BASE - HALF - math.sqrt((longer / 1.5) ** 2 - 0.04**2)
    assert x_of(system, trace.end) == pytest.approx(expected, abs=1e-12)
    assert largest_gap(system, trace.end, trace.pairs) < 1e-9


def test_path_is_followed_no_longer_than_asked_for() -> None:
    _, trace = slide(pushed_block(), LEFTWARDS, longest=0.1)
    assert trace.kind is EventKind.FAR
    assert 0.1 <= np.abs(trace.end - trace.points[0]).max() < 0.1 + 12 * STEP


def test_steering_that_has_arrived_ends_the_curve() -> None:
    """Steered to x = -0.002 as far as the curve's tangent points there."""
    system = ContactSystem(pushed_block())
    start, target = (at(system, x, pushed_angles(x)) for x in (0.0, -0.002))

    def steer(z: FloatArray, basis: FloatArray) -> FloatArray | None:
        ahead = np.asarray(basis.T @ (basis @ (target - z)))
        return ahead if np.abs(ahead).max() > 1e-11 else None

    trace = tracer_of(system).follow(formation(system, *FEET, *TIPS), start, steer)
    assert trace.kind is EventKind.TARGET
    np.testing.assert_allclose(trace.end, target, atol=1e-10)


def test_curve_without_stability_is_not_followed() -> None:
    _, trace = slide(leaning_tower(), RIGHTWARDS, x=EQUAL_HEIGHTS + 0.001)
    assert trace.kind is EventKind.UNSTABLE
    assert len(trace.points) == 1


@pytest.mark.parametrize('x', [-0.0035, -0.002, 0.0, 0.002])
def test_way_back_ends_where_the_way_there_began(x: float) -> None:
    """From the joint limit to the other end, from wherever on the curve it was reached."""
    problem = pushed_block(limits=(0.01, 2.9))
    system, there = slide(problem, LEFTWARDS, x=x)
    kept = formation(system, *FEET, *TIPS)
    back = tracer_of(system).follow(kept, there.end, onwards(RIGHTWARDS))
    _, onward = slide(problem, RIGHTWARDS, x=x)
    assert (back.kind, back.pairs) == (onward.kind, onward.pairs)
    np.testing.assert_allclose(back.end, onward.end, atol=1e-6)


@pytest.mark.parametrize('seed', [8, 15, 22, 29])
def test_curves_of_random_problems_are_the_same_forwards_and_backwards(seed: int) -> None:
    """Between events at both ends; a change of class is no event for the tracer."""
    explored = explore(random_problem(seed))
    tracer = explored.roadmap.tracer
    count = 0
    for piece in explored.pieces:
        junctions = [end for end in piece.ends if end is not None and end.around is not None]
        if piece.dimension != 1 or len(junctions) < 2 or len(piece.points) < 5:
            continue
        middle = piece.points[len(piece.points) // 2]
        ahead = piece.points[len(piece.points) // 2 + 1] - middle
        for heading, end in ((ahead, piece.points[-1]), (-ahead, piece.points[0])):
            trace = tracer.follow(piece.formation, middle, onwards(heading))
            np.testing.assert_allclose(trace.end, end, atol=1e-9)
            count += 1
    assert count >= 4


def off_their_root(system: ContactSystem, trace: Trace) -> float:
    """How far the functions are from zero whose roots a trace's events are, the largest."""
    placed = system.place(trace.end[None])
    pairs = np.array(trace.pairs, dtype=np.intp)
    if trace.kind is EventKind.JOINT_LIMIT:
        angles = trace.end[3:][pairs]
        limits = np.stack([system.lower[pairs], system.upper[pairs]])
        return float(np.abs(angles - limits).min(axis=0).max())
    gap, offset = (values[0] for values in gaps(system, placed, pairs))
    if trace.kind is EventKind.EDGE_END:
        return float(np.minimum(np.abs(offset), np.abs(offset - system.pair_length[pairs])).max())
    if trace.kind in (EventKind.FLUSH_AFTER, EventKind.FLUSH_BEFORE):
        side = 0 if trace.kind is EventKind.FLUSH_AFTER else 1
        return float(np.abs(wedge_lifts(system, placed, pairs)[side]).max())
    return float(np.abs(gap).max())


@pytest.mark.parametrize('seed', range(40))
def test_events_on_curves_of_random_problems_lie_on_their_roots(seed: int) -> None:
    explored = explore(random_problem(seed))
    tracer, system = explored.roadmap.tracer, explored.system
    for piece in explored.pieces:
        if piece.dimension == 1:
            middle = len(piece.points) // 2
            start, before = piece.points[middle], piece.points[middle - 1]
            for heading in (start - before, before - start):
                trace = tracer.follow(piece.formation, start, onwards(heading))
                if trace.kind is not EventKind.UNSTABLE:
                    assert off_their_root(system, trace) < 1e-9


def test_trapezoid_is_followed_through_a_change_of_its_class() -> None:
    """Losing form closure is no event: the object is still held by its weight."""
    system = ContactSystem(squeezed_trapezoid())
    tracer, kept = tracer_of(system), formation(system, *FEET, *TIPS)
    start = at(system, 0.0, squeezed_angles(0.0))
    trace = tracer.follow(kept, start, onwards(RIGHTWARDS))
    margins = tracer.margins(kept, trace.points)
    classes = {classify(tracer.margins(kept, z[None])) for z in trace.points}
    assert classes == {Stability.FORM_CLOSURE, Stability.FORCE_CLOSURE}
    assert (margins.stable > 0.0).all()


@pytest.mark.parametrize(
    ('problem', 'x', 'expected'),
    [
        (pushed_block(), 0.0, Stability.FORCE_CLOSURE),
        (pushed_block(), EQUAL_HEIGHTS, Stability.FORCE_CLOSURE),
        (leaning_tower(), EQUAL_HEIGHTS - 1e-4, Stability.FORCE_CLOSURE),
        (leaning_tower(), EQUAL_HEIGHTS, Stability.UNSTABLE),
        (leaning_tower(), EQUAL_HEIGHTS + 1e-4, Stability.UNSTABLE),
    ],
)
def test_class_follows_from_the_heights_of_the_fingertips(
    problem: Problem, x: float, expected: Stability
) -> None:
    system = ContactSystem(problem)
    z = at(system, x, pushed_angles(x))
    margins = tracer_of(system).margins(formation(system, *FEET, *TIPS), z[None])
    assert classify(margins) is expected


def test_search_can_be_stopped_within_a_curve() -> None:
    class StopError(Exception):
        pass

    def checkpoint() -> None:
        raise StopError

    system = ContactSystem(pushed_block())
    model = tracer_of(system).model
    tracer = tracing.Tracer(system, model, checkpoint)
    start = at(system, 0.0, pushed_angles(0.0))
    with pytest.raises(StopError):
        tracer.follow(formation(system, *FEET, *TIPS), start, onwards(LEFTWARDS))


def test_departing_contact_may_open_and_is_met_again_elsewhere() -> None:
    """From the wall to the right the wall's contact opens; turned back it is the event."""
    problem = pushed_block(palms=[WALL])
    system = ContactSystem(problem)
    kept = formation(system, *FEET, *TIPS)
    wall = system.pair(parse_contact('object.e3|palm.1.v2'))
    start = at(system, -0.003, pushed_angles(-0.003))
    away = tracer_of(system).follow(kept, start, onwards(RIGHTWARDS), frozenset({wall}))
    assert (away.kind, away.pairs) == (EventKind.JOINT_LIMIT, (0,))
    back = tracer_of(system).follow(kept, away.end, onwards(LEFTWARDS))
    assert (back.kind, back.pairs) == (EventKind.CONTACT, (wall,))
    np.testing.assert_allclose(back.end, start, atol=1e-9)
