from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planning.scenes import at, pushed_angles, pushed_block

from cfplan_core.contact.system import ContactSystem
from cfplan_core.errors import CfplanError
from cfplan_core.model import Goal, ManipulatedObject, Problem, Tolerance
from cfplan_core.planning.goal_region import GoalRegion

HALF_TURN = np.pi


def off_centre(problem: Problem) -> Problem:
    """The same with a centre of mass that is not the origin of the object's frame."""
    body = problem.object
    moved = ManipulatedObject(body.vertices, body.mass, np.array([0.004, 0.013]))
    return replace(problem, object=moved)


SYSTEM = ContactSystem(off_centre(pushed_block()))
NAMES = SYSTEM.joint_names
Z = at(SYSTEM, 0.0, pushed_angles(0.0))

offsets = st.floats(-2.0, 2.0)


@settings(max_examples=100, deadline=None)
@given(x=offsets, y=offsets, turn=offsets, joint=offsets)
def test_ratio_is_that_of_the_largest_offset_to_its_tolerance(
    x: float, y: float, turn: float, joint: float
) -> None:
    """The position counts as a distance, of the object's frame and not of its centre of mass."""
    tolerance = Tolerance(0.003, 0.2, 0.05)
    (pose,) = SYSTEM.object_poses(Z[None])
    off = np.array([x * tolerance.position, y * tolerance.position, turn * tolerance.angle])
    angle = float(Z[3]) + joint * tolerance.joints
    region = GoalRegion(SYSTEM, Goal(pose + off, {NAMES[0]: angle}, tolerance=tolerance))
    expected = max(np.hypot(x, y), abs(turn), abs(joint))
    assert region.ratios(Z[None])[0] == pytest.approx(expected, abs=1e-9)
    assert region.fits(Z) == (region.ratios(Z[None])[0] <= 1.0)


def test_gradients_are_those_of_finite_differences() -> None:
    goal = Goal(position=(0.01, 0.02), orientation=0.3, joints={NAMES[1]: 1.0})
    region = GoalRegion(SYSTEM, goal)
    steps = 1e-6 * np.eye(SYSTEM.dof)
    numeric = (region.offsets(Z - steps) - region.offsets(Z + steps)).T / 2e-6
    np.testing.assert_allclose(region.gradients(Z), numeric, rtol=1e-6, atol=1e-3)


def test_whole_turns_are_counted() -> None:
    wide = Tolerance(angle=0.5)
    assert GoalRegion(SYSTEM, Goal(orientation=0.4, tolerance=wide)).fits(Z)
    assert not GoalRegion(SYSTEM, Goal(orientation=2 * HALF_TURN, tolerance=wide)).fits(Z)


def test_exact_contacts_are_all_and_no_others() -> None:
    names = SYSTEM.contact_names([2, 5])
    some, exact = (
        GoalRegion(SYSTEM, Goal(contacts=names, exact_contacts=exact)) for exact in (False, True)
    )
    assert [some.holds(pairs) for pairs in ([2, 5], [2, 3, 5], [2])] == [True, True, False]
    assert [exact.holds(pairs) for pairs in ([5, 2], [2, 3, 5], [2])] == [True, False, False]


@pytest.mark.parametrize(
    ('parts', 'message'),
    [
        ({'object_pose': (0.0, 0.0, 0.0), 'orientation': 0.0}, 'orientation beside object_pose'),
        ({'object_pose': (0.0, 0.0, 0.0), 'position': (0.0, 0.0)}, 'position beside object_pose'),
        ({'exact_contacts': True}, 'exact_contacts without contacts'),
    ],
)
def test_goal_that_says_something_twice_or_nothing_is_refused(
    parts: dict[str, object], message: str
) -> None:
    with pytest.raises(CfplanError, match=message):
        Goal(**parts)  # type: ignore[arg-type]


def test_position_and_orientation_are_a_pose() -> None:
    joints = dict(zip(NAMES, pushed_angles(0.0), strict=True))
    hand = SYSTEM.problem.hand
    apart = Goal(position=(0.01, 0.02), orientation=0.3, joints=joints).grasp(hand)
    whole = Goal((0.01, 0.02, 0.3), joints).grasp(hand)
    assert apart is not None
    assert whole is not None
    np.testing.assert_array_equal(apart.object_pose, whole.object_pose)
    assert Goal(position=(0.01, 0.02), joints=joints).grasp(hand) is None


def test_rounding_is_no_distance_from_the_goal() -> None:
    region = GoalRegion(SYSTEM, Goal(orientation=float(SYSTEM.object_poses(Z[None])[0, 2])))
    off = Z.copy()
    off[2] += 1e-16
    assert region.describe(off) == 'the object 0 rad off, 0.001 allowed'
    off[2] += 0.02
    assert region.describe(off) == 'the object 0.02 rad off, 0.001 allowed'
