from __future__ import annotations

import math

import numpy as np
import pytest
from planning.scenes import (
    BASE,
    FEET,
    HALF,
    LEFT,
    TIPS,
    at,
    pushed_angles,
    pushed_block,
    x_of,
)

from cfplan_core.contact.gaps import gaps
from cfplan_core.contact.system import ContactSystem
from cfplan_core.errors import CfplanError
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.model import Goal, Tolerance
from cfplan_core.planning.goal_test import GoalTest
from cfplan_core.planning.pieces import Piece
from cfplan_core.planning.roadmap import Roadmap

SYSTEM = ContactSystem(pushed_block())
CURVE = Roadmap(SYSTEM, FrictionlessModel(SYSTEM.load)).root(at(SYSTEM, 0.0, pushed_angles(0.0)))


def find(goal: Goal, piece: Piece = CURVE) -> float | None:
    """Where on the curve the goal is fulfilled, as the block's place; None if nowhere."""
    z = GoalTest(SYSTEM, goal)(piece)
    return None if z is None else x_of(SYSTEM, z)


@pytest.mark.parametrize('x', [-0.0045, -0.00123, 0.0, 0.00456])
def test_pose_on_the_curve_is_found(x: float) -> None:
    assert find(Goal((x, 0.0, 0.0))) == pytest.approx(x, abs=1e-9)


@pytest.mark.parametrize('pose', [(0.0, 0.002, 0.0), (0.0, 0.0, 0.1), (0.04, 0.0, 0.0)])
def test_pose_beside_the_curve_is_not_found(pose: tuple[float, float, float]) -> None:
    assert find(Goal(pose)) is None


@pytest.mark.parametrize(('y', 'found'), [(0.9e-4, True), (-0.9e-4, True), (1.1e-4, False)])
def test_pose_within_its_tolerance_is_found(y: float, found: bool) -> None:
    assert (find(Goal((0.001, y, 0.0))) is not None) == found


def test_tolerance_of_the_goal_counts() -> None:
    goal = Goal((0.001, 5e-4, 0.0), tolerance=Tolerance(position=1e-3))
    assert find(goal) == pytest.approx(0.001, abs=1e-3)


@pytest.mark.parametrize('angle', [0.05, 0.3, 0.6, 0.75])
def test_joint_angle_is_found_where_the_fingertip_touches(angle: float) -> None:
    """The other joint is free."""
    x = HALF - BASE + LEFT * math.cos(angle)
    assert find(Goal(joints={'left_joint': angle})) == pytest.approx(x, abs=1e-9)


@pytest.mark.parametrize('angle', [1.0, 3.0])
def test_joint_angle_beyond_the_ends_of_the_curve_is_not_found(angle: float) -> None:
    assert find(Goal(joints={'left_joint': angle})) is None


def test_all_joints_must_agree() -> None:
    left, right = pushed_angles(0.002)
    assert find(Goal(joints={'left_joint': left, 'right_joint': right})) is not None
    assert find(Goal(joints={'left_joint': left, 'right_joint': right + 0.01})) is None


def test_found_configuration_lies_on_the_contacts() -> None:
    z = GoalTest(SYSTEM, Goal(joints={'left_joint': 0.3}))(CURVE)
    assert z is not None
    gap = gaps(SYSTEM, SYSTEM.place(z[None]), CURVE.formation.array).gap
    np.testing.assert_allclose(gap, 0.0, atol=1e-12)


@pytest.mark.parametrize('contacts', [(TIPS[0],), (*FEET, *TIPS)])
def test_contacts_of_the_formation_are_found_anywhere_on_it(contacts: tuple[str, ...]) -> None:
    assert find(Goal(contacts=contacts)) is not None


def test_contact_that_the_formation_lacks_is_not_found() -> None:
    assert find(Goal(contacts=(TIPS[0], 'object.e2|left.link.v1'))) is None


def test_contacts_and_joints_must_both_be_fulfilled() -> None:
    joints = {'left_joint': 0.3}
    assert find(Goal(joints=joints, contacts=TIPS)) is not None
    assert find(Goal(joints=joints, contacts=('object.e2|left.link.v1',))) is None
    assert find(Goal(joints={'left_joint': 1.0}, contacts=TIPS)) is None


def test_point_fulfils_a_goal_only_where_it_is() -> None:
    z = at(SYSTEM, 0.001, pushed_angles(0.001))
    point = Piece(0, CURVE.formation, CURVE.stability, 0, z[None], ())
    assert find(Goal((0.001, 0.0, 0.0)), point) == pytest.approx(0.001, abs=1e-12)
    assert find(Goal((0.0015, 0.0, 0.0)), point) is None


def test_contact_of_elements_that_do_not_exist_is_refused() -> None:
    with pytest.raises(CfplanError, match=r'object\.v9\|palm\.0\.e2'):
        GoalTest(SYSTEM, Goal(contacts=('object.v9|palm.0.e2',)))
