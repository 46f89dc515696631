"""How far a motion is from what would spoil it, as one number.

The margin is the smallest of seven ratios; 1 is comfortable, 0 is the border of what works:

- force: 1 / F, where F is the needed force in weights of the object;
- hold: the stability margin, the distance of W's columns and f from no longer spanning R³, / 0.1
  of three contacts, / 0.05 of more, which can be pressed harder; for two contacts that of second
  order, the smallest of the energy's curvature, the two forces and the sine between the wrenches,
  / 0.1. Where other contacts stop pressing and the object settles onto two of them, these two
  count if that is more, less the load that they leave to the others;
- friction: the largest coefficient of friction against the motion with which the contacts still
  hold the object (`friction_limits`), / 0.2; for two contacts as for hold;
- stiffness: 0.01 / the largest shift of the object, in object sizes and rad, by friction of 0.1
  where drives of 330 weights times sizes per rad hold the joints; 0 where such drives are too soft
  to keep the object stable (`friction_shifts`);
- clearance: the smallest distance of a near miss, in object sizes, / 0.1. A near miss is a vertex
  and an edge that come nearer than 0.1 and part again without having touched in between;
- torque: k contacts of rank 3 leave k − 3 joints to be controlled by their torque (Trinkle &
  Hunter, Section 3): the width of the (k − 3)rd widest interval of torques that keep the contacts,
  within the effort limits, in weights times sizes, / 0.2. Three contacts need none;
- limits: the distance of the joints from their limits, in rad, / 0.1.

All but clearance and friction are properties of a configuration: no plan has a larger margin than
its start and its goal. Clearance is that of a whole path, and friction depends on which way it
goes, so that a plan backwards has another margin. `docs/optimality.md` says why these.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from cfplan_core.contact.curvature import gap_hessians
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.gaps import gap_gradients, offset_gradients
from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_forces import least_forces
from cfplan_core.mechanics.contact_model import ContactModel
from cfplan_core.mechanics.friction_limit import friction_limits
from cfplan_core.mechanics.friction_shift import DRIVE_STIFFNESS, friction_shifts
from cfplan_core.mechanics.second_order import pair_forces, unbalanced_margin
from cfplan_core.planning.equations import is_second_order
from cfplan_core.planning.near_misses import near_misses
from cfplan_core.planning.tracing import stability_margins

_COMFORTABLE_HOLD = 0.1
# Of more than three contacts: how hard they press can be chosen.
_COMFORTABLE_HOLD_OF_MANY = 0.05
COMFORTABLE_CLEARANCE = 0.1
_COMFORTABLE_TORQUE = 0.2
_COMFORTABLE_LIMIT = 0.1
_COMFORTABLE_SHIFT = 0.01
_COMFORTABLE_FRICTION = 0.2
# What the shift is measured with.
_FRICTION = 0.1
# Step, in radians and object sizes, at which margins are looked at.
_FINE = 0.01


class Ratios(NamedTuple):
    """The parts of the margin along a stretch, each of shape (s,)."""

    force: FloatArray
    hold: FloatArray
    torque: FloatArray
    limits: FloatArray
    stiffness: FloatArray
    friction: FloatArray
    clearance: FloatArray

    @property
    def worst(self) -> float:
        """The smallest of all: the margin of the stretch."""
        return float(min(ratio.min() for ratio in self))


class _Held(NamedTuple):
    """A stretch with what all ratios ask of its contacts."""

    formation: Formation
    z: FloatArray
    gradients: FloatArray
    slides: FloatArray
    hessians: FloatArray


class Robustness:
    """The margin of configurations of one system under one contact model.

    Attributes:
        system: With all joints.
    """

    def __init__(self, system: ContactSystem, model: ContactModel) -> None:
        """Prepare; the system has all joints."""
        self.system = system
        self._model = model
        effort = np.array([joint.effort_limit for joint in system.problem.hand.joints])
        self._effort = effort / (system.force_unit * system.size)

    def ratios(self, formation: Formation, z: FloatArray) -> Ratios:
        """Measure a stretch of motion inside a contact formation.

        Args:
            formation: The contacts that are kept.
            z: Shape (s, 3 + n), in order.
        """
        held = self._held(formation, z)
        settled = self._settled(held)
        _, friction = self._friction(held, settled, steps_along(z))
        steady = self._steady(held, settled)
        return Ratios(*steady, friction=friction, clearance=self._clearance([z]))

    def widths(self, formation: Formation, z: FloatArray, steps: FloatArray) -> FloatArray:
        """Smallest ratio at each configuration without the clearance, which is of a whole path.

        Args:
            formation: The contacts that are kept.
            z: Shape (s, 3 + n), in any order.
            steps: Shape (s, 3 + n), direction of the motion at each of them.

        Returns:
            Shape (2, s): of the motion backwards and as it is.
        """
        held = self._held(formation, z)
        settled = self._settled(held)
        steady = np.minimum.reduce(self._steady(held, settled))
        friction = self._friction(held, settled, steps)
        return np.minimum(steady, friction)

    def width(self, formation: Formation, z: FloatArray) -> float:
        """Smallest ratio but for the clearance on a motion, looked at in fine steps.

        Args:
            formation: The contacts that are kept.
            z: Shape (s, 3 + n), in order.
        """
        z = finer(z)
        return float(self.widths(formation, z, steps_along(z))[1].min())

    def margin(self, legs: Sequence[tuple[Formation, FloatArray]]) -> float:
        """Margin of motions one after the other, each a formation and points, (s, 3 + n).

        No more than the smallest of theirs: a near miss may take more than one.
        """
        width = min(self.width(formation, z) for formation, z in legs)
        return min(width, float(self._clearance([z for _, z in legs]).min()))

    def _held(self, formation: Formation, z: FloatArray) -> _Held:
        """Differentiate the contacts of a stretch."""
        system, pairs = self.system, formation.array
        placed = system.place(z)
        return _Held(
            formation,
            z,
            gap_gradients(system, placed, pairs),
            offset_gradients(system, placed, pairs),
            gap_hessians(system, placed, pairs),
        )

    def _steady(
        self, held: _Held, settled: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
        """Ratios of force, hold, torque, limits and stiffness, each of shape (s,)."""
        system, model = self.system, self._model
        formation, z, gradients = held[:3]
        joints = z[:, 3:]
        room = np.minimum(joints - system.lower, system.upper - joints).min(axis=1)
        hold = stability_margins(system, model, z, gradients, formation.array).stable
        firm = _COMFORTABLE_HOLD if len(formation.pairs) <= 3 else _COMFORTABLE_HOLD_OF_MANY
        return (
            1.0 / np.maximum(self._force(gradients), 1e-9),
            np.maximum(np.maximum(hold, 0.0) / firm, settled / _COMFORTABLE_HOLD),
            self._torque(gradients, z) / _COMFORTABLE_TORQUE,
            room / _COMFORTABLE_LIMIT,
            _COMFORTABLE_SHIFT / np.maximum(self._shift(held), 1e-9),
        )

    def _friction(self, held: _Held, settled: FloatArray, steps: FloatArray) -> FloatArray:
        """Ratio of friction in motions backwards and as they are; shape (2, s)."""
        if is_second_order(held.formation.pairs):
            return np.full((2, len(steps)), np.inf)
        load, most = self.system.load, _COMFORTABLE_FRICTION
        limits = [
            friction_limits(held.gradients, held.slides, way, load, most)
            for way in (-steps, steps)
        ]
        return np.maximum(np.array(limits) / most, settled / _COMFORTABLE_HOLD)

    def _clearance(self, parts: Sequence[FloatArray]) -> FloatArray:
        """Ratio of the near misses on a path, at its points; shape (s,)."""
        z = np.concatenate(parts)
        return near_misses(self.system, z, COMFORTABLE_CLEARANCE) / COMFORTABLE_CLEARANCE

    def _force(self, gradients: FloatArray) -> FloatArray:
        """Needed force; of two contacts, also where these only nearly balance the object."""
        if not is_second_order(range(gradients.shape[1])):
            return self._model.needed_forces(gradients)
        forces, _ = pair_forces(gradients[..., :3], self.system.load)
        return np.asarray(forces.max(axis=1))

    def _settled(self, held: _Held) -> FloatArray:
        """Stability margin of two of the contacts at best, less what they leave to the others.

        That of two contacts is there also where these only nearly balance the object; shape (s,).
        """
        load = self.system.load
        found = np.full(len(held.z), -np.inf)
        if not self._model.second_order:
            return found
        for chosen in combinations(range(len(held.formation)), 2):
            two = list(chosen)
            wrenches, rates = held.gradients[:, two, :3], held.hessians[:, two, :3]
            _, rest = pair_forces(wrenches, load)
            found = np.maximum(found, unbalanced_margin(wrenches, rates, load) - rest)
        return found

    def _shift(self, held: _Held) -> FloatArray:
        """Largest shift of the object by friction; shape (s,)."""
        wrenches, load = held.gradients[..., :3], self.system.load
        if is_second_order(held.formation.pairs):
            forces, _ = pair_forces(wrenches, load)
        else:
            forces = least_forces(wrenches, load)
        shifts = friction_shifts(
            held.gradients, held.slides, held.hessians, np.nan_to_num(forces), DRIVE_STIFFNESS
        )
        return np.where(np.isnan(forces).any(axis=1), np.inf, _FRICTION * shifts)

    def _torque(self, gradients: FloatArray, z: FloatArray) -> FloatArray:
        """Width of the narrowest interval of torques that has to be held."""
        spare = gradients.shape[1] - 3
        joints = gradients.shape[2] - 3
        if spare < 1 or joints == 0:
            return np.full(len(z), np.inf)
        weight = self.system.link_weight_torques(z)
        lower, upper = self._model.torque_limits(gradients)
        lower = np.maximum(lower + weight, -self._effort)
        upper = np.minimum(upper + weight, self._effort)
        widths = np.maximum(upper - lower, 0.0)
        widths = np.sort(np.where(np.isnan(widths), 0.0, widths), axis=1)
        return np.asarray(widths[:, -min(spare, joints)])


def finer(z: FloatArray) -> FloatArray:
    """Points with more between them, on straight lines: margins have sharp minima.

    Args:
        z: Shape (s, 3 + n), successive points.
    """
    steps = np.diff(z, axis=0)
    parts = np.ceil(np.abs(steps).max(axis=1) / _FINE).astype(int) if len(z) > 1 else []
    inner = [
        begin + np.arange(count)[:, None] / max(count, 1) * step
        for begin, step, count in zip(z, steps, parts, strict=False)
    ]
    return np.concatenate([*inner, z[-1:]])


def steps_along(z: FloatArray) -> FloatArray:
    """Direction of a motion at its points: towards the next one, at the last from the one before.

    Args:
        z: Shape (s, 3 + n), successive points.

    Returns:
        As z; zero for a single point.
    """
    steps = np.zeros_like(z)
    if len(z) > 1:
        steps[:-1] = np.diff(z, axis=0)
        steps[-1] = steps[-2]
    return steps
