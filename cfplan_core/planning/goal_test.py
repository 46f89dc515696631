"""Where a piece fulfils a goal that is not a whole grasp."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from cfplan_core.contact.system import ContactSystem, IntArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.model import Goal
from cfplan_core.planning.goal_curves import CurveGoal
from cfplan_core.planning.goal_drives import lies_inside
from cfplan_core.planning.goal_region import GoalRegion
from cfplan_core.planning.pieces import Piece, Region
from cfplan_core.planning.sheet_graph import configurations

if TYPE_CHECKING:
    from cfplan_core.planning.regions import Regions


class GoalTest:
    """Looks for a goal's coordinates and contacts on pieces.

    Attributes:
        region: The configurations that fulfil the goal.
        nearest: Of all configurations looked at that have the goal's contacts, the one nearest to
            its coordinates, shape (3 + n,), None if there was none.
    """

    def __init__(self, system: ContactSystem, goal: Goal) -> None:
        """Compile a goal; see `GoalRegion`.

        Raises:
            CfplanError: The goal names what the problem does not have.
        """
        self._system = system
        self.region = GoalRegion(system, goal)
        self.nearest: FloatArray | None = None
        self._least = np.inf

    def __call__(self, piece: Piece) -> FloatArray | None:
        """Return the configuration of a point or a curve, shape (3 + n,), nearest to the goal.

        None if no configuration fulfils it. Of a region only the anchor is looked at.
        """
        if not self.may_hold(piece):
            return None
        self._note(piece.points)
        if piece.dimension != 1 or not self.region.count:
            z = np.asarray(piece.points[len(piece.points) // 2])
            return z if self.fits(z) else None
        return CurveGoal(self._system, self.region, piece).nearest()

    def first(self, piece: Piece, regions: Regions, entry: FloatArray) -> FloatArray | None:
        """Return a configuration of a piece of any dimension that fulfils the goal, if any.

        Args:
            piece: To look at.
            regions: Know how to move in regions.
            entry: Where the piece is entered, shape (3 + n,).
        """
        if not isinstance(piece, Region):
            return self(piece)
        return next(self._in_region(piece, regions, entry), None)

    def all(self, piece: Piece, regions: Regions, entry: FloatArray) -> Iterator[FloatArray]:
        """Configurations of a piece that the best way to the goal may end at.

        On a curve the nearest to its entry of every stretch that fulfils the goal. A goal with
        contacts is fulfilled where they are held, not just made: a little inside the piece.

        Args:
            piece: To look at.
            regions: Know how to move in regions.
            entry: Where the piece is entered, shape (3 + n,).
        """
        if not self.may_hold(piece):
            return
        if isinstance(piece, Region):
            if self.fits(entry) and not self.region.pairs:
                yield entry
            yield from self._in_region(piece, regions, entry)
            return
        self._note(piece.points)
        if piece.dimension == 0:
            if self.fits(piece.points[0]):
                yield np.asarray(piece.points[0])
            return
        curve = CurveGoal(self._system, self.region, piece)
        begin = piece.place(entry)
        held = not self.region.pairs or 0.0 < begin < len(piece.points) - 1.0
        if held and self.fits(entry):
            yield entry
            return
        for stretch in self._inner_stretches(curve):
            z = curve.snapped(curve.at(np.clip([begin], *stretch))[0])
            if self.fits(z):
                yield z

    def everywhere(self, piece: Piece, regions: Regions) -> Iterator[FloatArray]:
        """Configurations all over where a piece fulfils the goal, in a curve's and grid's steps.

        Args:
            piece: To look at.
            regions: Know how to move in regions.
        """
        if not self.may_hold(piece):
            return
        if isinstance(piece, Region):
            yield from self._in_region(piece, regions, None)
            return
        self._note(piece.points)
        if piece.dimension == 0:
            yield from (z for z in piece.points if self.fits(z))
            return
        curve = CurveGoal(self._system, self.region, piece)
        for low, high in self._inner_stretches(curve):
            between = np.arange(np.floor(low) + 1.0, np.ceil(high))
            places = np.concatenate([[low], between, [high] if high > low else []])
            yield from (z for z in map(curve.snapped, curve.at(places)) if self.fits(z))

    def _inner_stretches(self, curve: CurveGoal) -> Iterator[tuple[float, float]]:
        """Stretches of a curve that fulfil the goal, with contacts away from the curve's ends."""
        least, most = curve.comfortable() if self.region.pairs else (0.0, np.inf)
        for low, high in curve.stretches():
            inner = float(np.clip(low, least, most)), float(np.clip(high, least, most))
            yield inner if low <= inner[0] <= inner[1] <= high else (low, high)

    def may_hold(self, piece: Piece) -> bool:
        """Tell whether a piece has the contacts wanted."""
        return self.has_contacts(piece.formation.pairs)

    def has_contacts(self, pairs: Iterable[int]) -> bool:
        """Tell whether contacts that touch are those wanted."""
        return self.region.holds(pairs)

    def missing(self, pairs: IntArray) -> list[int]:
        """List the contacts wanted that are not among pairs, shape (k,)."""
        return sorted(self.region.pairs - set(pairs.tolist()))

    def fits(self, z: FloatArray) -> bool:
        """Tell whether a configuration has the coordinates wanted, within their tolerances."""
        return self.region.fits(z)

    def how_near(self) -> str:
        """Say, for an answer that there is no path, how near to the goal what was looked at comes.

        Empty if the goal gives contacts alone.
        """
        if not self.region.count:
            return ''
        if self.nearest is None:
            return '; no contact formation found has the contacts of the goal'
        return f'; nearest to the goal: {self.region.describe(self.nearest)}'

    def _in_region(
        self, piece: Region, regions: Regions, entry: FloatArray | None
    ) -> Iterator[FloatArray]:
        if self.may_hold(piece):
            self._note(configurations(piece))
            for z in regions.reach(piece, self.region, entry):
                if self.fits(z) and lies_inside(self._system, piece, z):
                    yield z

    def _note(self, z: FloatArray) -> None:
        """Remember the configuration that is nearest to the goal."""
        ratios = self.region.ratios(z)
        best = int(np.argmin(ratios))
        if ratios[best] < self._least:
            self._least, self.nearest = float(ratios[best]), z[best]
