"""What happens between two frames: the configuration half-way, brought back onto the contacts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cfplan_core.verification.mechanism import FloatArray, Mechanism, Scene
from cfplan_core.verification.statics import balance_of
from cfplan_core.verification.touching import Pair, locate

ROUNDS = 8
ON_CONTACT = 1e-10
"""Gap by size at which a configuration is on its contacts."""

STEP = 1e-5
"""Step of the finite differences, by the object's size and in rad."""


@dataclass(frozen=True, eq=False)
class Halfway:
    """Half-way between two frames of one segment.

    Attributes:
        scene: The configuration on the contacts.
        gap: Largest distance of a contact from its edge before it was brought back, m.
        turn: Sum of all rotations from frame to frame and of the object's displacement by the
            lever: how large the step is.
        detour: Distance from half-way to the contacts, by the distance between the frames.
        reached: True if the contacts could be reached.
    """

    scene: Scene
    gap: float
    turn: float
    detour: float
    reached: bool


def halfway(
    mechanism: Mechanism,
    before: Scene,
    after: Scene,
    contacts: Sequence[Pair],
    balanced: bool = False,
) -> Halfway:
    """Go half-way between two frames and then, by Gauss-Newton, to the contacts.

    A step from frame to frame that follows one smooth curve of configurations has its middle next
    to the curve, at a distance of second order; one that leaps to another branch has not.

    Args:
        mechanism: The problem.
        before: The first frame.
        after: The second.
        contacts: Those of the segment.
        balanced: True to go, for two contacts, to where they also balance the object.
    """
    # Object frame position in sizes, then angles.
    unit = np.concatenate([[mechanism.size] * 2, np.ones(1 + len(before.joints))])
    start, end = (np.concatenate([scene.pose, scene.joints]) for scene in (before, after))
    step = (end - start) / unit
    middle = 0.5 * (start + end) / unit
    state = middle
    first_gap, reached = 0.0, False
    for k in range(ROUNDS):
        scene = mechanism.scene((state * unit)[:3], (state * unit)[3:])
        placed = [(pair, locate(pair, scene)) for pair in contacts]
        gaps = np.array([touch.gap for _, touch in placed]) / mechanism.size
        if k == 0:
            first_gap = max(touch.distance for _, touch in placed)
        balance = balance_of(mechanism, scene, placed)
        off = gaps
        if balanced:
            off = np.append(gaps, _imbalance(mechanism, state * unit, contacts))
        if float(np.abs(off).max()) < ON_CONTACT:
            reached = True
            break
        # The wrenches are about the centre of mass, the state has the object frame's origin.
        origin = complex(*(state * unit)[:2])
        arm = (scene.center - origin) / mechanism.size
        slopes = balance.wrenches.T.copy()
        slopes[:, 2] += arm.real * slopes[:, 1] - arm.imag * slopes[:, 0]
        slopes = np.hstack([slopes, -balance.lever_arms])
        if balanced:
            slopes = np.vstack([slopes, _imbalance_slope(mechanism, state, unit, contacts)])
        state = state - np.linalg.lstsq(slopes, off, rcond=1e-9)[0]
    size = float(np.linalg.norm(step))
    return Halfway(
        scene=scene,
        gap=first_gap,
        turn=float(np.abs(step[2:]).sum())
        + float(np.linalg.norm(step[:2])) * mechanism.size / mechanism.lever,
        detour=float(np.linalg.norm(state - middle)) / max(size, 1e-6),
        reached=reached,
    )


def _imbalance(mechanism: Mechanism, state: FloatArray, contacts: Sequence[Pair]) -> float:
    """Determinant of two wrenches and the load, zero where they lie in a plane; SI units."""
    scene = mechanism.scene(state[:3], state[3:])
    balance = balance_of(mechanism, scene, [(pair, locate(pair, scene)) for pair in contacts])
    return float(np.linalg.det(np.column_stack([balance.wrenches, balance.load])))


def _imbalance_slope(
    mechanism: Mechanism, state: FloatArray, unit: FloatArray, contacts: Sequence[Pair]
) -> FloatArray:
    """Differentiate `_imbalance` by a state in object sizes and rad, by central differences."""
    steps = STEP * np.eye(len(state))
    return np.array(
        [
            _imbalance(mechanism, (state + step) * unit, contacts)
            - _imbalance(mechanism, (state - step) * unit, contacts)
            for step in steps
        ]
    ) / (2.0 * STEP)
