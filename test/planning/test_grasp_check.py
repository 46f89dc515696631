from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cfplan_core.contact.gaps import gaps
from cfplan_core.contact.system import ContactSystem
from cfplan_core.mechanics.contact_model import Stability
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.model import Finger, Goal, Grasp, Hand, Joint, Link, ManipulatedObject, Problem
from cfplan_core.model.loading import load_problem
from cfplan_core.planning.grasp_check import check_problem, describe_grasp, examine_grasp

PROBLEMS = sorted((Path(__file__).parents[2] / 'config' / 'problems').glob('*.yaml'))
Polygon = Sequence[tuple[float, float]]

TABLE = [(-0.5, -0.1), (0.5, -0.1), (0.5, 0.0), (-0.5, 0.0)]
BLOCK = [(-0.02, 0.0), (0.02, 0.0), (0.02, 0.04), (-0.02, 0.04)]
FEET = ('object.v0|palm.0.e2', 'object.v1|palm.0.e2')
NOSES = ('object.e3|left.link.v1', 'object.e1|right.link.v2')


def hinge(name: str, base: tuple[float, float], base_angle: float, *outlines: Polygon) -> Finger:
    """A finger with a link for each outline, 0.05 m from joint to joint."""
    count = len(outlines)
    names = ['link'] if count == 1 else [f'link_{k}' for k in range(count)]
    return Finger(
        name,
        base,
        base_angle,
        tuple(Joint(f'{name}_{k}', -4.0, 4.0, 1.0, 5.0) for k in range(count)),
        tuple(Link(n, 0.05, outline) for n, outline in zip(names, outlines, strict=True)),
    )


def bar() -> Polygon:
    return [(0.0, -0.002), (0.05, -0.002), (0.05, 0.002), (0.0, 0.002)]


LEFT = hinge('left', (-0.03, 0.0), math.pi / 2, [(0.0, 0.0), (0.03, -0.01), (0.06, 0.0)])
RIGHT = hinge('right', (0.03, 0.0), math.pi / 2, [(0.0, 0.0), (0.02, 0.0), (0.01, 0.01)])


def block(
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
    fingers: Sequence[Finger] = (LEFT, RIGHT),
    joints: Sequence[float] | None = None,
    palms: Sequence[Polygon] = (TABLE,),
    goal: Goal | None = None,
    friction: float = 0.0,
) -> Problem:
    """A block on a table between the noses of two upright fingers: force closure."""
    hand = Hand(tuple(palms), tuple(fingers))
    grasp = Grasp(pose, np.zeros(len(hand.joints)) if joints is None else joints)
    thing = ManipulatedObject(BLOCK, 0.1)
    anything = Goal(joints=dict.fromkeys(hand.joint_names[:1], 0.0))
    return Problem('block', (0.0, -9.81), hand, thing, friction, grasp, goal or anything)


def whole_goal(pose: tuple[float, float, float], *contacts: str) -> Goal:
    return Goal(pose, {'left_0': 0.0, 'right_0': 0.0}, contacts or None)


def only_finding(problem: Problem) -> tuple[str, str, str]:
    (finding,) = check_problem(problem, 'a.yaml')
    assert finding.file == 'a.yaml'
    return finding.field, finding.value, finding.expected


def test_sound_problem_has_no_findings() -> None:
    assert check_problem(block(goal=whole_goal((0.0, 0.0, 0.0), *FEET))) == ()


@pytest.mark.parametrize('path', PROBLEMS, ids=lambda path: path.stem)
def test_example_problem_has_no_findings(path: Path) -> None:
    assert check_problem(load_problem(path)) == ()


def test_grasp_is_described_by_contacts_stability_and_dimension() -> None:
    """Two joints and three coordinates, four contacts."""
    problem = block()
    described = describe_grasp(problem, problem.start)
    assert described.contacts == (*FEET, *NOSES)
    assert (described.stability, described.dimension) == ('force_closure', 1)


def test_redundant_contacts_do_not_reduce_the_dimension() -> None:
    """A table in two parts: the second part's corner touches the same edge."""
    halves = [[(-0.5, -0.1), (x, -0.1), (x, 0.0), (-0.5, 0.0)] for x in (0.5, 0.01)]
    described = describe_grasp(block(palms=halves), block().start)
    assert len(described.contacts) == 6
    assert described.dimension == 1


def test_1991_problem_starts_in_form_closure_and_ends_in_force_closure() -> None:
    problem = load_problem(next(path for path in PROBLEMS if '1991' in path.stem))
    goal = problem.goal.grasp(problem.hand)
    assert goal is not None
    assert describe_grasp(problem, problem.start).stability == 'form_closure'
    assert describe_grasp(problem, goal).stability == 'force_closure'


def test_object_in_the_palm_is_found_with_its_depth() -> None:
    assert only_finding(block((0.0, -0.0015, 0.0))) == (
        'start.object_pose',
        'the object 0.0015 m deep in palm.0',
        'at most 1e-06 m',
    )


@settings(max_examples=20)
@given(depth=st.floats(2e-6, 9e-3))
def test_link_in_the_object_is_found_with_its_depth(depth: float) -> None:
    """Upright fingers, so that a shift to the left drives the left nose in and frees the right."""
    field, value, _ = only_finding(block((-depth, 0.0, 0.0)))
    assert field == 'start.object_pose'
    assert value == f'the object {depth:.3g} m deep in left.link'


def test_link_that_swallows_the_object_is_found() -> None:
    jaws = [(-0.1, -0.1), (0.2, -0.1), (0.2, 0.1), (-0.1, 0.1)]
    findings = check_problem(block(fingers=[hinge('left', (0.0, 0.0), 0.0, jaws)]))
    assert any('m deep in left.link' in finding.value for finding in findings)


def test_links_of_different_fingers_that_cross_are_found() -> None:
    one, other = hinge('a', (0.3, 0.1), 0.0, bar()), hinge('b', (0.32, 0.08), math.pi / 2, bar())
    assert only_finding(block(fingers=[LEFT, RIGHT, one, other])) == (
        'start.joints',
        'a.link and b.link overlapping by 0.002 m',
        'at most 1e-06 m',
    )


def test_links_that_coincide_are_found() -> None:
    twins = [hinge(name, (0.3, 0.1), 0.0, bar()) for name in ('a', 'b')]
    field, value, _ = only_finding(block(fingers=[LEFT, RIGHT, *twins]))
    assert field == 'start.joints'
    assert value == 'a.link and b.link overlapping by 0.002 m'


@pytest.mark.parametrize(
    ('joints', 'overlapping'),
    [
        ((1.0, 0.1, -0.1), set()),
        ((1.0, 2.9, -2.0), set()),
        ((1.0, 2.5, 2.5), {('chain.link_0', 'chain.link_2')}),
        ((-0.3, 0.0, 0.0), {('palm.0', 'chain.link_1'), ('palm.0', 'chain.link_2')}),
        ((0.0, 0.5, 0.0), set()),
    ],
)
def test_links_overlap_with_all_but_neighbours_and_the_first_with_the_palm(
    joints: tuple[float, float, float], overlapping: set[tuple[str, str]]
) -> None:
    """Lying flat, the first link reaches 5 mm into the table."""
    fat = [(0.0, -0.01), (0.05, -0.01), (0.05, 0.002), (0.0, 0.002)]
    chain = hinge('chain', (0.2, 0.005), 0.0, fat, bar(), bar())
    found = check_problem(block(fingers=[LEFT, RIGHT, chain], joints=(0.0, 0.0, *joints)))
    assert {tuple(f.value.split(' overlapping')[0].split(' and ')) for f in found} == overlapping


def test_object_that_touches_nothing_is_told_what_it_nearly_touches() -> None:
    field, value, expected = only_finding(block((0.0, 0.001, 0.0), fingers=[]))
    assert field == 'start'
    assert value == (
        'no contact; object.v0|palm.0.e2 is 0.001 m apart, object.v1|palm.0.e2 is 0.001 m apart '
        '(all 2 near by touch at object_pose [0.000000000, 0.000000000, 0.000000000], joints [])'
    )
    assert expected == 'contacts within 1e-06 m that hold the object'


def test_object_far_from_everything_is_told_that_nothing_touches() -> None:
    assert only_finding(block((0.0, 0.3, 0.0), fingers=[]))[:2] == ('start', 'no contact')


def test_object_on_the_palm_alone_is_refused_with_its_margin() -> None:
    field, value, expected = only_finding(block(fingers=[]))
    assert field == 'start'
    assert value.startswith(f'an unstable grasp, contacts {", ".join(FEET)} (stability margin ')
    margin = float(value.split('stability margin ')[1].partition(')')[0])
    assert margin <= 1e-12
    assert expected.endswith('balance the weight (margin above zero)')


def test_unstable_grasp_is_told_what_it_nearly_touches() -> None:
    """The right finger is turned 0.1 mm / 10 mm away."""
    _, value, _ = only_finding(block(joints=(0.0, -0.01)))
    assert 'an unstable grasp' in value
    assert '; object.e1|right.link.v2 is 0.0001' in value


@pytest.mark.parametrize('tilt', np.linspace(0.1, 6.1, 13))
def test_contacts_that_touch_are_not_near_misses(tilt: float) -> None:
    """Block and table turned together, so that gaps are zero but for rounding."""
    c, s = math.cos(tilt), math.sin(tilt)
    table = np.array(TABLE) @ [[c, s], [-s, c]]
    _, value, _ = only_finding(block((0.0, 0.0, tilt), fingers=[], palms=[table]))
    assert all(foot in value for foot in FEET)
    assert ' apart' not in value


def test_tip_held_from_one_side_is_unstable() -> None:
    assert 'an unstable grasp' in only_finding(block(fingers=[LEFT]))[1]


def test_vertex_on_a_vertex_is_refused_with_both_contacts() -> None:
    """The table ends under the block's left corner."""
    ends = [[(-0.02, -0.1), (0.5, -0.1), (0.5, 0.0), (-0.02, 0.0)]]
    lifted = hinge('left', (-0.03, 0.01), math.pi / 2, [(0.0, 0.0), (0.02, -0.01), (0.04, 0.0)])
    assert only_finding(block(palms=ends, fingers=[lifted, RIGHT])) == (
        'start',
        'a vertex on a vertex (object.v0|palm.0.e2 and object.e0|palm.0.v3 at one place)',
        'vertices on the inside of edges: a vertex cannot be held on a vertex',
    )


def test_friction_is_refused() -> None:
    assert only_finding(block(friction=0.3)) == (
        'contact.friction',
        '0.3',
        '0.0: contacts without friction',
    )


def test_contact_that_the_goal_lacks_is_named() -> None:
    goal = whole_goal((0.0, 0.0, 0.0), FEET[0], 'object.v2|palm.0.e2')
    assert only_finding(block(goal=goal)) == (
        'goal.contacts',
        'object.v2|palm.0.e2, which does not touch in the goal grasp',
        f'a contact of the goal grasp: {", ".join((*FEET, *NOSES))}',
    )


def test_goal_is_checked_like_the_start() -> None:
    """Shifted to the left onto one finger, lifted off the table."""
    findings = check_problem(block(goal=whole_goal((-0.001, 0.002, 0.0))))
    assert [finding.field for finding in findings] == ['goal.object_pose', 'goal']
    assert 'm deep in left.link' in findings[0].value
    assert 'no contact' in findings[1].value


def test_goal_in_part_is_not_checked() -> None:
    assert check_problem(block(goal=Goal(object_pose=(0.0, 0.5, 0.0)))) == ()


def test_everything_wrong_is_found_at_once() -> None:
    twins = [hinge(name, (0.3, 0.1), 0.0, bar()) for name in ('a', 'b')]
    goal = Goal(
        (0.0, 0.1, 0.0), dict.fromkeys(('left_0', 'right_0', 'a_0', 'b_0'), 0.0), (FEET[0],)
    )
    problem = block((0.0, -0.001, 0.0), [LEFT, RIGHT, *twins], goal=goal, friction=0.1)
    assert [finding.field for finding in check_problem(problem)] == [
        'contact.friction',
        'start.object_pose',
        'start.joints',
        'goal.joints',
        'goal',
        'goal.contacts',
    ]


@settings(max_examples=30)
@given(
    slip=st.tuples(*[st.floats(-4e-7, 4e-7)] * 2),
    tilt=st.floats(-1e-5, 1e-5),
    turns=st.tuples(*[st.floats(-5e-6, 5e-6)] * 2),
)
def test_grasp_within_a_micrometre_of_touching_is_put_on_its_contacts(
    slip: tuple[float, float], tilt: float, turns: tuple[float, float]
) -> None:
    problem = block((*slip, tilt), joints=turns)
    assert check_problem(problem) == ()
    system = ContactSystem(problem)
    examined = examine_grasp(system, FrictionlessModel(system.load), problem.start, '', '')
    assert system.contact_names(examined.pairs.tolist()) == (*FEET, *NOSES)
    assert examined.stability is Stability.FORCE_CLOSURE
    gap = gaps(system, system.place(examined.z[None]), examined.pairs).gap
    np.testing.assert_allclose(gap, 0.0, atol=1e-13)
    moved = np.abs(examined.z - system.configuration(problem.start)).max()
    assert moved < 1e-4


def test_grasp_two_micrometres_off_is_not_put_on_its_contacts() -> None:
    assert 'an unstable grasp' in only_finding(block((0.0, 2e-6, 0.0)))[1]


def test_weight_does_not_matter_to_what_is_found() -> None:
    heavy = block()
    heavy = replace(heavy, object=ManipulatedObject(BLOCK, 1e3))
    assert check_problem(heavy) == ()
