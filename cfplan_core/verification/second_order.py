"""Second-order stability: is the object at a strict minimum of its energy for fixed joints?"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence

import numpy as np

from cfplan_core.verification.checks import STRICT
from cfplan_core.verification.mechanism import FloatArray, Mechanism, Scene
from cfplan_core.verification.statics import balance_of, best_equilibrium
from cfplan_core.verification.touching import Pair, locate

STEP = 1e-4
"""Step of the finite differences, by the object's size and in rad."""


def second_order_margin(mechanism: Mechanism, scene: Scene, contacts: Sequence[Pair]) -> float:
    """Least curvature of the energy along motions that keep the pressing contacts.

    With forces c that balance the object, the energy minus Σ c_i g_i has no slope; the grasp is
    stable to second order if its Hessian is positive definite on the null space of the pressing
    contacts' wrenches. The weight's energy is linear, so the Hessian is that of -Σ c_i g_i, taken
    by central differences of the gaps.

    Args:
        mechanism: The problem.
        scene: The configuration.
        contacts: What touches.

    Returns:
        Smallest eigenvalue, in weights times sizes; positive if stable, inf if no motion keeps
        the contacts, -inf without equilibrium.
    """
    balance = balance_of(mechanism, scene, [(pair, locate(pair, scene)) for pair in contacts])
    least, forces = best_equilibrium(balance)
    if not least > -STRICT:
        return -math.inf
    pressing = forces > STRICT
    _, values, directions = np.linalg.svd(balance.wrenches[:, pressing].T)
    free = directions[int(np.sum(values > STRICT)) :].T
    if free.shape[1] == 0:
        return math.inf

    def energy(motion: FloatArray) -> float:
        moved = mechanism.scene(_displaced(mechanism, scene.pose, motion), scene.joints)
        gaps = [locate(pair, moved).gap / mechanism.size for pair in contacts]
        return -float(np.dot(forces, gaps))

    identity = STEP * np.eye(3)
    hessian = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            a, b = identity[i], identity[j]
            hessian[i, j] = energy(a + b) - energy(a - b) - energy(b - a) + energy(-a - b)
    hessian /= 4.0 * STEP**2
    return float(np.linalg.eigvalsh(free.T @ hessian @ free)[0])


def _displaced(mechanism: Mechanism, pose: FloatArray, motion: FloatArray) -> FloatArray:
    """Move the centre of mass by sizes and turn about it by rad."""
    arm = complex(*mechanism.problem.object.center_of_mass)
    angle = float(pose[2] + motion[2])
    center = complex(pose[0], pose[1]) + cmath.exp(1j * float(pose[2])) * arm
    center += mechanism.size * complex(motion[0], motion[1])
    origin = center - cmath.exp(1j * angle) * arm
    return np.array([origin.real, origin.imag, angle])
