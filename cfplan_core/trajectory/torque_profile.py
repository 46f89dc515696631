"""Nominal torques along a plan: those that suit each segment best, joined at the events.

Where two segments meet the contacts of both touch. Their equilibria are faces of one polytope,
that of all these contacts, and often have no more than a vertex in common: a torque that stayed
inside the limits of one segment and then of the other would have to pass that very point (Trinkle
& Hunter, Figure 7, times 20 and 68). On the straight way from the torque τ_A of the one to the
torque τ_B of the other all contacts press, so at the event the nominal torque is τ_A +
λ (τ_B − τ_A): squeezed or relaxed towards the next segment as far as the limits of the first one
leave room, and no farther than the middle of what the limits of both allow.

What suits a segment, and which joints are controlled in torque, `cfplan_core.mechanics.actuation`
tells.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cfplan_core.contact.disturbance import disturbance
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import Actuation, ContactModel, Holding

Limits = tuple[FloatArray, FloatArray]

POSITION, EFFORT = 'position', 'effort'
"""How a joint is controlled in a segment."""

_STILL = 1e-12
# A change of roles is a disturbance: they are kept while the margin is this share of the best.
_KEPT = 0.5


class Profile(NamedTuple):
    """Nominal torques of a plan and who supplies them.

    Attributes:
        torques: Shape (f, n), N·m; a frame that two segments share has one inside the limits of
            the earlier segment.
        entries: Shape (segments, n), torques of each segment at its first frame, inside its own
            limits.
        controls: For each segment how to control each joint.
    """

    torques: FloatArray
    entries: FloatArray
    controls: tuple[dict[str, str], ...]


class TorqueProfile:
    """Collects the segments of a plan and joins their nominal torques."""

    def __init__(self, system: ContactSystem, model: ContactModel, squeeze: float) -> None:
        """Begin a profile.

        Args:
            system: Compiled problem, with all joints.
            model: Says how segments can be held.
            squeeze: Largest contact force, weights.
        """
        self._system = system
        self._model = model
        self._squeeze = squeeze
        self._unit = system.force_unit * system.size
        joints = system.problem.hand.joints
        self._effort = np.array([joint.effort_limit for joint in joints])
        self._stretches: list[Holding] = []
        self._weights: list[FloatArray] = []
        self._limits: list[Limits] = []

    def add(
        self, formation: Formation, z: FloatArray, gradients: FloatArray, limits: Limits
    ) -> None:
        """Append a segment.

        Args:
            formation: Its contacts.
            z: Shape (s, 3 + n).
            gradients: Shape (s, k, 3 + n), of the contacts' gaps.
            limits: Lower and upper torques with the links' weight, each of shape (s, n), N·m.
        """
        weight = self._system.link_weight_torques(z)
        effort = self._effort / self._unit
        errors = disturbance(self._system, z, formation.array)
        self._stretches.append(Holding(gradients, errors, -effort - weight, effort - weight))
        self._weights.append(weight)
        self._limits.append(limits)

    def joined(self) -> Profile:
        """Choose how to hold each segment; join their torques at the frames that they share."""
        chosen = _chosen(self._model.actuations(self._stretches, self._squeeze))
        own, within = [], []
        for way, weight, (low, high) in zip(chosen, self._weights, self._limits, strict=True):
            torques = (way.torques + weight) * self._unit
            # A torque from an interval of no width may be beside it by rounding.
            own.append(np.fmin(np.fmax(torques, low), high))
            within.append((np.fmax(low, -self._effort), np.fmin(high, self._effort)))
        joined = [torques.copy() for torques in own]
        for k in range(len(joined) - 1):
            before, after = own[k][-1], own[k + 1][0]
            leaves = within[k][0][-1], within[k][1][-1]
            enters = within[k + 1][0][0], within[k + 1][1][0]
            joined[k][-1] = _towards(before, after, leaves, enters)
            joined[k + 1][0] = _towards(after, before, enters, leaves)
        entries = np.array([torques[0] for torques in joined])
        rows = [torques[1 if k else 0 :] for k, torques in enumerate(joined)]
        return Profile(np.concatenate(rows), entries, self._controls(chosen))

    def _controls(self, chosen: Sequence[Actuation]) -> tuple[dict[str, str], ...]:
        """How to control each joint in each segment."""
        names = self._system.problem.hand.joint_names
        return tuple(
            {name: EFFORT if j in way.effort else POSITION for j, name in enumerate(names)}
            for way in chosen
        )


def _chosen(ways: Sequence[Sequence[Actuation]]) -> list[Actuation]:
    """The best way for each segment, or that with the roles before if it is nearly as good."""
    chosen: list[Actuation] = []
    for choices in ways:
        best = choices[0]
        for way in choices:
            same = bool(chosen) and way.effort == chosen[-1].effort
            if same and way.margin >= _KEPT * best.margin:
                best = way
        chosen.append(best)
    return chosen


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
