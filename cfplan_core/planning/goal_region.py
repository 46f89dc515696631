"""The configurations that fulfil a goal: coordinates within tolerances, and contacts.

A goal gives some functions of the configuration: the position of the object's frame, its angle,
joint angles. With each offset divided by its tolerance the goal's coordinates are fulfilled where

    max(|position offset|, |angle offset|, |offset of joint 1|, ...) ≤ 1,

angles as numbers, whole turns counted. The frame's position is that of the centre of mass less
the turned vector between the two, so that it depends on the angle too.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from cfplan_core.contact.elements import parse_contact
from cfplan_core.contact.system import ContactSystem
from cfplan_core.errors import CfplanError
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.model import Goal


class GoalRegion:
    """A goal compiled for one problem.

    Attributes:
        pairs: Contacts that must touch.
        exact: True if nothing else may touch.
        count: Number m of coordinates that the goal gives, the position as two.
        columns: Columns of z that the goal's coordinates stand in, shape (m,): of the position
            those of the centre of mass.
        wanted: Values of these columns in the goal, shape (m,); for a position without an angle
            as if that were zero.
    """

    def __init__(self, system: ContactSystem, goal: Goal) -> None:
        """Compile a goal of which at least one part is given.

        Raises:
            CfplanError: A joint or a contact does not exist, a number is not finite, or the goal
                gives nothing.
        """
        self.pairs = frozenset(system.pair(parse_contact(name)) for name in goal.contacts or ())
        self.exact = goal.exact_contacts
        self._size = system.size
        self._names = system.joint_names
        self._centered = complex(*system.problem.object.center_of_mass) / system.size
        self._position: FloatArray | None = None
        columns: list[int] = []
        wanted: list[float] = []
        tolerance: list[float] = []
        angle = goal.object_angle
        if goal.object_position is not None:
            self._position = goal.object_position / system.size
            center = complex(*self._position) + np.exp(1j * (angle or 0.0)) * self._centered
            columns += [0, 1]
            wanted += [center.real, center.imag]
            tolerance += [goal.tolerance.position / system.size] * 2
        if angle is not None:
            columns.append(2)
            wanted.append(angle)
            tolerance.append(goal.tolerance.angle)
        names = system.joint_names
        for name, value in (goal.joints or {}).items():
            if name not in names:
                raise CfplanError(f'joint {name!r}: expected one of {", ".join(names)}')
            columns.append(3 + names.index(name))
            wanted.append(value)
            tolerance.append(goal.tolerance.joints)
        self.count = len(columns)
        self.columns = np.array(columns, dtype=np.intp)
        self.wanted = np.array(wanted)
        self._tolerance = np.array(tolerance)
        if not columns and not self.pairs:
            raise CfplanError(
                'expected at least one of object pose, position, orientation, joints and contacts'
            )
        if not np.isfinite(self.wanted).all():
            raise CfplanError(f'got {wanted}, expected finite numbers')

    def offsets(self, z: FloatArray) -> FloatArray:
        """How far configurations are from what is wanted, in tolerances.

        Args:
            z: Shape (s, 3 + n).

        Returns:
            Shape (s, m): what must be added.
        """
        off = self.wanted - z[:, self.columns]
        if self._position is not None:
            frame = z[:, 0] + 1j * z[:, 1] - np.exp(1j * z[:, 2]) * self._centered
            off[:, 0] = self._position[0] - frame.real
            off[:, 1] = self._position[1] - frame.imag
        return np.asarray(off / self._tolerance)

    def gradients(self, z: FloatArray) -> FloatArray:
        """Differentiate the goal's coordinates, in tolerances.

        Args:
            z: Shape (3 + n,).

        Returns:
            Shape (m, 3 + n).
        """
        rows = np.zeros((self.count, len(z)))
        rows[np.arange(self.count), self.columns] = 1.0
        if self._position is not None:
            turn = -1j * np.exp(1j * z[2]) * self._centered
            rows[:2, 2] = turn.real, turn.imag
        return np.asarray(rows / self._tolerance[:, None])

    def ratios(self, z: FloatArray) -> FloatArray:
        """Largest offset in tolerances: up to 1 the goal's coordinates are fulfilled.

        Args:
            z: Shape (s, 3 + n).

        Returns:
            Shape (s,); zero if the goal gives contacts alone.
        """
        off = np.abs(self.offsets(z))
        if self._position is not None:
            off[:, 0] = np.hypot(off[:, 0], off[:, 1])
        return np.asarray(off.max(axis=1, initial=0.0))

    def beyond(self, z: FloatArray) -> FloatArray:
        """How far configurations are outside the tolerances, in radians and object sizes.

        Args:
            z: Shape (s, 3 + n).

        Returns:
            Shape (s,); zero where the goal's coordinates are fulfilled, but for the corners of a
            position's tolerance.
        """
        off = (np.abs(self.offsets(z)) - 1.0) * self._tolerance
        return np.asarray(np.maximum(off, 0.0).max(axis=1, initial=0.0))

    def fits(self, z: FloatArray) -> bool:
        """Tell whether a configuration, shape (3 + n,), has the goal's coordinates."""
        return bool(self.ratios(z[None])[0] <= 1.0)

    def holds(self, pairs: Iterable[int]) -> bool:
        """Tell whether contacts are those of the goal: all of them, and no others if exact."""
        present = set(pairs)
        return present == self.pairs if self.exact else self.pairs <= present

    def describe(self, z: FloatArray) -> str:
        """Say how far a configuration, shape (3 + n,), is from each thing that is wanted."""
        off = np.abs(self.offsets(z[None])[0] * self._tolerance)
        parts = []
        rest = list(range(self.count))
        if self._position is not None:
            apart = float(np.hypot(off[0], off[1])) * self._size
            limit = float(self._tolerance[0]) * self._size
            parts.append(_off('the object', apart, limit, 'm'))
            rest = rest[2:]
        for k in rest:
            column = int(self.columns[k])
            name = 'the object' if column == 2 else self._names[column - 3]
            parts.append(_off(name, float(off[k]), float(self._tolerance[k]), 'rad'))
        return ', '.join(parts)

    def step(self, z: FloatArray, basis: FloatArray) -> FloatArray:
        """Displacement along a basis, shape (d, 3 + n), to where the offsets are least.

        Least squares, to first order; of all such displacements the shortest.
        """
        slope = basis @ self.gradients(z).T
        along = np.linalg.lstsq(slope.T, self.offsets(z[None])[0], rcond=1e-6)[0]
        return np.asarray(along @ basis)


def _off(name: str, offset: float, limit: float, unit: str) -> str:
    """Say how far off something is; beside what is allowed, rounding is nothing."""
    shown = 0.0 if offset < 1e-6 * limit else offset
    return f'{name} {shown:.3g} {unit} off, {limit:g} allowed'
