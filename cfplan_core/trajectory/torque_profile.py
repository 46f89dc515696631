"""Nominal torques along a plan: the middle of each segment's equilibria, joined at the events.

Where two segments meet the contacts of both touch. Their equilibria are faces of one polytope,
that of all these contacts, and often have no more than a vertex in common: a torque that stayed
inside the limits of one segment and then of the other would have to pass that very point (Trinkle
& Hunter, Figure 7, times 20 and 68). On the straight way from the middle τ_A of the one to the
middle τ_B of the other all contacts press, so at the event the nominal torque is τ_A +
λ (τ_B − τ_A): squeezed or relaxed towards the next segment as far as the limits of the first one
leave room, and no farther than the middle of what the limits of both allow.

Which joints are controlled in torque, `cfplan_core.mechanics.control_roles` tells.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import ContactModel
from cfplan_core.mechanics.control_roles import Roles

Limits = tuple[FloatArray, FloatArray]

POSITION, EFFORT = 'position', 'effort'
"""How a joint is controlled in a segment."""

_STILL = 1e-12
# A change of roles is a disturbance: they are kept while the margin is this share of the best.
_KEPT = 0.5


class TorqueProfile:
    """Collects the segments of a plan and joins their nominal torques."""

    def __init__(self, system: ContactSystem, model: ContactModel, squeeze: float) -> None:
        """Begin a profile.

        Args:
            system: Compiled problem, with all joints.
            model: Gives the middle of the equilibria.
            squeeze: Largest contact force, weights.
        """
        self._system = system
        self._model = model
        self._squeeze = squeeze
        self._unit = system.force_unit * system.size
        joints = system.problem.hand.joints
        self._effort = np.array([joint.effort_limit for joint in joints])
        self._effort_joints: tuple[int, ...] = ()
        self._middles: list[FloatArray] = []
        self._limits: list[tuple[Limits, Limits]] = []

    def add(
        self, gradients: FloatArray, z: FloatArray, low: FloatArray, high: FloatArray
    ) -> dict[str, str]:
        """Append a segment.

        Args:
            gradients: Shape (s, k, 3 + n), of its contacts.
            z: Shape (s, 3 + n).
            low: Shape (s, n), torque limits with the links' weight, N·m.
            high: As `low`.

        Returns:
            How to control each joint.
        """
        weight = self._system.link_weight_torques(z)
        effort = self._effort / self._unit
        middle, roles = self._model.actuation(
            gradients, -effort - weight, effort - weight, self._squeeze
        )
        # The middle of an interval of no width may be beside it by rounding.
        middle = np.fmin(np.fmax((middle + weight) * self._unit, low), high)
        self._middles.append(middle)
        within = np.fmax(low, -self._effort), np.fmin(high, self._effort)
        self._limits.append(((within[0][0], within[1][0]), (within[0][-1], within[1][-1])))
        self._effort_joints = self._chosen(roles)
        return {
            name: EFFORT if joint in self._effort_joints else POSITION
            for joint, name in enumerate(self._system.problem.hand.joint_names)
        }

    def _chosen(self, roles: Sequence[Roles]) -> tuple[int, ...]:
        """The best roles, or those of the segment before if they are nearly as good."""
        best = roles[0]
        for choice in roles:
            if choice.effort == self._effort_joints and choice.margin >= _KEPT * best.margin:
                return choice.effort
        return best.effort

    def joined(self) -> tuple[FloatArray, FloatArray]:
        """Join the segments at the frames that they share.

        Returns:
            The torques of all frames, shape (f, n), N·m; a shared frame has one inside the limits
            of the earlier segment. And those of each segment at its first frame, inside its own
            limits, shape (segments, n).
        """
        middles = [middle.copy() for middle in self._middles]
        for k in range(len(middles) - 1):
            before, after = self._middles[k][-1], self._middles[k + 1][0]
            leaves, enters = self._limits[k][1], self._limits[k + 1][0]
            middles[k][-1] = _towards(before, after, leaves, enters)
            middles[k + 1][0] = _towards(after, before, enters, leaves)
        entries = np.array([middle[0] for middle in middles])
        rows = [middle[1 if k else 0 :] for k, middle in enumerate(middles)]
        return np.concatenate(rows), entries


def _towards(start: FloatArray, end: FloatArray, own: Limits, other: Limits) -> FloatArray:
    """Go from the middle of one segment towards that of another, as the module says."""
    farthest = _share(start, end, own)
    nearest = 1.0 - _share(end, start, other)
    share = 0.5 * (farthest + nearest) if nearest <= farthest else min(0.5, farthest)
    return np.clip(start + share * (end - start), *own)


def _share(start: FloatArray, end: FloatArray, limits: Limits) -> float:
    """Largest λ in [0, 1] for which start + λ (end − start) is inside limits."""
    way = end - start
    room = np.where(way > 0.0, limits[1], limits[0]) - start
    moves = np.abs(way) > _STILL
    shares = np.divide(room, way, where=moves, out=np.ones_like(way))
    return float(np.clip(shares.min(initial=1.0), 0.0, 1.0))
