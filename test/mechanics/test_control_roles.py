from __future__ import annotations

import math

import numpy as np
import pytest

from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.central_forces import central_forces
from cfplan_core.mechanics.control_roles import control_roles

LOAD = np.array([0.0, -1.0, 0.0])
FEET = [[0.0, 1.0, -0.5], [0.0, 1.0, 0.5]]


def pressed_block(left: float, right: float) -> tuple[FloatArray, FloatArray]:
    """A unit block on two feet between fingers at two heights: wrenches and levers."""
    wrenches = np.array([[*FEET, [1.0, 0.0, -left], [-1.0, 0.0, right]]])
    arms = np.zeros((1, 4, 2))
    arms[0, 2, 0], arms[0, 3, 1] = -left, right
    return wrenches, arms


def random_grasp(contacts: int, joints: int, seed: int) -> tuple[FloatArray, FloatArray]:
    random = np.random.default_rng(seed)
    wrenches = random.normal(size=(1, contacts, 3))
    return wrenches, random.normal(size=(1, contacts, joints))


def test_of_two_fingers_the_one_with_the_longer_lever_is_controlled_in_torque() -> None:
    wrenches, arms = pressed_block(0.1, 0.3)
    best, other = control_roles(wrenches, arms, np.array([[0.4, 0.6, 0.5, 0.5]]))
    # s (0.3 - 0.1) moves the weight from foot to foot: it may fall by 0.5 before a finger lets go.
    assert best.effort == (1,)
    assert best.margin == pytest.approx(0.5 * 0.3)
    assert other.margin == pytest.approx(0.5 * 0.1)


def test_three_contacts_leave_all_joints_to_be_held_in_position() -> None:
    wrenches, arms = pressed_block(0.1, 0.3)
    wrenches, arms = wrenches[:, :3], arms[:, :3]
    (only,) = control_roles(wrenches, arms, np.array([[0.5, 0.5, 0.0]]))
    assert only.effort == ()
    assert only.margin == math.inf


def test_joints_that_touch_nothing_are_held_in_position() -> None:
    wrenches, arms = pressed_block(0.1, 0.3)
    arms = np.concatenate([np.zeros((1, 4, 3)), arms], axis=2)
    choices = control_roles(wrenches, arms, np.array([[0.4, 0.6, 0.5, 0.5]]))
    assert [roles.effort for roles in choices] == [(4,), (3,)]


def test_contacts_of_the_palm_alone_need_no_torque() -> None:
    wrenches = np.array([[*FEET, [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]])
    (only,) = control_roles(wrenches, np.zeros((1, 4, 2)), np.full((1, 4), 0.5))
    assert only.effort == ()


@pytest.mark.parametrize(('contacts', 'joints', 'effort'), [(4, 2, 1), (5, 4, 2), (6, 5, 3)])
def test_errors_of_held_joints_keep_all_contacts(contacts: int, joints: int, effort: int) -> None:
    """Wᵀ q̇ + J θ̇ = 0 has a solution for every motion of the held joints, and only one."""
    for seed in range(5):
        wrenches, arms = random_grasp(contacts, joints, seed)
        best = control_roles(wrenches, arms, np.ones((1, contacts)))[0]
        assert len(best.effort) == effort
        assert best.margin > 0.0
        follow = np.concatenate([wrenches[0], -arms[0][:, best.effort]], axis=1)
        held = [joint for joint in range(joints) if joint not in best.effort]
        errors = arms[0][:, held] @ np.random.default_rng(seed).normal(size=len(held))
        motion, _, rank, _ = np.linalg.lstsq(follow, errors, rcond=None)
        np.testing.assert_allclose(follow @ motion, errors, atol=1e-9)
        assert rank == follow.shape[1]


@pytest.mark.parametrize(('contacts', 'joints'), [(4, 2), (5, 4), (6, 5)])
def test_torques_may_be_off_by_the_margin_and_no_more(contacts: int, joints: int) -> None:
    """Over all corners of the box of errors, forces follow the torques by linear equations."""
    for seed in range(5):
        wrenches, arms = random_grasp(contacts, joints, seed)
        forces = np.random.default_rng(seed).uniform(0.5, 1.5, (1, contacts))
        for roles in control_roles(wrenches, arms, forces)[:3]:
            torques = arms[0][:, roles.effort]
            system = np.concatenate([wrenches[0], torques], axis=1).T
            corners = np.stack(
                np.meshgrid(*[[-1.0, 1.0]] * len(roles.effort), indexing='ij'), axis=-1
            ).reshape(-1, len(roles.effort))
            errors = np.concatenate([np.zeros((len(corners), 3)), corners], axis=1)
            change = np.linalg.solve(system, errors.T).T
            assert (forces + roles.margin * change).min() == pytest.approx(0.0, abs=1e-9)


def test_the_weakest_place_inside_a_stretch_decides() -> None:
    wrenches, arms = pressed_block(0.1, 0.3)
    forces = np.array(
        [[0.0, 1.0, 0.0, 0.0], [0.4, 0.6, 0.5, 0.5], [0.4, 0.6, 0.2, 0.2], [0.0] * 4]
    )
    best = control_roles(np.tile(wrenches, (4, 1, 1)), np.tile(arms, (4, 1, 1)), forces)[0]
    assert best.margin == pytest.approx(0.2 * 0.3)


def test_a_joint_whose_torque_tells_nothing_somewhere_has_no_margin() -> None:
    wrenches, arms = (np.tile(part, (4, 1, 1)) for part in pressed_block(0.1, 0.3))
    arms[1, 3, 1] = 0.0
    best, other = control_roles(wrenches, arms, np.full((4, 4), 0.5))
    assert best.effort == (0,)
    assert other.margin == 0.0


def test_twenty_joints_are_rated_quickly_enough_and_always_alike() -> None:
    wrenches, arms = random_grasp(8, 20, 1)
    forces = np.ones((1, 8))
    first, again = (control_roles(wrenches, arms, forces) for _ in range(2))
    assert first == again
    assert len(first[0].effort) == 5


def test_middle_forces_have_a_margin() -> None:
    wrenches, arms = pressed_block(0.4, 0.3)
    limits = (np.full((1, 2), -np.inf), np.full((1, 2), np.inf))
    forces = central_forces(wrenches, arms, LOAD, limits, 5.0)
    # The squeeze is between 0 and 5: its middle may be off by 2.5 either way.
    assert control_roles(wrenches, arms, forces)[0].margin == pytest.approx(2.5 * 0.4)
