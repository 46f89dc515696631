"""The best plan among everything that can be reached by a hand of one or two joints."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.options import Preference
from cfplan_core.planning.goal_test import GoalTest
from cfplan_core.planning.mesh import Motion, build_mesh, reachable
from cfplan_core.planning.mesh_margins import MeshMargins
from cfplan_core.planning.mesh_search import MeshSearch, Way
from cfplan_core.planning.pieces import Piece
from cfplan_core.planning.roadmap import Roadmap
from cfplan_core.planning.robustness import Robustness
from cfplan_core.planning.search import Leg
from cfplan_core.planning.straightening import legs_of, straightened
from cfplan_core.planning.ways import joint_length

# The largest margin is found within this part of it.
PRECISION = 0.01
# Where a way does not keep its floor others are tried, each smaller by this factor.
_SMALLER = 0.8
_FLOORS = 8


@dataclass(frozen=True, eq=False)
class Best:
    """What was chosen.

    Attributes:
        legs: From start to goal.
        way: Through the mesh that they were made of; None for a path that was known.
        bound: No way through the mesh has a larger margin; None if this was not asked.
    """

    legs: list[Leg]
    way: Way | None = None
    bound: float | None = None


class BestOnMesh:
    """Searches everything that can be reached for the best plan.

    Attributes:
        pieces: All that can be reached.
    """

    def __init__(
        self,
        roadmap: Roadmap,
        start: FloatArray,
        goal: FloatArray | GoalTest,
        robustness: Robustness,
        expanded: Callable[[FloatArray], FloatArray],
        met: Callable[[int], None] = lambda count: None,
    ) -> None:
        """Explore.

        Args:
            roadmap: Of one or two joints, two of them with sheets.
            start: Stable configuration, shape (3 + n,).
            goal: Stable configuration, shape (3 + n,), or a test that finds one on a piece.
            robustness: Measures margins.
            expanded: Turns configurations, shape (s, 3 + n), into those with all joints.
            met: Called with the number of pieces before one is added; may raise.
        """
        self._roadmap = roadmap
        self._robustness = robustness
        self._expanded = expanded
        self.pieces, crossings = reachable(roadmap, roadmap.root(start), met)
        ends = [(self.pieces[0], start), *self._goals(start, goal)]
        checkpoint = roadmap.tracer.checkpoint
        mesh, (first, *arrivals) = build_mesh(self.pieces, crossings, ends, checkpoint)
        self._mesh = mesh
        self._search = MeshSearch(mesh, first, arrivals, roadmap.constraints, checkpoint)
        self._margins: MeshMargins | None = None

    def _goals(
        self, start: FloatArray, goal: FloatArray | GoalTest
    ) -> list[tuple[Piece, FloatArray]]:
        """Where the goal is reached: on pieces, with the configuration."""
        if not isinstance(goal, GoalTest):
            piece = self._roadmap.root(goal)
            return [(piece, goal)] if piece in self.pieces else []
        found = []
        for piece in self.pieces:
            if piece is self.pieces[0] and goal.may_hold(piece) and goal.fits(start):
                found.append((piece, start))
            found += [(piece, z) for z in goal.everywhere(piece, self._roadmap.regions)]
        return found

    def margin(self, legs: Sequence[Leg]) -> float:
        """Margin of a path."""
        return self._robustness.margin(
            [(leg.formation, self._expanded(leg.points)) for leg in legs]
        )

    def choose(
        self,
        prefer: Preference,
        known: Sequence[Leg] | None,
        refused: Callable[[list[Leg]], list[int]],
    ) -> Best | None:
        """Find the best path that can be held.

        Args:
            prefer: What is best; the first plan there is means fewest segments.
            known: A path that is known, from the same roadmap; it is chosen if none is better.
            refused: Tells which legs of a path cannot be held, by index. These are left out.
        """
        if prefer is Preference.FIRST:
            prefer = Preference.FEWEST_SEGMENTS
        if prefer is Preference.SHORTEST:
            self._mesh.add_diagonals()
        while True:
            best = self._best(prefer, known)
            if best is None:
                return None
            weak = [] if best.way is None else refused(best.legs)
            if not weak:
                return best
            assert best.way is not None
            self._leave_out(best.way, {best.legs[k].piece for k in weak}, refused)

    def _best(self, prefer: Preference, known: Sequence[Leg] | None) -> Best | None:
        """The best path without what is left out."""
        if prefer is Preference.ROBUST:
            return self._widest(known)
        way = self._search.shortest(prefer)
        if way is None:
            return None if known is None else Best(list(known))
        legs = straightened(self._roadmap, legs_of(self._mesh, way))
        if known is not None and _cost(prefer, known) <= _cost(prefer, legs):
            return Best(list(known))
        return Best(legs, way)

    def _widest(self, known: Sequence[Leg] | None) -> Best | None:
        """The path of the largest margin; the shortest of them, up to the precision."""
        if self._margins is None:
            self._margins = MeshMargins(
                self._mesh, self._robustness, self._expanded, self._roadmap.tracer.checkpoint
            )
        low = 0.0 if known is None else self.margin(known)
        floor, bound = self._search.widest(self._margins, low, PRECISION)
        way, legs, margin = None, None, 0.0
        for _ in range(_FLOORS):
            # A way on which features come nearer than they are at the start may have a smaller
            # margin than its floor: then one of a smaller floor may have a larger one.
            found = self._search.shortest(floor=floor, margins=self._margins)
            if found is None:
                break
            made, measured = self._made(found, floor)
            if way is None or measured > margin:
                way, legs, margin = found, made, measured
            if floor <= max(low, margin) * (1.0 + 2.0 * PRECISION) or not np.isfinite(floor):
                break
            floor *= _SMALLER
        if way is None or legs is None:
            return None if known is None else Best(list(known), bound=max(low, bound))
        if not np.isfinite(bound):
            # Nothing moves: every plan has the margin of the start at most.
            bound = margin
        if known is not None and low >= margin:
            return Best(list(known), bound=max(low, bound))
        return Best(legs, way, max(margin, bound))

    def _made(self, way: Way, floor: float) -> tuple[list[Leg], float]:
        """A way as legs, straight where that keeps a floor, and their margin."""
        legs = legs_of(self._mesh, way)
        straight = straightened(self._roadmap, legs, lambda leg: self._keeps(leg, floor))
        margins = self.margin(straight), self.margin(legs)
        if min(margins[0], floor) >= min(margins[1], floor):
            return straight, margins[0]
        return legs, margins[1]

    def _keeps(self, leg: Leg, floor: float) -> bool:
        return self._robustness.width(leg.formation, self._expanded(leg.points)) >= floor

    def _leave_out(
        self, way: Way, pieces: set[int], refused: Callable[[list[Leg]], list[int]]
    ) -> None:
        """Leave out all motions on some pieces that cannot be held, at least one of a way."""
        motions = [
            motion
            for motion in self._mesh.motions
            if motion.piece is not None and motion.piece.index in pieces
        ]
        weak = {motions[k] for k in refused([_leg(motion) for motion in motions])}
        if not weak.intersection(way.motions):
            weak.update(motion for motion in motions if motion in way.motions)
        self._search.banned |= weak


def _leg(motion: Motion) -> Leg:
    piece = motion.piece
    assert piece is not None
    return Leg(piece.index, piece.formation, piece.stability, motion.points)


def _cost(prefer: Preference, legs: Sequence[Leg]) -> tuple[float, float]:
    length = sum(joint_length(leg.points) for leg in legs)
    moves = float(sum(joint_length(leg.points) > 0.0 for leg in legs))
    return (length, moves) if prefer is Preference.SHORTEST else (moves, length)
