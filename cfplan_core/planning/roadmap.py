"""The graph that both CF-trees grow in: pieces of contact formations joined at junctions.

A *piece* is a connected part of one contact formation within one stability class: a point, a
curve, or a region of higher dimension. Curves meet in *junctions*: configurations where a contact
is made or broken, a vertex passes a vertex, or the stability class changes. Pieces are traced when
first asked for and kept, so that both trees see the same piece as the same piece: where both hold
it, they join.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator

import numpy as np

from cfplan_core.contact.formation import Formation
from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import ContactModel, Stability
from cfplan_core.options import RESOLUTION
from cfplan_core.planning.constraints import UNCONSTRAINED, Constraints
from cfplan_core.planning.events import OPEN_EVENTS
from cfplan_core.planning.manifold import (
    formation_equations,
    independent_rows,
    project,
    tangent_basis,
)
from cfplan_core.planning.pieces import SAME, Junction, Piece
from cfplan_core.planning.regions import Regions
from cfplan_core.planning.settling import Settling
from cfplan_core.planning.sheets import Sheets
from cfplan_core.planning.stability_classes import split_by_class
from cfplan_core.planning.tracing import STEP, Trace, Tracer, classify, stability_margins
from cfplan_core.planning.transitions import Departure, Surroundings, departures, surroundings


class Roadmap:
    """Junctions and pieces found so far.

    Attributes:
        pieces: In the order in which they were found.
        failures: Why transitions failed, with how often.
        attempts: How many transitions were tried.
        regions: Pieces of dimension two and more.
        settling: Transitions between stability of first and second order.
    """

    def __init__(
        self,
        system: ContactSystem,
        model: ContactModel,
        checkpoint: Callable[[], None] = lambda: None,
        constraints: Constraints = UNCONSTRAINED,
        resolution: float | None = RESOLUTION,
    ) -> None:
        """Start empty.

        Args:
            system: Compiled problem.
            model: Mechanics.
            checkpoint: Called before every stretch of work; may raise to interrupt.
            constraints: What every configuration must keep, besides stability.
            resolution: Spacing of the grid that regions of hands with two joints are filled over,
                rad; None to explore them along rays, as they are with constraints.
        """
        self.system = system
        self.model = model
        self.constraints = constraints
        self.tracer = Tracer(system, model, checkpoint, constraints.bounds)
        self.pieces: list[Piece] = []
        self.failures: Counter[str] = Counter()
        self.attempts = 0
        self._junctions: list[Junction] = []
        self._cells: dict[tuple[int, ...], list[Junction]] = {}
        self._curves: dict[Formation, list[Piece]] = {}
        self.regions: Regions = (
            Regions(self)
            if resolution is None or system.joint_count != 2
            else Sheets(self, resolution)
        )
        self.settling = Settling(self)

    def formations(self) -> int:
        """Count the distinct contact formations that were met."""
        known = {piece.formation for piece in self.pieces}
        known |= {junction.formation for junction in self._junctions}
        return len(known)

    def root(self, z: FloatArray) -> Piece:
        """Return the piece that a stable configuration, shape (3 + n,), lies inside."""
        junction = self.junction(z)
        if junction.isolated:
            return self._point(junction)
        _, gradients = formation_equations(self.system, junction.formation.array, z)
        basis = tangent_basis(gradients)
        if len(basis) > 1:
            return self.regions.around(junction.formation, z)
        known = self._on_curve(junction.formation, z)
        if known is not None:
            return known
        ahead, behind = (
            self._follow(z, Departure(junction.formation, tangent, frozenset()))
            for tangent in (basis[0], -basis[0])
        )
        points = np.concatenate([behind.points[:0:-1], ahead.points])
        ends = (self._end(behind), self._end(ahead))
        pieces = self._add_curve(junction.formation, points, ends)
        return min(pieces, key=lambda piece: float(np.abs(piece.points - z).max(axis=1).min()))

    def neighbours(self, piece: Piece) -> Iterator[tuple[FloatArray, Piece]]:
        """Points and curves next to a piece, each with the configuration that lies between."""
        if piece.dimension > 1:
            yield from self.regions.beyond(piece)
        for junction in dict.fromkeys(piece.ends):
            if junction is None:
                continue
            if junction.isolated and piece.dimension > 0:
                yield junction.z, self._point(junction)
                continue
            for taken in self._behind(junction):
                if taken is not None and taken is not piece:
                    yield junction.z, taken

    def junction(self, z: FloatArray) -> Junction:
        """Return the junction at a configuration, shape (3 + n,), making it if it is new."""
        cells = self._cells_around(z)
        for cell in cells:
            for junction in self._cells.get(cell, ()):
                if np.abs(junction.z - z).max() < SAME:
                    return junction
        around = surroundings(self.system, z)
        refusal = self.constraints.refusal(around.pairs, around.together)
        if refusal is not None:
            self.failures[refusal] += 1
            return self._remember(self._refused(z, around), cells)
        stability = Stability.UNSTABLE
        if len(around.pairs) and not around.held_vertex:
            stability = classify(
                stability_margins(
                    self.system, self.model, z[None], around.gradients[None], around.pairs
                )
            )
        isolated = (
            stability is not Stability.UNSTABLE
            and len(independent_rows(around.gradients)) == self.system.dof
        )
        formation = Formation(tuple(int(pair) for pair in around.pairs))
        return self._remember(Junction(z, formation, stability, isolated, around), cells)

    @staticmethod
    def _refused(z: FloatArray, around: Surroundings) -> Junction:
        """Make a junction that nothing leads through."""
        formation = Formation(tuple(int(pair) for pair in around.pairs))
        return Junction(z, formation, Stability.UNSTABLE, False, None, ways=[])

    def _remember(self, junction: Junction, cells: list[tuple[int, ...]]) -> Junction:
        self._junctions.append(junction)
        for cell in cells:
            self._cells.setdefault(cell, []).append(junction)
        return junction

    @staticmethod
    def _cells_around(z: FloatArray) -> list[tuple[int, ...]]:
        """Cells of a grid, four times `SAME` wide, that a neighbourhood of z reaches into."""
        low = np.floor((z - SAME) / (4.0 * SAME)).astype(int)
        high = np.floor((z + SAME) / (4.0 * SAME)).astype(int)
        cells: list[tuple[int, ...]] = [()]
        for first, last in zip(low, high, strict=True):
            choices = (int(first),) if first == last else (int(first), int(last))
            cells = [(*cell, choice) for cell in cells for choice in choices]
        return cells

    def _point(self, junction: Junction) -> Piece:
        if junction.point is None:
            junction.point = Piece(
                len(self.pieces),
                junction.formation,
                junction.stability,
                0,
                junction.z[None],
                (junction,),
            )
            self.pieces.append(junction.point)
        return junction.point

    def _ways(self, junction: Junction) -> list[Departure]:
        if junction.ways is None:
            assert junction.around is not None
            refused = self.failures.total()
            junction.ways = departures(junction.around, self.model, self.failures)
            self.attempts += self.failures.total() - refused
        return junction.ways

    def _behind(self, junction: Junction) -> Iterator[Piece | None]:
        """Pieces that the ways out of a junction lead to; None for those that end at once."""
        if junction.around is None:
            yield from junction.taken.values()
            return
        for way, departure in enumerate(self._ways(junction)):
            if way not in junction.taken:
                self._trace(junction, way, departure)
            yield junction.taken[way]

    def _trace(self, junction: Junction, way: int, departure: Departure) -> None:
        """Follow a way out of a junction."""
        self.attempts += 1
        junction.taken[way] = None
        known = self.curve_along(junction.z, departure)
        if known is not None:
            junction.taken[way] = known

    def curve_along(self, z: FloatArray, departure: Departure) -> Piece | None:
        """Return the curve that a way out of a junction leads to; None if it ends at once.

        Args:
            z: Of the junction, shape (3 + n,).
            departure: The way, into a formation of dimension one.
        """
        trace = self._follow(z, departure)
        if np.abs(trace.end - z).max() < SAME:
            self.failures[f'at once, {trace.why}'] += 1
            return None
        known = self._on_curve(departure.formation, trace.points[1])
        if known is not None:
            return known
        ends = (self.junction(z), self._end(trace))
        return self._add_curve(departure.formation, trace.points, ends)[0]

    def _follow(self, z: FloatArray, departure: Departure) -> Trace:
        heading = departure.direction

        def steer(_: FloatArray, basis: FloatArray) -> FloatArray:
            nonlocal heading
            heading = np.asarray(np.copysign(1.0, basis[0] @ heading) * basis[0])
            return heading

        return self.tracer.follow(departure.formation, z, steer, departure.departing)

    def _end(self, trace: Trace) -> Junction | None:
        if trace.kind in OPEN_EVENTS:
            return self.junction(trace.end)
        self.failures[trace.why] += 1
        return None

    def _add_curve(
        self,
        formation: Formation,
        points: FloatArray,
        ends: tuple[Junction | None, Junction | None],
    ) -> list[Piece]:
        """Add the pieces of a curve, one after the other, one for each stability class."""
        parts = split_by_class(self.tracer, formation, points)
        inner = [
            Junction(part[-1], formation, Stability.FORM_CLOSURE, False, None)
            for _, part in parts[:-1]
        ]
        borders = [ends[0], *inner, ends[1]]
        pieces = []
        for number, (stability, part) in enumerate(parts):
            between = (borders[number], borders[number + 1])
            piece = Piece(len(self.pieces), formation, stability, 1, part, between)
            self.pieces.append(piece)
            pieces.append(piece)
        self._curves.setdefault(formation, []).extend(pieces)
        for junction, before, after in zip(inner, pieces[:-1], pieces[1:], strict=True):
            junction.taken = {0: before, 1: after}
        self._register(ends[0], formation, points[1], pieces[0])
        self._register(ends[1], formation, points[-2], pieces[-1])
        return pieces

    def _register(
        self, junction: Junction | None, formation: Formation, z: FloatArray, piece: Piece
    ) -> None:
        """Note at the end of a curve that the way towards its neighbour z is taken."""
        if junction is None:
            return
        for way, departure in enumerate(self._ways(junction)):
            leads = float((z - junction.z) @ departure.direction) > 0.0
            if departure.formation == formation and leads:
                junction.taken[way] = piece

    def _on_curve(self, formation: Formation, z: FloatArray) -> Piece | None:
        """Find the known curve of a formation that a configuration lies on."""
        for piece in self._curves.get(formation, ()):
            near = np.abs(piece.points - z).max(axis=1)
            if near.min() > 2.0 * STEP:
                continue
            rows, gradients = formation_equations(self.system, formation.array, z)
            basis = tangent_basis(gradients)
            along = (piece.points - z) @ basis[0]
            crossing = np.flatnonzero((along[:-1] * along[1:] <= 0.0) & (near[:-1] < 3.0 * STEP))
            for i in crossing:
                span = along[i + 1] - along[i]
                fraction = -along[i] / span if span else 0.0
                guess = piece.points[i] + fraction * (piece.points[i + 1] - piece.points[i])
                found = project(self.system, rows, z, basis, guess[None])
                if found.converged[0] and np.abs(found.points[0] - z).max() < SAME:
                    return piece
        return None
