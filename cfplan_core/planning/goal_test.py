"""Where a piece fulfils a goal that is not a whole grasp."""

from __future__ import annotations

import numpy as np

from cfplan_core.contact.elements import parse_contact
from cfplan_core.contact.gaps import gap_gradients
from cfplan_core.contact.system import ContactSystem, IntArray
from cfplan_core.errors import CfplanError
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.model import Goal
from cfplan_core.planning.manifold import independent_rows, project, tangent_basis
from cfplan_core.planning.pieces import SAME, Piece
from cfplan_core.planning.tracing import STEP

_ITERATIONS = 12


class GoalTest:
    """Looks for a goal's object pose, joints and contacts on pieces.

    Attributes:
        columns: Coordinates of z that the goal gives, shape (m,).
        wanted: Their values, shape (m,).
    """

    def __init__(self, system: ContactSystem, goal: Goal) -> None:
        """Compile a goal of which at least one of pose, joints and contacts is given."""
        self._system = system
        self._pairs = {system.pair(parse_contact(name)) for name in goal.contacts or ()}
        columns: list[int] = []
        wanted: list[float] = []
        tolerance: list[float] = []
        if goal.object_pose is not None:
            x, y, phi = goal.object_pose
            offset = complex(*system.problem.object.center_of_mass) * np.exp(1j * phi)
            center = (complex(x, y) + offset) / system.size
            columns += [0, 1, 2]
            wanted += [center.real, center.imag, float(phi)]
            tolerance += [goal.tolerance.position / system.size] * 2 + [goal.tolerance.angle]
        names = system.joint_names
        for name, angle in (goal.joints or {}).items():
            if name not in names:
                raise CfplanError(f'joint {name!r}: expected one of {", ".join(names)}')
            columns.append(3 + names.index(name))
            wanted.append(angle)
            tolerance.append(goal.tolerance.joints)
        self.columns = np.array(columns, dtype=np.intp)
        self.wanted = np.array(wanted)
        self._tolerance = np.array(tolerance)
        if not columns and not self._pairs:
            raise CfplanError('expected at least one of object pose, joints and contacts')
        if not np.isfinite(self.wanted).all():
            raise CfplanError(f'got {wanted}, expected finite numbers')

    def __call__(self, piece: Piece) -> FloatArray | None:
        """Return a configuration of a piece, shape (3 + n,), that fulfils the goal, if any.

        Of a region only the anchor is looked at; `Regions.reach` drives further.
        """
        if not self.may_hold(piece):
            return None
        if not len(self.columns):
            return np.asarray(piece.points[len(piece.points) // 2])
        distance = np.abs(piece.points[:, self.columns] - self.wanted).max(axis=1)
        for nearest in _local_minima(distance):
            if piece.dimension != 1:
                z = piece.points[nearest]
            elif distance[nearest] < 2.0 * STEP:
                z = self._nearest(piece, piece.points[nearest])
                if not _lies_on(piece, z):
                    continue
            else:
                continue
            if self.fits(z):
                return np.asarray(z)
        return None

    def may_hold(self, piece: Piece) -> bool:
        """Tell whether a piece has the contacts wanted."""
        return self._pairs <= set(piece.formation.pairs)

    def has_contacts(self, pairs: IntArray) -> bool:
        """Tell whether the contacts wanted are among pairs, shape (k,)."""
        return self._pairs <= set(pairs.tolist())

    def missing(self, pairs: IntArray) -> list[int]:
        """List the contacts wanted that are not among pairs, shape (k,)."""
        return sorted(self._pairs - set(pairs.tolist()))

    def fits(self, z: FloatArray) -> bool:
        """Tell whether a configuration has the coordinates wanted, within their tolerances."""
        return bool((np.abs(z[self.columns] - self.wanted) <= self._tolerance).all())

    def _nearest(self, piece: Piece, z: FloatArray) -> FloatArray:
        """Gauss-Newton steps along a piece to where the wanted coordinates are nearest."""
        pairs = piece.formation.array
        for _ in range(_ITERATIONS):
            gradients = gap_gradients(self._system, self._system.place(z[None]), pairs)[0]
            rows = list(independent_rows(gradients))
            basis = tangent_basis(gradients[rows])
            off = self.wanted - z[self.columns]
            along = np.linalg.lstsq(basis[:, self.columns].T, off, rcond=1e-9)[0]
            found = project(self._system, pairs[rows], z, basis, (z + along @ basis)[None])
            if not found.converged[0]:
                break
            z = found.points[0]
            if np.abs(along).max() < 1e-12:
                break
        return z


def _lies_on(piece: Piece, z: FloatArray) -> bool:
    """Tell whether a configuration of a curve's manifold lies between the curve's ends."""
    place = piece.place(z)
    if place in (0.0, len(piece.points) - 1.0):
        return bool(np.abs(piece.points[int(place)] - z).max() < SAME)
    return bool(np.abs(piece.points - z).max(axis=1).min() < STEP)


def _local_minima(values: FloatArray) -> list[int]:
    """Indices of the smallest values among their neighbours, smallest first."""
    padded = np.concatenate([[np.inf], values, [np.inf]])
    smallest = (values <= padded[:-2]) & (values <= padded[2:])
    return sorted((int(i) for i in np.flatnonzero(smallest)), key=lambda i: float(values[i]))
