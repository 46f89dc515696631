"""Goals that leave something open, and tolerances that a plan may end anywhere within."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from planning.scenes import FEET, TABLE, TIPS, finger, pushed_angles, pushed_block
from planning.test_other_hands import four_joints
from random_problems import distant_goal, explore, random_problem
from scipy.optimize import brentq

from cfplan_core import PlanOptions, PlanResult, Status, plan, verify_plan
from cfplan_core.exploration import explore as explore_completely
from cfplan_core.model import Goal, Grasp, Hand, ManipulatedObject, Problem, Tolerance
from cfplan_core.planning.grasp_check import describe_grasp
from cfplan_core.planning.sheet_graph import Sheet

LENGTH, THICKNESS = 0.06, 0.004
UPPER = -1.35


def lean(phi: float) -> tuple[Grasp, float]:
    """The rod at an angle, its foot on the palm and its other end at the wall, and the joint."""
    c, s = math.cos(phi), math.sin(phi)
    joint = math.atan2(THICKNESS * c - 0.05, 0.05 - LENGTH * c - THICKNESS * s)
    return Grasp((-LENGTH * c, 0.0, phi), (joint,)), joint


def rod(goal: Goal) -> Problem:
    """One finger pushes a rod's foot along the palm: one curve, its angle given by the joint's."""
    wall = [(0.0, 0.0), (0.05, 0.0), (0.05, 0.1), (0.0, 0.1)]
    hanging = [(0.0, -0.004), (0.055, -0.004), (0.055, 0.0), (0.0, 0.0)]
    thing = ManipulatedObject(
        [(0.0, 0.0), (LENGTH, 0.0), (LENGTH, THICKNESS), (0.0, THICKNESS)], 0.1
    )
    only = finger('only', (-0.05, 0.05), hanging, limits=(-3.0, UPPER))
    hand = Hand((TABLE, wall), (only,))
    return Problem('rod', (0.0, -9.81), hand, thing, 0.0, lean(0.8)[0], goal)


STEEPEST = float(brentq(lambda phi: lean(phi)[1] - UPPER, 0.8, 1.2))


def solved(problem: Problem, options: PlanOptions | None = None) -> PlanResult:
    result = plan(problem, options)
    assert result.status is Status.SOLVED, result.message
    assert verify_plan(problem, result).failures == ()
    return result


# In closed form.


@pytest.mark.parametrize('phi', [0.7, 0.8, 0.9])
def test_orientation_alone_gives_joint_and_position(phi: float) -> None:
    result = solved(rod(Goal(orientation=phi)))
    grasp, joint = lean(phi)
    np.testing.assert_allclose(result.object_poses[-1], grasp.object_pose, atol=1e-9)
    np.testing.assert_allclose(result.joints[-1], [joint], atol=1e-9)


def test_position_alone_gives_joint_and_angle() -> None:
    grasp, _ = lean(0.9)
    result = solved(rod(Goal(position=grasp.object_pose[:2])))
    np.testing.assert_allclose(result.object_poses[-1], grasp.object_pose, atol=1e-9)


@pytest.mark.parametrize('beyond', [0.02, 0.1])
def test_tolerance_decides_whether_an_angle_beyond_reach_is_a_goal(beyond: float) -> None:
    """The joint's limit ends the curve."""

    def answer(tolerance: float) -> PlanResult:
        goal = Goal(orientation=STEEPEST + beyond, tolerance=Tolerance(angle=tolerance))
        return plan(rod(goal))

    assert answer(beyond * 1.01).solved
    refused = answer(beyond * 0.99)
    assert refused.status is Status.INFEASIBLE
    assert f'the object {beyond:.3g} rad off, {beyond * 0.99:g} allowed' in refused.message


def test_whole_turn_more_is_another_goal() -> None:
    goal = Goal(orientation=0.9 + 2.0 * math.pi, tolerance=Tolerance(angle=0.5))
    assert plan(rod(goal)).status is Status.INFEASIBLE


def test_start_within_the_tolerance_is_the_whole_plan() -> None:
    result = solved(rod(Goal(orientation=0.9, tolerance=Tolerance(angle=0.11))))
    assert not np.ptp(result.joints, axis=0).any()


def test_first_plan_ends_nearest_to_what_is_wanted_and_the_shortest_as_soon_as_it_may() -> None:
    problem = rod(Goal(orientation=0.9, tolerance=Tolerance(angle=0.05)))
    assert solved(problem).object_poses[-1, 2] == pytest.approx(0.9, abs=1e-9)
    shortest = solved(problem, PlanOptions(prefer='shortest'))
    assert shortest.object_poses[-1, 2] == pytest.approx(0.85, abs=1e-6)


def test_object_deep_in_the_palm_is_infeasible_at_once_with_the_numbers() -> None:
    result = plan(replace(pushed_block(), goal=Goal((0.0, -0.01, 0.0))))
    assert result.status is Status.INFEASIBLE
    assert 'object and palm.0 overlap by 0.01 m' in result.message
    assert 'tolerances can make up' in result.message
    assert result.statistics.transitions == 0


def test_contact_that_the_goal_pose_keeps_apart_is_infeasible_at_once() -> None:
    goal = Goal((0.0, 0.003, 0.0), contacts=FEET[:1], tolerance=Tolerance(position=0.002))
    result = plan(replace(pushed_block(), goal=goal))
    assert result.status is Status.INFEASIBLE
    assert f'{FEET[0]} is 0.003 m apart' in result.message


def test_joint_that_the_tolerance_does_not_bring_within_its_limits_is_invalid() -> None:
    result = plan(rod(Goal(joints={'only_joint': UPPER + 0.02})))
    assert result.status is Status.INVALID
    assert 'goal.joints.only_joint' in result.message
    wide = Goal(joints={'only_joint': UPPER + 0.02}, tolerance=Tolerance(joints=0.03))
    assert solved(rod(wide)).joints[-1, 0] == pytest.approx(UPPER, abs=0.03)


# Whole grasps.


def lifted(tolerance: Tolerance) -> Problem:
    """A goal of a pose and all joints half a millimetre off its contacts."""
    problem = pushed_block()
    angles = dict(zip(problem.hand.joint_names, pushed_angles(0.003), strict=True))
    return replace(problem, goal=Goal((0.003, 0.0005, 0.0), angles, tolerance=tolerance))


def test_grasp_that_is_none_is_a_goal_only_within_a_wide_tolerance() -> None:
    assert plan(lifted(Tolerance())).status is Status.INVALID
    result = solved(lifted(Tolerance(position=0.001)))
    assert result.object_poses[-1, 0] == pytest.approx(0.003, abs=1e-3)


def test_grasp_is_reached_exactly_whatever_the_tolerance() -> None:
    problem = pushed_block()
    angles = dict(zip(problem.hand.joint_names, pushed_angles(0.003), strict=True))
    goal = Goal((0.003, 0.0, 0.0), angles, tolerance=Tolerance(0.01, 0.1, 0.1))
    result = solved(replace(problem, goal=goal))
    np.testing.assert_allclose(result.object_poses[-1], [0.003, 0.0, 0.0], atol=1e-9)


def test_held_joint_may_be_off_by_the_tolerance() -> None:
    problem = pushed_block()
    angle = float(problem.start.joints[0])
    goal = Goal(joints={'left_joint': angle + 0.01}, contacts=TIPS[:1])
    held = PlanOptions(held_joints=('left_joint',))
    assert plan(replace(problem, goal=goal), held).status is Status.INVALID
    solved(replace(problem, goal=replace(goal, tolerance=Tolerance(joints=0.02))), held)


@pytest.mark.parametrize(
    'options', [{'forbidden': (TIPS,)}, {'max_contacts': 1}], ids=['forbidden', 'too many']
)
def test_contacts_that_the_options_exclude_are_invalid(options: dict[str, object]) -> None:
    problem = replace(pushed_block(), goal=Goal(contacts=TIPS))
    result = plan(problem, PlanOptions(**options))  # type: ignore[arg-type]
    assert result.status is Status.INVALID


# From what can be reached.

PARTS = {
    'orientation': {'orientation'},
    'position': {'position'},
    'pose': {'object_pose'},
    'one joint': {'joints'},
    'contacts': {'contacts'},
    'formation': {'contacts', 'exact_contacts'},
    'orientation, joint and contact': {'orientation', 'joints', 'contacts'},
}


@cache
def reached(seed: int) -> tuple[Problem, PlanResult]:
    problem = random_problem(seed)
    far = distant_goal(problem, explore(problem), seed)
    assert far is not None
    return far, plan(far)


@pytest.mark.parametrize('seed', [1, 8, 16, 31])
@pytest.mark.parametrize('parts', PARTS.values(), ids=PARTS)
def test_part_of_a_goal_that_can_be_reached_is_reached(seed: int, parts: set[str]) -> None:
    problem, result = reached(seed)
    name = result.joint_names[0]
    known = {
        'object_pose': result.object_poses[-1],
        'position': result.object_poses[-1, :2],
        'orientation': float(result.object_poses[-1, 2]),
        'joints': {name: float(result.joints[-1, 0])},
        'contacts': result.segments[-1].contacts,
        'exact_contacts': True,
    }
    solved(replace(problem, goal=Goal(**{part: known[part] for part in parts})))


def test_alternatives_do_not_end_a_hair_beside_another_contact() -> None:
    """The start lies flush on the palm, as wanted; regions begin beside it."""
    problem = random_problem(1)
    goal = Goal(orientation=0.0, tolerance=Tolerance(angle=0.02))
    problem = replace(problem, goal=goal)
    result = solved(problem, PlanOptions(prefer='shortest', alternatives=3))
    assert len(result.alternatives) == 2
    for other in result.alternatives:
        assert verify_plan(problem, other).failures == ()


@pytest.mark.parametrize('seed', [1, 16])
def test_orientation_on_any_sheet_is_reached_in_its_contact_formation(seed: int) -> None:
    """The formations of three contacts have two dimensions: a level set of the angle."""
    problem = random_problem(seed)
    explored = explore_completely(problem)
    rng = np.random.default_rng(seed)
    sheets = [p for p in explored.pieces() if isinstance(p, Sheet) and len(p.vertices) > 4]
    assert sheets
    for index in rng.permutation(len(sheets))[:3]:
        sheet = sheets[index]
        z = sheet.vertices[int(rng.integers(len(sheet.vertices)))]
        names = explored.system.contact_names(sheet.formation.pairs)
        goal = Goal(orientation=float(z[2]) + 1e-4, contacts=names, exact_contacts=True)
        result = solved(replace(problem, goal=goal))
        assert set(result.segments[-1].contacts) == set(names)


def test_position_of_a_frame_that_is_not_the_centre_of_mass_is_reached() -> None:
    problem, _ = reached(8)
    body = problem.object
    center = body.center_of_mass + np.array([0.001, 0.001])
    moved = replace(problem, object=replace(body, center_of_mass=center))
    far = distant_goal(moved, explore(moved), 8)
    assert far is not None
    pose = far.goal.object_pose
    assert pose is not None
    result = solved(replace(far, goal=Goal(position=pose[:2])))
    assert math.dist(result.object_poses[-1, :2], pose[:2]) <= 1e-4


# With more joints.


def test_start_that_fulfils_a_goal_in_part_is_the_whole_plan_of_four_joints() -> None:
    problem = four_joints((0.0, 0.0, 0.0))
    contacts = describe_grasp(problem, problem.start).contacts
    goal = Goal(contacts=contacts, exact_contacts=True)
    result = solved(replace(problem, goal=goal))
    assert not np.ptp(result.joints, axis=0).any()


@pytest.mark.parametrize(
    'goal',
    [
        Goal(position=(0.0005, 0.0)),
        Goal(orientation=0.02, tolerance=Tolerance(angle=0.005)),
        Goal(joints={'thumb_0': 1.42}, tolerance=Tolerance(joints=0.005)),
    ],
    ids=['position', 'orientation', 'joint'],
)
def test_four_joints_reach_a_goal_in_part(goal: Goal) -> None:
    solved(replace(four_joints((0.0, 0.0, 0.0)), goal=goal), PlanOptions(time_budget=60.0))
