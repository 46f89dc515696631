"""Equilibrium, closure and torque limits by linear programs (HiGHS).

Forces are in weights of the object and lengths in its size, so that all numbers are near one. For
contact i with unit normal n from hand into object and r from the centre of mass, w_i = (n_x, n_y,
(r_x n_y - r_y n_x) / size), and W c + f = 0 with f = gravity's direction balances the object.

The virtual work of actuators, link weights and contact forces (-c n on the hand) vanishes for
every joint: τ_k + Σ m_l g·∂p_l/∂θ_k - Σ c_i n_i·∂p_i/∂θ_k = 0. With j_ik = -n_i·∂p_i/∂θ_k that is
τ = -Jᵀc - Σ m_l g·∂p_l/∂θ: a horizontal link of mass m with its centre at distance l needs
+ m |g| l.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import linprog

from cfplan_core.verification.checks import BARELY
from cfplan_core.verification.mechanism import FloatArray, Mechanism, Scene
from cfplan_core.verification.touching import Pair, Touch


@dataclass(frozen=True, eq=False)
class Balance:
    """The mechanics of some contacts in one configuration.

    Attributes:
        wrenches: Shape (3, k), W, scaled.
        load: Shape (3,), f, scaled: a unit force, or zero without gravity.
        lever_arms: Shape (k, n), -J: torque of each joint per contact force, in sizes.
        link_torques: Shape (n,), torque that carries the links, N·m.
        torque_unit: Weight times size, N·m (one newton times size without gravity).
    """

    wrenches: FloatArray
    load: FloatArray
    lever_arms: FloatArray
    link_torques: FloatArray
    torque_unit: float


def balance_of(
    mechanism: Mechanism, scene: Scene, contacts: Sequence[tuple[Pair, Touch]]
) -> Balance:
    """Set up the equations for contacts in a scene."""
    gravity = complex(*mechanism.problem.gravity)
    weight = mechanism.problem.object.mass * abs(gravity)
    size, joints = mechanism.size, len(scene.axes)
    wrenches = np.zeros((3, len(contacts)))
    arms = np.zeros((len(contacts), joints))
    for k, (pair, touch) in enumerate(contacts):
        n, arm = touch.normal, (touch.point - scene.center) / size
        wrenches[:, k] = n.real, n.imag, _cross(arm, n)
        for joint in mechanism.bodies[pair.body].chain:
            arms[k, joint] = _cross(touch.point - scene.axes[joint], n) / size
    link_torques = np.zeros(joints)
    for body, centroid in scene.masses:
        for joint in body.chain:
            link_torques[joint] -= body.mass * _cross(centroid - scene.axes[joint], gravity)
    load = np.array([gravity.real, gravity.imag, 0.0])
    return Balance(
        wrenches=wrenches,
        load=load / abs(gravity) if weight > 0.0 else np.zeros(3),
        lever_arms=arms,
        link_torques=link_torques,
        torque_unit=(weight if weight > 0.0 else 1.0) * size,
    )


def smallest_singular_value(balance: Balance) -> float:
    """How far the wrenches are from lying in a plane; 0 with fewer than three of them."""
    if balance.wrenches.shape[1] < 3:
        return 0.0
    return float(np.linalg.svd(balance.wrenches, compute_uv=False)[2])


def best_equilibrium(balance: Balance) -> tuple[float, FloatArray]:
    """Find the equilibrium whose smallest contact force is largest: max t, W c = -f, c ≥ t.

    Returns:
        t, at most 1, and c, shape (k,), in weights. t is -inf and c is nan if nothing balances
        the load; a negative t says that some contact would have to pull.
    """
    count = balance.wrenches.shape[1]
    # Variables: c - t and t.
    equations = np.column_stack([balance.wrenches, balance.wrenches.sum(axis=1)])
    optimum = _minimum(
        np.append(np.zeros(count), -1.0),
        [*[(0.0, None)] * count, (None, 1.0)],
        equal=(equations, -balance.load),
    )
    if not optimum.found:
        return -math.inf, optimum.x[:-1]
    t = float(optimum.x[-1])
    return t, optimum.x[:-1] + t


def closure_margin(balance: Balance) -> float:
    """Largest t with W c = 0 and t ≤ c ≤ 1: positive if the contacts are in form closure."""
    count = balance.wrenches.shape[1]
    optimum = _minimum(
        np.append(np.zeros(count), -1.0),
        [(0.0, 1.0)] * (count + 1),
        equal=(np.column_stack([balance.wrenches, np.zeros(3)]), np.zeros(3)),
        at_most=(np.column_stack([-np.eye(count), np.ones(count)]), np.zeros(count)),
    )
    return max(0.0, -optimum.value) if optimum.found else 0.0


def internal_force(balance: Balance) -> float:
    """Largest c_i ≤ 1 among forces c ≥ 0 that cancel up to rounding: |W c| ≤ 1e-6 in each row.

    1 in form closure, and still 1 at its limit, where some contacts carry nothing; near 0 where no
    contacts squeeze each other.
    """
    count = balance.wrenches.shape[1]
    optimum = _minimum(
        -np.ones(count),
        [(0.0, 1.0)] * count,
        at_most=(np.vstack([balance.wrenches, -balance.wrenches]), np.full(6, BARELY)),
    )
    return float(optimum.x.max()) if optimum.found else 0.0


def torque_limits(balance: Balance, floor: float) -> tuple[FloatArray, FloatArray]:
    """Smallest and largest torque of each joint over all equilibria.

    Args:
        balance: The contacts.
        floor: Smallest contact force, in weights: 0, or a little below where an equilibrium
            just barely exists.

    Returns:
        Lower and upper limits, shape (n,), N·m; infinite where unbounded, nan where there is no
        equilibrium.
    """
    joints = balance.lever_arms.shape[1]
    limits = np.zeros((2, joints))
    for joint in range(joints):
        arms = balance.lever_arms[:, joint]
        if np.any(arms):
            limits[0, joint] = -_highest(balance, -arms, floor)
            limits[1, joint] = _highest(balance, arms, floor)
    lower, upper = limits * balance.torque_unit + balance.link_torques
    return lower, upper


def least_effort(mechanism: Mechanism, balance: Balance, floor: float) -> float:
    """Smallest share of the effort limits with which the hand can hold the object.

    Returns:
        min over equilibria of max over joints |τ_k| / effort_limit_k; inf without equilibrium.
    """
    effort = np.array([joint.effort_limit for joint in mechanism.problem.hand.joints])
    count = balance.wrenches.shape[1]
    arms = balance.lever_arms.T * balance.torque_unit / effort[:, None]
    links = balance.link_torques / effort
    one = np.ones((len(effort), 1))
    optimum = _minimum(
        np.append(np.zeros(count), 1.0),
        [*[(floor, None)] * count, (0.0, None)],
        equal=(np.column_stack([balance.wrenches, np.zeros(3)]), -balance.load),
        at_most=(
            np.vstack([np.hstack([arms, -one]), np.hstack([-arms, -one])]),
            np.concatenate([-links, links]),
        ),
    )
    return optimum.value if optimum.found else math.inf


def torque_distance(balance: Balance, torques: FloatArray) -> float:
    """Find how far torques are from those of an equilibrium, in weights times sizes.

    Args:
        balance: The contacts.
        torques: Shape (n,), N·m.

    Returns:
        min over equilibria, with forces above `-BARELY`, of max over joints of the difference; inf
        without equilibrium.
    """
    count = balance.wrenches.shape[1]
    arms, wanted = balance.lever_arms.T, (torques - balance.link_torques) / balance.torque_unit
    one = np.ones((len(wanted), 1))
    optimum = _minimum(
        np.append(np.zeros(count), 1.0),
        [*[(-BARELY, None)] * count, (0.0, None)],
        equal=(np.column_stack([balance.wrenches, np.zeros(3)]), -balance.load),
        at_most=(
            np.vstack([np.hstack([arms, -one]), np.hstack([-arms, -one])]),
            np.concatenate([wanted, -wanted]),
        ),
    )
    return optimum.value if optimum.found else math.inf


def _highest(balance: Balance, arms: FloatArray, floor: float) -> float:
    """Largest arms·c over W c = -f, c ≥ floor."""
    count = len(arms)
    highest = _minimum(-arms, [(floor, None)] * count, equal=(balance.wrenches, -balance.load))
    if highest.found:
        return -highest.value
    # HiGHS may not tell an unbounded program from an infeasible one: ask for an unbounded ray.
    ray = _minimum(-arms, [(0.0, 1.0)] * count, equal=(balance.wrenches, np.zeros(3)))
    return math.inf if ray.value < -1e-9 else math.nan


@dataclass(frozen=True, eq=False)
class _Optimum:
    found: bool
    value: float
    x: FloatArray


def _minimum(
    cost: FloatArray,
    bounds: Sequence[tuple[float | None, float | None]],
    equal: tuple[FloatArray, FloatArray] | None = None,
    at_most: tuple[FloatArray, FloatArray] | None = None,
) -> _Optimum:
    """Minimise cost·x over bounds, A x = b for `equal` and A x ≤ b for `at_most`."""
    options: Any = {'primal_feasibility_tolerance': 1e-10, 'dual_feasibility_tolerance': 1e-10}
    equal_matrix, equal_right = equal or (None, None)
    matrix, right = at_most or (None, None)
    solution: Any = linprog(
        cost, matrix, right, equal_matrix, equal_right, bounds, method='highs', options=options
    )
    if solution.status != 0:
        return _Optimum(False, math.nan, np.full(len(cost), math.nan))
    return _Optimum(True, float(solution.fun), np.asarray(solution.x))


def _cross(a: complex, b: complex) -> float:
    return a.real * b.imag - a.imag * b.real
