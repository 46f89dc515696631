"""Checks of forces: stability, its class, torque limits, effort."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cfplan_core.verification.checks import BARELY, CHECKS, HAIR, RANK, STRICT, UNBOUNDED
from cfplan_core.verification.mechanism import FloatArray, Mechanism, Scene
from cfplan_core.verification.report import Recorder
from cfplan_core.verification.second_order import second_order_margin
from cfplan_core.verification.statics import (
    Balance,
    balance_of,
    best_equilibrium,
    closure_margin,
    internal_force,
    least_effort,
    smallest_singular_value,
    torque_distance,
    torque_limits,
)
from cfplan_core.verification.touching import Pair, locate

Limits = tuple[FloatArray, FloatArray]
"""Lower and upper torque limits, each of shape (n,), N·m."""


@dataclass(frozen=True, eq=False)
class Hold:
    """Contacts that hold the object in a configuration; what several checks ask for is kept.

    Attributes:
        mechanism: The problem.
        frame: Index of the frame.
        scene: The configuration.
        contacts: What presses.
        owner: Says whose contacts they are, for messages.
        stability: The class that is claimed for them.
    """

    mechanism: Mechanism
    frame: int
    scene: Scene
    contacts: tuple[Pair, ...]
    owner: str
    stability: str

    @cached_property
    def balance(self) -> Balance:
        """The equations."""
        placed = [(pair, locate(pair, self.scene)) for pair in self.contacts]
        return balance_of(self.mechanism, self.scene, placed)

    @cached_property
    def least_force(self) -> float:
        """The largest possible smallest contact force, in weights; -inf without equilibrium."""
        return best_equilibrium(self.balance)[0]

    @cached_property
    def singular_value(self) -> float:
        """How well the wrenches span wrench space."""
        return smallest_singular_value(self.balance)

    @property
    def spans(self) -> bool:
        """True if the wrenches span wrench space."""
        return CHECKS['rank'].holds(self.singular_value)

    @cached_property
    def closure(self) -> float:
        """Form-closure margin."""
        return closure_margin(self.balance) if self.spans else 0.0


def check_stable(hold: Hold, record: Recorder) -> None:
    """Check that contacts hold the object: to first order, or second if that is claimed."""
    if hold.stability == 'second_order' and not (hold.spans and hold.least_force >= STRICT):
        margin = second_order_margin(hold.mechanism, hold.scene, hold.contacts)
        what = f'curvature of the energy with the contacts of {hold.owner}'
        record.measure('stability', margin, hold.frame, what)
        return
    what = f'smallest singular value with the contacts of {hold.owner}'
    record.measure('rank', hold.singular_value, hold.frame, what)
    what = f'largest least force on the contacts of {hold.owner}'
    record.measure('stability', hold.least_force, hold.frame, what)


def check_barely_stable(hold: Hold, record: Recorder) -> None:
    """Check that a segment's contacts still balance the object where the segment ends."""
    what = f'largest least force on the contacts of {hold.owner}'
    record.measure('stability_at_ends', hold.least_force, hold.frame, what)


def check_class(hold: Hold, inside: bool, record: Recorder) -> None:
    """Check that the stability class is the one claimed.

    Form closure: W c = 0 with all c > 0; at the ends of a segment some c ≥ 0, not all zero.
    Force closure: stable to first order and not form closure, or only by a hair. Second order:
    neither.
    """
    if hold.stability == 'form_closure':
        holds = hold.closure >= STRICT if inside else internal_force(hold.balance) > 0.5
    elif hold.stability == 'force_closure':
        holds = hold.closure <= HAIR
    else:
        holds = not hold.spans or hold.least_force <= (STRICT if inside else 10.0 * BARELY)
    record.require(
        'stability_class',
        holds,
        hold.frame,
        f'{hold.owner} claims {hold.stability}, but its contacts have form-closure margin '
        f'{hold.closure:.3g}, least force {hold.least_force:.3g} weights',
    )


def check_torques(holds: Sequence[Hold], claimed: Limits, inside: bool, record: Recorder) -> None:
    """Check the torque limits of a frame, and that the hand is strong enough.

    Args:
        holds: The contacts of the segment of the frame, or of the two that share it; the limits
            must be those of one of them.
        claimed: The limits of the plan.
        inside: True if the frame is not at the end of a segment.
        record: Where to.
    """
    errors, efforts = [], []
    for hold in holds:
        least = hold.least_force
        floor = least if -BARELY <= least < 0.0 else 0.0
        efforts.append(least_effort(hold.mechanism, hold.balance, floor))
        errors.append(_torque_error(hold, claimed, torque_limits(hold.balance, floor)))
    error, what = min(errors)
    frame = holds[0].frame
    record.measure('torque_limits' if inside else 'torque_limits_at_ends', error, frame, what)
    what = 'least effort that holds the object, divided by the effort limits,'
    record.measure('effort', min(efforts), frame, what)


def check_nominal(hold: Hold, claimed: Limits, torques: FloatArray, record: Recorder) -> None:
    """Check that nominal torques are inside the limits, are possible, and balance the object.

    Args:
        hold: All contacts that may press: those of the segment, or of the two that share a frame.
        claimed: The limits of the plan.
        torques: Shape (n,), N·m, of the plan.
        record: Where to.
    """
    joints, unit = hold.mechanism.problem.hand.joints, hold.balance.torque_unit
    excess = np.maximum(claimed[0] - torques, torques - claimed[1]) / unit
    for joint, torque, beyond in zip(joints, torques.tolist(), excess.tolist(), strict=True):
        what = f'nominal torque of {joint.name}, {torque:.9g} N·m, excess over its limits'
        record.measure('nominal_limits', max(beyond, 0.0), hold.frame, what)
        what = f'nominal torque of {joint.name}, {torque:.9g} N·m, divided by its effort limit,'
        record.measure('nominal_effort', abs(torque) / joint.effort_limit, hold.frame, what)
    what = f'distance of the nominal torques from those that balance the contacts of {hold.owner}'
    record.measure('nominal_balance', torque_distance(hold.balance, torques), hold.frame, what)


def check_control(holds: Sequence[Hold], control: Mapping[str, str], record: Recorder) -> None:
    """Check that a segment's contacts are kept while the held joints are a little off.

    Object and joints in effort control must be able to follow, Wᵀ q̇ + J_E θ̇_E = −J_P θ̇_P, in one
    way only. That holds as long as the ranks of these matrices are the largest that they have.

    Args:
        holds: The segment's contacts in its frames.
        control: ``position`` or ``effort`` for each joint.
        record: Where to.
    """
    names = holds[0].mechanism.problem.hand.joint_names
    owner, frame = holds[0].owner, holds[min(1, len(holds) - 1)].frame
    known = set(control) == set(names) and set(control.values()) <= {'position', 'effort'}
    message = f'{owner} has control {dict(control)}, expected position or effort for each joint'
    if not record.require('control', known, frame, message):
        return
    effort = [k for k, name in enumerate(names) if control[name] == 'effort']
    ranks = np.zeros(3, dtype=int)
    for hold in holds:
        object_alone, arms = hold.balance.wrenches.T, hold.balance.lever_arms
        following = np.hstack([object_alone, arms[:, effort]])
        moving = (object_alone, following, np.hstack([object_alone, arms]))
        ranks = np.maximum(ranks, [np.linalg.matrix_rank(part, RANK) for part in moving])
    record.require(
        'control',
        bool(ranks[1] == ranks[2]),
        frame,
        f'{owner}: with the joints held that are, the grasp jams; {ranks[2] - ranks[1]} more in '
        'effort control expected',
    )
    record.require(
        'control',
        bool(ranks[1] == ranks[0] + len(effort)),
        frame,
        f'{owner}: {len(effort)} joints are in effort control, expected '
        f'{ranks[1] - ranks[0]}, as the others are not kept in place by contacts',
    )


def _torque_error(hold: Hold, claimed: Limits, found: Limits) -> tuple[float, str]:
    worst, what = 0.0, 'relative error of the torque limits'
    names = hold.mechanism.problem.hand.joint_names
    for side, claims, finds in zip(('lower', 'upper'), claimed, found, strict=True):
        for name, claim, find in zip(names, claims.tolist(), finds.tolist(), strict=True):
            error = _difference(claim, find, hold.balance.torque_unit)
            if error > worst:
                worst = error
                what = (
                    f'{side} torque limit of {name} is {claim:.9g} N·m, for {hold.owner} '
                    f'{find:.9g} N·m: relative error'
                )
    return worst, what


def _difference(claim: float, find: float, unit: float) -> float:
    bound = UNBOUNDED * unit
    if (claim >= bound and find >= bound) or (claim <= -bound and find <= -bound):
        return 0.0
    if not (np.isfinite(claim) and np.isfinite(find)):
        return math.inf
    return abs(claim - find) / (unit + abs(find))
