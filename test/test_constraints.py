"""Plans that keep what their caller asks of every configuration on the way."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from cfplan_core import (
    CfplanError,
    Goal,
    PlanOptions,
    PlanResult,
    Problem,
    Status,
    load_problem,
    plan,
    verify_plan,
)
from cfplan_core.contact.held import HeldSystem
from cfplan_core.contact.system import ContactSystem
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.planning.constraints import CROWDED, contact_number
from cfplan_core.planning.grasp_check import examine_grasp
from cfplan_core.planning.roadmap import Roadmap
from cfplan_core.verification.mechanism import mechanism_of
from cfplan_core.verification.touching import touching_pairs

PROBLEMS = Path(__file__).parents[1] / 'config' / 'problems'
BOX = ((-0.1, -0.01), (0.1, -0.01), (0.1, 0.1), (-0.1, 0.1))


@cache
def problem_of(name: str) -> Problem:
    return load_problem(PROBLEMS / f'{name}.yaml')


@cache
def planned(name: str, options: PlanOptions) -> PlanResult:
    return plan(problem_of(name), options)


def certified(name: str, options: PlanOptions) -> PlanResult:
    result = planned(name, options)
    assert result.status is Status.SOLVED, result.message
    assert verify_plan(problem_of(name), result).failures == ()
    return result


def touching_names(problem: Problem, result: PlanResult) -> list[dict[str, complex]]:
    """What touches in each frame, and where, as the verification sees it."""
    mechanism = mechanism_of(problem)
    return [
        {
            name: touch.point
            for name, (_, touch) in touching_pairs(
                mechanism, mechanism.scene(pose, joints)
            ).items()
        }
        for pose, joints in zip(result.object_poses, result.joints, strict=True)
    ]


def contacts_of(places: dict[str, complex]) -> int:
    """Number of contacts; a vertex on a vertex is two, however many elements meet there."""
    at = Counter(
        (name.split('|')[1].rsplit('.', 1)[0], round(z.real, 7), round(z.imag, 7))
        for name, z in places.items()
    )
    return sum(min(count, 2) for count in at.values())


def solved_with_four_contacts() -> list[str]:
    return ['h013', 'h020', 'h1181', 'h122', 'trinkle_hunter_1991']


@pytest.mark.parametrize('name', solved_with_four_contacts())
def test_at_most_four_contacts_touch_in_any_frame(name: str) -> None:
    result = certified(name, PlanOptions(max_contacts=4))
    counts = [contacts_of(places) for places in touching_names(problem_of(name), result)]
    assert max(counts) == 4
    for before, after in zip(result.segments[:-1], result.segments[1:], strict=True):
        assert len({*before.contacts, *after.contacts}) <= 4


def test_without_the_limit_five_contacts_touch() -> None:
    result = certified('trinkle_hunter_1991', PlanOptions())
    places = touching_names(problem_of('trinkle_hunter_1991'), result)
    assert max(map(contacts_of, places)) > 4


def test_the_1991_reorientation_is_possible_with_four_contacts_and_moderate_forces() -> None:
    options = PlanOptions(max_contacts=4, max_needed_force=3.0)
    result = certified('trinkle_hunter_1991', options)
    assert result.needed_force is not None
    assert result.needed_force <= 3.0
    assert {len(segment.contacts) for segment in result.segments} == {3, 4}


def test_three_contacts_leave_no_torque_to_choose() -> None:
    result = certified('trinkle_hunter_1991', PlanOptions(max_contacts=4))
    for segment in result.segments:
        frames = slice(segment.first_frame + 1, segment.last_frame + 1)
        width = (result.torque_upper - result.torque_lower)[frames].max()
        assert (width < 1e-9) == (len(segment.contacts) == 3)


def test_too_few_contacts_are_infeasible_and_say_so() -> None:
    result = planned('h447', PlanOptions(max_contacts=4))
    assert result.status is Status.INFEASIBLE
    assert f'as {CROWDED}: {result.statistics.failures[CROWDED]} ways' in result.message
    assert result.message.startswith('no path under max-contacts 4; explored ')


def test_answer_without_a_plan_names_each_constraint() -> None:
    options = PlanOptions(
        max_nodes=1,
        max_needed_force=3.0,
        max_contacts=5,
        forbidden=(('object.v2|palm.0.e2', 'object.v3|palm.0.e2'),),
        required=(('object.v2|right.link_2.e0',),),
        stay_within=BOX,
        second_order=False,
    )
    result = plan(problem_of('trinkle_hunter_1991'), options)
    assert result.status is Status.BUDGET_EXHAUSTED, result.message
    assert result.message.startswith(
        'budget of 1 nodes exhausted under max-needed-force 3, max-contacts 5, '
        'forbid object.v2|palm.0.e2,object.v3|palm.0.e2, require object.v2|right.link_2.e0, '
        "stay-within '-0.1,-0.01 0.1,-0.01 0.1,0.1 -0.1,0.1', no-second-order; explored "
    )
    free = plan(problem_of('trinkle_hunter_1991'), PlanOptions(max_nodes=1))
    assert free.message.startswith('budget of 1 nodes exhausted; explored ')


def test_a_start_with_more_contacts_is_refused() -> None:
    result = planned('h013', PlanOptions(max_contacts=3))
    assert result.status is Status.INVALID
    assert 'start: got 4 contacts' in result.message
    assert 'expected at most 3 contacts' in result.message


@pytest.mark.parametrize(
    ('name', 'contact'),
    [('h013', 'object.e2|left.link_1.v1'), ('trinkle_hunter_1991', 'object.e3|left.link_1.v1')],
)
def test_a_forbidden_contact_touches_nowhere(name: str, contact: str) -> None:
    problem = problem_of(name)
    free = certified(name, PlanOptions())
    assert any(contact in places for places in touching_names(problem, free))
    result = certified(name, PlanOptions(forbidden=((contact,),)))
    assert not any(contact in places for places in touching_names(problem, result))


def test_contacts_that_are_forbidden_together_may_touch_one_by_one() -> None:
    problem = problem_of('trinkle_hunter_1991')
    free = certified('trinkle_hunter_1991', PlanOptions())
    ends = {*free.segments[0].contacts, *free.segments[-1].contacts}
    middle = free.segments[len(free.segments) // 2].contacts
    pair = tuple([*(c for c in middle if c in ends), *(c for c in middle if c not in ends)][-2:])
    result = certified('trinkle_hunter_1991', PlanOptions(forbidden=(pair,)))
    frames = touching_names(problem, result)
    assert not any(set(pair) <= set(places) for places in frames)


def test_a_start_with_a_forbidden_contact_is_refused() -> None:
    contact = certified('h013', PlanOptions()).segments[0].contacts[0]
    result = planned('h013', PlanOptions(forbidden=((contact,),)))
    assert result.status is Status.INVALID
    assert f'expected not {contact}, which is forbidden' in result.message


def test_a_required_formation_is_passed_through() -> None:
    free = certified('h120', PlanOptions(prefer='shortest'))
    others = certified('h120', PlanOptions())
    visited = [set(segment.contacts) for segment in free.segments]
    wanted = next(
        s.contacts for s in others.segments if not any(set(s.contacts) <= v for v in visited)
    )
    result = certified('h120', PlanOptions(required=(wanted,)))
    assert any(set(wanted) <= set(segment.contacts) for segment in result.segments)


def test_a_formation_that_cannot_be_reached_is_infeasible() -> None:
    result = planned('h120', PlanOptions(required=(('object.v0|left.link_1.e3',),)))
    assert result.status is Status.INFEASIBLE


def test_the_object_stays_in_its_region() -> None:
    name = 'h122'
    problem = problem_of(name)
    free = certified(name, PlanOptions())
    corners = np.concatenate([problem.object.world_vertices(q) for q in free.object_poses])
    (left, low), (right, high) = corners.min(axis=0) - 1e-3, corners.max(axis=0) + 1e-3
    lower = high - 2e-3
    region = ((left, low), (right, low), (right, lower), (left, lower))
    result = certified(name, PlanOptions(stay_within=region))
    kept = np.concatenate([problem.object.world_vertices(q) for q in result.object_poses])
    assert corners[:, 1].max() > lower >= kept[:, 1].max()


def test_a_goal_outside_the_region_is_refused() -> None:
    region = ((-0.1, -0.01), (0.0, -0.01), (0.0, 0.1), (-0.1, 0.1))
    result = planned('trinkle_hunter_1991', PlanOptions(stay_within=region))
    assert result.status is Status.INVALID
    assert 'outside the region' in result.message


def with_held_joint(name: str, held: str) -> Problem:
    """A problem whose goal is what the other joint can reach, on a curve of three contacts."""
    problem = problem_of(name)
    whole = ContactSystem(problem)
    start = examine_grasp(whole, FrictionlessModel(whole.load), problem.start, 'start', '').z
    system = HeldSystem(whole, (held,), start)
    roadmap = Roadmap(system, FrictionlessModel(system.load))
    (curve,) = {piece for _, piece in roadmap.neighbours(roadmap.root(system.reduced(start)))}
    assert (curve.dimension, len(curve.formation)) == (1, 3)
    z = system.expanded(curve.points)[len(curve.points) // 2]
    joints = dict(zip(whole.joint_names, z[3:].tolist(), strict=True))
    return replace(problem, goal=Goal(whole.object_poses(z[None])[0], joints))


@pytest.mark.parametrize('held', ['left_joint', 'right_joint'])
@pytest.mark.parametrize('name', ['h013', 'h020', 'h122'])
def test_a_held_joint_does_not_move(name: str, held: str) -> None:
    problem = with_held_joint(name, held)
    result = plan(problem, PlanOptions(held_joints=(held,)))
    assert result.status is Status.SOLVED, result.message
    assert verify_plan(problem, result).failures == ()
    moved = np.ptp(result.joints, axis=0)
    assert moved[problem.hand.joint_names.index(held)] == 0.0
    assert moved.max() > 0.01


def test_a_held_joint_that_the_goal_wants_elsewhere_is_refused() -> None:
    result = planned('h013', PlanOptions(held_joints=('left_joint',)))
    assert result.status is Status.INVALID
    assert 'goal.joints.left_joint: got 1.14494475 rad of a joint that is held' in result.message


@pytest.mark.parametrize(
    ('options', 'message'),
    [
        (PlanOptions(forbidden=(('object.v0|thumb.tip.e0',),)), 'forbidden: contact object.v0'),
        (PlanOptions(required=(('nothing',),)), 'required:'),
        (PlanOptions(held_joints=('elbow',)), "held_joints: got 'elbow', expected names of left_"),
    ],
)
def test_names_that_the_problem_does_not_have_are_refused(
    options: PlanOptions, message: str
) -> None:
    result = planned('h013', options)
    assert result.status is Status.INVALID
    assert message in result.message


@pytest.mark.parametrize(
    'corners',
    [
        BOX[:2],
        BOX[::-1],
        ((0.0, 0.0), (1.0, 0.0), (0.2, 0.2), (0.0, 1.0)),
        ((0.0, 0.0), (1.0, 0.0), (2.0, 0.0)),
        ((0.0, 0.0), (1.0, 0.0), (np.nan, 1.0)),
        # A five-pointed star turns left everywhere.
        tuple((np.cos(k * 0.8 * np.pi), np.sin(k * 0.8 * np.pi)) for k in range(5)),
    ],
)
def test_a_region_that_is_no_convex_polygon_is_refused(
    corners: tuple[tuple[float, float], ...],
) -> None:
    with pytest.raises(CfplanError, match=r'stay_within: got .*, expected at least three corners'):
        PlanOptions(stay_within=corners)


def test_a_vertex_on_a_vertex_counts_as_two_contacts() -> None:
    together = np.zeros((6, 6), dtype=bool)
    together[2:, 2:] = ~np.eye(4, dtype=bool)
    assert contact_number(together) == 4
    assert contact_number(together[:2, :2]) == 2
