"""Where a curve of a contact formation runs through the tolerance of a goal."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from cfplan_core.contact.system import ContactSystem, IntArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.bracketing import enclose
from cfplan_core.planning.equations import equation_gradients
from cfplan_core.planning.goal_region import GoalRegion
from cfplan_core.planning.manifold import formation_equations, project, tangent_basis
from cfplan_core.planning.pieces import SAME, Piece
from cfplan_core.planning.tracing import STEP

# Distance, in radians and object sizes, that a goal keeps from the ends of a curve, where a
# contact is made or broken, as far as its tolerance allows.
COMFORTABLE = 0.02
# Part of the tolerance that is used up to get that far from an end.
_USED = 0.9
# Nearer to an end of a curve, in radians and object sizes, is next to it.
_NEXT = 1e-5
# Ratios up to this are inside for sure.
_INSIDE = 1.0 - 1e-6
_ITERATIONS = 12
# Rounds of closer looks at a minimum, each of as many samples, each four times as close.
_ROUNDS = 6
_SAMPLES = 9
# A tolerance farther than this from every point of a curve, in radians and sizes, is not met.
_FAR = 3.0 * STEP


class CurveGoal:
    """A goal's coordinates along one curve; places are indices of its points, or between."""

    def __init__(self, system: ContactSystem, region: GoalRegion, piece: Piece) -> None:
        """Prepare.

        Args:
            system: Compiled problem.
            region: What fulfils the goal's coordinates.
            piece: Of dimension 1.
        """
        self._system = system
        self._region = region
        self._piece = piece
        self._points = piece.points
        self._pairs = piece.formation.array
        self._last = float(len(piece.points) - 1)

    def nearest(self) -> FloatArray | None:
        """Where within the tolerance the coordinates are nearest to what is wanted.

        Near an end of the curve a place farther inside is taken, as far as the tolerance allows.

        Returns:
            Shape (3 + n,), or None if the curve does not come within the tolerance.
        """
        for sample in self._dips():
            z = self._lowest(sample)
            if self._region.fits(z):
                return self.snapped(self._inside(z))
        return None

    def snapped(self, z: FloatArray) -> FloatArray:
        """An end of the curve that a configuration is next to, if that will do; else itself."""
        for end in (self._points[0], self._points[-1]):
            if np.abs(end - z).max() < _NEXT and self._region.fits(end):
                return np.asarray(end)
        return z

    def stretches(self) -> list[tuple[float, float]]:
        """First and last place of every stretch within the tolerance, in ascending order."""
        places = np.arange(self._last + 1.0)
        lowest = [self._piece.place(self._lowest(sample)) for sample in self._dips()]
        places = np.unique(np.concatenate([places, lowest]))
        inside = self._ratios(places) <= _INSIDE
        bounds = np.flatnonzero(np.diff(np.concatenate([[0], inside.astype(int), [0]])))
        found = []
        for first, end in bounds.reshape(-1, 2).tolist():
            low, high = float(places[first]), float(places[end - 1])
            if first > 0:
                low = self._border(low, float(places[first - 1]))
            if end < len(places):
                high = self._border(high, float(places[end]))
            found.append((low, high))
        return found

    def comfortable(self) -> tuple[float, float]:
        """The places nearest to the ends of the curve that are not too near to them."""
        middle = 0.5 * self._last
        low = min(_leaving(self._points), middle)
        return low, self._last - min(_leaving(self._points[::-1]), middle)

    def at(self, places: FloatArray) -> FloatArray:
        """Configurations at places, shape (s, 3 + n)."""
        first = np.clip(np.floor(places), 0.0, max(self._last - 1.0, 0.0)).astype(int)
        fraction = places - first
        before = self._points[first]
        after = self._points[np.minimum(first + 1, int(self._last))]
        guesses = before + fraction[:, None] * (after - before)
        gradients = equation_gradients(self._system, before, self._rows)
        bases = np.linalg.svd(gradients)[2][:, len(self._rows) :]
        found = project(self._system, self._rows, before, bases, guesses)
        z = np.where(found.converged[:, None], found.points, before)
        z = np.where((fraction == 0.0)[:, None], before, z)
        return np.asarray(np.where((fraction == 1.0)[:, None], after, z))

    @cached_property
    def _rows(self) -> IntArray:
        """Independent equations of the curve."""
        middle = self._points[len(self._points) // 2]
        return formation_equations(self._system, self._pairs, middle)[0]

    def _ratios(self, places: FloatArray) -> FloatArray:
        return self._region.ratios(self.at(places))

    def _dips(self) -> list[int]:
        """Points that are nearer than those beside them and not far off, nearest first."""
        ratios = self._region.ratios(self._points)
        near = self._region.beyond(self._points) < _FAR
        padded = np.concatenate([[np.inf], ratios, [np.inf]])
        lowest = near & (ratios <= padded[:-2]) & (ratios <= padded[2:])
        indices: IntArray = np.flatnonzero(lowest)
        return [int(k) for k in indices[np.argsort(ratios[indices], kind='stable')]]

    def _lowest(self, sample: int) -> FloatArray:
        """The smallest ratio between the neighbours of a point: its configuration."""
        exact = self._descended(self._points[sample])
        if exact is not None and self._region.ratios(exact[None])[0] < 1e-3:
            return exact
        low, high = max(sample - 1.0, 0.0), min(sample + 1.0, self._last)
        for _ in range(_ROUNDS):
            places = np.linspace(low, high, _SAMPLES)
            z = self.at(places)
            ratios = self._region.ratios(z)
            best = int(np.argmin(ratios))
            low, high = places[max(best - 1, 0)], places[min(best + 1, _SAMPLES - 1)]
        candidates = [z[best], exact if exact is not None else z[best]]
        return min(candidates, key=lambda at: float(self._region.ratios(at[None])[0]))

    def _descended(self, z: FloatArray) -> FloatArray | None:
        """Gauss-Newton steps along the curve to the least offsets; None if they leave it."""
        for _ in range(_ITERATIONS):
            basis = tangent_basis(equation_gradients(self._system, z[None], self._rows)[0])
            ahead = self._region.step(z, basis)
            found = project(self._system, self._rows, z, basis, (z + ahead)[None])
            if not found.converged[0]:
                break
            z = found.points[0]
            if np.abs(ahead).max() < 1e-12:
                break
        return z if self._lies_on(z) else None

    def _lies_on(self, z: FloatArray) -> bool:
        """Tell whether a configuration of the curve's manifold lies between the curve's ends."""
        place = self._piece.place(z)
        if place in (0.0, self._last):
            return bool(np.abs(self._points[int(place)] - z).max() < SAME)
        return bool(np.abs(self._points - z).max(axis=1).min() < STEP)

    def _border(self, inside: float, outside: float) -> float:
        """The last place within the tolerance on the way from one that is to one that is not."""

        def margin(fractions: FloatArray) -> FloatArray:
            return _INSIDE - self._ratios(inside + fractions * (outside - inside))

        return inside + enclose(margin)[0] * (outside - inside)

    def _inside(self, z: FloatArray) -> FloatArray:
        """Move a configuration away from an end of the curve, within the tolerance."""
        low, high = self.comfortable()
        place = self._piece.place(z)
        if low <= place <= high:
            return z
        towards = low if place < low else high
        places = np.linspace(place, towards, 2 * _SAMPLES)
        inner = self.at(places[1:])
        good = self._region.ratios(inner) <= _USED
        count = len(good) if good.all() else int(np.argmin(good))
        return np.asarray(inner[count - 1]) if count else z


def _leaving(points: FloatArray) -> float:
    """Place where points, shape (s, 3 + n), get comfortably far from the first of them."""
    apart = np.abs(points - points[0]).max(axis=1)
    if not (apart >= COMFORTABLE).any():
        return float(len(points) - 1)
    beyond = int(np.argmax(apart >= COMFORTABLE))
    before, after = apart[beyond - 1], apart[beyond]
    return beyond - 1.0 + float((COMFORTABLE - before) / (after - before))
