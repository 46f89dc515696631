from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import linprog

from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.central_forces import HEADROOM, central_forces
from cfplan_core.mechanics.needed_force import needed_forces

LOAD = np.array([0.0, -1.0, 0.0])
FREE = np.array([[math.inf, math.inf]])


def block(left: float, right: float) -> FloatArray:
    """A unit block on two feet, half a unit to either side, pressed at heights of two fingers."""
    feet = [[0.0, 1.0, -0.5], [0.0, 1.0, 0.5]]
    fingers = [[1.0, 0.0, -left], [-1.0, 0.0, right]]
    return np.array([feet + fingers])


def levers(left: float, right: float) -> FloatArray:
    """Each finger's torque per contact force: its own lever."""
    arms = np.zeros((1, 4, 2))
    arms[0, 2, 0], arms[0, 3, 1] = left, right
    return arms


def middle(
    wrenches: FloatArray, arms: FloatArray, limit: FloatArray = FREE, squeeze: float = 5.0
) -> FloatArray:
    (forces,) = central_forces(wrenches, arms, LOAD, (-limit, limit), squeeze)
    return forces


def random_grasps(count: int, seed: int) -> list[tuple[FloatArray, FloatArray]]:
    """Wrenches with an equilibrium in which all contacts press, and levers of two joints."""
    random = np.random.default_rng(seed)
    grasps = []
    while len(grasps) < 12:
        angles = random.uniform(0.0, 2.0 * np.pi, count)
        wrenches = np.column_stack(
            [np.cos(angles), np.sin(angles), random.uniform(-0.6, 0.6, count)]
        )
        if widest(wrenches, 5.0) > 1e-2:
            grasps.append((wrenches, random.uniform(-1.0, 1.0, (count, 2))))
    return grasps


def lengths(wrenches: FloatArray) -> FloatArray:
    """|N_i|: what of each unit force the null space of W contains."""
    inverse = np.linalg.pinv(wrenches.T)
    return np.linalg.norm(np.eye(len(wrenches)) - inverse @ wrenches.T, axis=1)


def cap_of(wrenches: FloatArray, squeeze: float) -> float:
    return max(squeeze, HEADROOM * float(needed_forces(wrenches[None], LOAD)[0]))


def widest(wrenches: FloatArray, squeeze: float) -> float:
    """The widest margin, by a linear program in the forces themselves."""
    count = len(wrenches)
    cap = cap_of(wrenches, squeeze)
    if not math.isfinite(cap):
        return -math.inf
    found = linprog(
        np.append(np.zeros(count), -1.0),
        A_ub=np.column_stack([-np.eye(count), lengths(wrenches)]),
        b_ub=np.zeros(count),
        A_eq=np.column_stack([wrenches.T, np.zeros(3)]),
        b_eq=-LOAD,
        bounds=[*[(0.0, cap)] * count, (None, None)],
    )
    return -found.fun if found.status == 0 else -math.inf


def test_fingers_at_one_height_squeeze_as_hard_as_they_may() -> None:
    forces = middle(block(0.3, 0.3), levers(0.3, 0.3), squeeze=4.0)
    np.testing.assert_allclose(forces, [0.5, 0.5, 4.0, 4.0], atol=1e-12)


def test_fingers_at_two_heights_squeeze_half_as_hard_as_a_foot_can_bear() -> None:
    # s (a - b) shifts the weight from foot to foot: s ≤ 1 / (2 (a - b)).
    forces = middle(block(0.4, 0.3), levers(0.4, 0.3))
    np.testing.assert_allclose(sorted(forces[:2]), [0.25, 0.75], atol=1e-12)
    np.testing.assert_allclose(forces[2:], 2.5, atol=1e-12)


def test_weak_joints_squeeze_half_as_hard_as_they_can() -> None:
    forces = middle(block(0.3, 0.3), levers(0.3, 0.3), limit=np.array([[0.6, 9.0]]))
    np.testing.assert_allclose(forces[2:], 1.0, atol=1e-12)


def test_three_contacts_leave_no_choice() -> None:
    wrenches = block(0.3, 0.3)[:, [0, 1, 2]]
    wrenches[0, 2] = [1.0, 0.0, -0.3]
    forces = middle(wrenches, levers(0.3, 0.3)[:, :3])
    np.testing.assert_allclose(forces, [0.5, 0.5, 0.0], atol=1e-12)


def test_one_contact_under_the_centre_carries_the_weight() -> None:
    forces = middle(np.array([[[0.0, 1.0, 0.0]]]), np.zeros((1, 1, 2)))
    np.testing.assert_allclose(forces, [1.0])


@pytest.mark.parametrize('count', [4, 5, 6])
def test_feet_that_cannot_bear_a_load_from_the_side_bear_what_they_can(count: int) -> None:
    feet = np.array([[[0.0, 1.0, place] for place in np.linspace(-0.5, 0.5, count)]])
    load = np.array([0.6, -0.8, 0.0])
    (forces,) = central_forces(feet, np.zeros((1, count, 2)), load, (-FREE, FREE), 5.0)
    np.testing.assert_allclose(forces @ feet[0], [0.0, 0.8, 0.0], atol=1e-9)


def test_a_squeeze_below_the_needed_force_gives_way() -> None:
    wrenches = block(0.3, 0.3)
    forces = middle(wrenches, levers(0.3, 0.3), squeeze=0.1)
    assert forces[2] == pytest.approx(HEADROOM * 0.5)


@pytest.mark.parametrize('count', [4, 5, 6])
def test_forces_balance_the_load_with_the_widest_margin(count: int) -> None:
    for wrenches, arms in random_grasps(count, seed=count):
        forces = middle(wrenches[None], arms[None])
        np.testing.assert_allclose(wrenches.T @ forces, -LOAD, atol=1e-9)
        assert forces.max() <= cap_of(wrenches, 5.0) + 1e-9
        margin = (forces / lengths(wrenches)).min()
        assert margin == pytest.approx(widest(wrenches, 5.0), rel=1e-6)


@pytest.mark.parametrize('count', [4, 5, 6])
def test_the_order_of_contacts_does_not_matter(count: int) -> None:
    for wrenches, arms in random_grasps(count, seed=10 + count):
        forces = middle(wrenches[None], arms[None])
        turned = middle(wrenches[None, ::-1], arms[None, ::-1])
        np.testing.assert_allclose(turned[::-1], forces, atol=1e-6)


@pytest.mark.parametrize('count', [4, 5, 6])
def test_forces_change_little_with_the_contacts(count: int) -> None:
    random = np.random.default_rng(count)
    for wrenches, arms in random_grasps(count, seed=20 + count):
        near = wrenches + 1e-7 * random.uniform(-1.0, 1.0, wrenches.shape)
        change = middle(near[None], arms[None]) - middle(wrenches[None], arms[None])
        assert np.abs(change).max() < 1e-3


def test_effort_limits_are_kept_by_many_contacts() -> None:
    tight = 0
    for wrenches, arms in random_grasps(6, seed=3):
        easy = arms.T @ middle(wrenches[None], arms[None])
        limit = np.maximum(0.7 * np.abs(easy), 0.2)[None]
        torque = arms.T @ middle(wrenches[None], arms[None], limit)
        exists = linprog(
            np.zeros(6),
            A_ub=np.vstack([arms.T, -arms.T]),
            b_ub=np.concatenate([limit[0], limit[0]]),
            A_eq=wrenches.T,
            b_eq=-LOAD,
        )
        if exists.status == 0:
            assert (np.abs(torque) <= limit[0] + 1e-9).all()
            tight += bool((np.abs(easy) > limit[0]).any())
    assert tight > 3
