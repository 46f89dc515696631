"""How far a configuration is from what would spoil a plan there, as one number.

The margin is the smallest of five ratios; 1 is comfortable, 0 is the border of what works:

- force: 1 / F, where F is the needed force in weights of the object;
- hold: the stability margin, the distance of W's columns and f from no longer spanning R³, / 0.2;
- clearance: the smallest distance between features of bodies that do not touch, in object sizes,
  / 0.1. Features that touch where the stretch begins do not count until they are as far apart as
  they get before they come nearer again, nor do, likewise backwards, those at its end: the plan
  breaks or makes these contacts;
- torque: k contacts of rank 3 leave k − 3 joints to be controlled by their torque (Trinkle &
  Hunter, Section 3): the width of the (k − 3)rd widest interval of torques that keep the contacts,
  within the effort limits, in weights times sizes, / 0.2. Three contacts need none;
- limits: the distance of the joints from their limits, in rad, / 0.1.

`docs/optimality.md` says why.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cfplan_core.contact.formation import Formation
from cfplan_core.contact.gaps import gap_gradients, gaps
from cfplan_core.contact.system import ComplexArray, ContactSystem, Placement
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import ContactModel
from cfplan_core.planning.transitions import TOUCH

_COMFORTABLE_HOLD = 0.2
_COMFORTABLE_CLEARANCE = 0.1
_COMFORTABLE_TORQUE = 0.2
_COMFORTABLE_LIMIT = 0.1
# Farther apart than this, in object sizes, nothing matters.
_FAR = 10.0


class Ratios(NamedTuple):
    """The parts of the margin along a stretch, each of shape (s,)."""

    force: FloatArray
    hold: FloatArray
    clearance: FloatArray
    torque: FloatArray
    limits: FloatArray

    @property
    def worst(self) -> float:
        """The smallest of all: the margin of the stretch."""
        return float(min(ratio.min() for ratio in self))


class Robustness:
    """The margin of configurations of one system under one contact model."""

    def __init__(self, system: ContactSystem, model: ContactModel) -> None:
        """Prepare; the system has all joints."""
        self._system = system
        self._model = model
        effort = np.array([joint.effort_limit for joint in system.problem.hand.joints])
        self._effort = effort / (system.force_unit * system.size)

    def ratios(self, formation: Formation, z: FloatArray) -> Ratios:
        """Measure a stretch of motion inside a contact formation.

        Args:
            formation: The contacts that are kept.
            z: Shape (s, 3 + n), in order; at the first and the last others may touch as well.
        """
        system = self._system
        placed = system.place(z)
        gradients = gap_gradients(system, placed, formation.array)
        needed = self._model.needed_forces(gradients)
        joints = z[:, 3:]
        return Ratios(
            force=1.0 / np.maximum(needed, 1e-9),
            hold=np.maximum(self._model.margins(gradients).stable, 0.0) / _COMFORTABLE_HOLD,
            clearance=self._clearance(formation, placed) / _COMFORTABLE_CLEARANCE,
            torque=self._torque(gradients, z) / _COMFORTABLE_TORQUE,
            limits=np.minimum(joints - system.lower, system.upper - joints).min(axis=1)
            / _COMFORTABLE_LIMIT,
        )

    def _clearance(self, formation: Formation, placed: Placement) -> FloatArray:
        """Smallest distance of a vertex from an edge that it neither touches nor is to touch.

        Distances are least where a vertex passes the end of an edge, between samples mostly: they
        are those of the straight path from each sample to the next, in the edge's frame.
        """
        system = self._system
        gap, offset = gaps(system, placed, slice(None))
        length = system.pair_length
        distance = np.hypot(gap, np.maximum(np.maximum(-offset, offset - length), 0.0))
        left_out = np.zeros(distance.shape, dtype=bool)
        left_out[:, formation.array] = True
        for along, out in ((distance, left_out), (distance[::-1], left_out[::-1])):
            pairs = np.flatnonzero(along[0] < TOUCH)
            apart = along[:, pairs]
            opening = apart >= np.maximum.accumulate(apart, axis=0)
            out[:, pairs] |= np.logical_and.accumulate(opening, axis=0)
        nearest = np.where(left_out, _FAR, distance).min(axis=1)
        if len(gap) > 1:
            place = offset + 1j * gap
            between = np.minimum(_passing(place), _passing(place - length))
            between = np.where(left_out[1:] & left_out[:-1], _FAR, between).min(axis=1)
            nearest[1:] = np.minimum(nearest[1:], between)
        return np.asarray(nearest)

    def _torque(self, gradients: FloatArray, z: FloatArray) -> FloatArray:
        """Width of the narrowest interval of torques that has to be held."""
        spare = gradients.shape[1] - 3
        joints = gradients.shape[2] - 3
        if spare < 1 or joints == 0:
            return np.full(len(z), np.inf)
        weight = self._system.link_weight_torques(z)
        lower, upper = self._model.torque_limits(gradients)
        lower = np.maximum(lower + weight, -self._effort)
        upper = np.minimum(upper + weight, self._effort)
        widths = np.sort(np.nan_to_num(np.maximum(upper - lower, 0.0)), axis=1)
        return np.asarray(widths[:, -min(spare, joints)])


def _passing(place: ComplexArray) -> FloatArray:
    """Distances of straight paths between successive points from zero; shape (s - 1, m).

    Args:
        place: Shape (s, m).
    """
    step = np.diff(place, axis=0)
    along = -(place[:-1] * step.conj()).real / np.maximum(np.abs(step) ** 2, 1e-30)
    return np.asarray(np.abs(place[:-1] + np.clip(along, 0.0, 1.0) * step))
