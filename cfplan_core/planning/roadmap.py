"""The graph that both CF-trees grow in: junctions joined by pieces of contact formations.

A *piece* is a connected part of one contact formation within one stability class. Pieces meet in
*junctions*: configurations where a contact is made or broken, a vertex passes a vertex, or the
stability class changes. Pieces are traced when first asked for and kept, so that the trees see
the same piece as the same piece: where both hold it, they join.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from cfplan_core.contact.formation import Formation
from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import ContactModel, Stability
from cfplan_core.planning.events import OPEN_EVENTS, EventKind
from cfplan_core.planning.manifold import independent_rows, tangent_basis
from cfplan_core.planning.tracing import Trace, Tracer, classify
from cfplan_core.planning.transitions import Departure, Surroundings, departures, surroundings

# Junctions nearer than this, in radians and object sizes, are the same.
SAME = 1e-6


@dataclass(eq=False)
class Junction:
    """A configuration where pieces meet.

    Attributes:
        index: Position in the roadmap.
        around: What touches there.
        dimension: Of the formation of all touching contacts; zero for a point.
        stability: Of that formation; `UNSTABLE` if a vertex lies on a vertex.
        ways: Ways out, found when first asked for.
        pieces: Piece for each way out that was taken, None where it led nowhere.
    """

    index: int
    around: Surroundings
    formation: Formation
    dimension: int
    stability: Stability
    ways: list[Departure] | None = None
    pieces: dict[int, Piece | None] = field(default_factory=dict)

    @property
    def z(self) -> FloatArray:
        """Configuration, shape (3 + n,)."""
        return self.around.z


@dataclass(eq=False)
class Piece:
    """A connected part of a contact formation within one stability class.

    Attributes:
        index: Position in the roadmap.
        formation: The contacts.
        stability: The class.
        points: Shape (s, 3 + n), along the curve.
        ends: Junctions at the first and last point, None at a dead end.
    """

    index: int
    formation: Formation
    stability: Stability
    points: FloatArray
    ends: tuple[Junction | None, Junction | None]


class Roadmap:
    """Junctions and pieces found so far.

    Attributes:
        failures: Why transitions failed, with how often.
        attempts: How many transitions were tried.
    """

    def __init__(self, system: ContactSystem, model: ContactModel) -> None:
        self.system = system
        self.model = model
        self.tracer = Tracer(system, model)
        self.junctions: list[Junction] = []
        self.pieces: list[Piece] = []
        self.failures: Counter[str] = Counter()
        self.attempts = 0
        self._nearby: dict[tuple[int, ...], list[Junction]] = {}

    def formations(self) -> int:
        """Count the distinct contact formations met."""
        return len({p.formation for p in self.pieces} | {j.formation for j in self.junctions})

    def junction(self, z: FloatArray) -> Junction:
        """Return the junction at a configuration, shape (3 + n,), making it if it is new."""
        cell = np.round(z / (4.0 * SAME)).astype(int)
        low = np.floor((z - SAME) / (4.0 * SAME) + 0.5).astype(int)
        high = np.floor((z + SAME) / (4.0 * SAME) + 0.5).astype(int)
        keys = {tuple(int(c) for c in cell)}
        if (low != high).any():
            keys |= {tuple(int(c) for c in low), tuple(int(c) for c in high)}
        for key in sorted(keys):
            for junction in self._nearby.get(key, ()):
                if np.abs(junction.z - z).max() < SAME:
                    return junction
        around = surroundings(self.system, z)
        formation = Formation(tuple(int(p) for p in around.pairs))
        dimension = self.system.dof - len(independent_rows(around.gradients))
        stability = Stability.UNSTABLE
        if not around.held_vertex and len(around.pairs):
            stability = classify(self.model.margins(around.gradients[None]))
        junction = Junction(len(self.junctions), around, formation, dimension, stability)
        self.junctions.append(junction)
        for key in sorted(keys):
            self._nearby.setdefault(key, []).append(junction)
        return junction

    def ways(self, junction: Junction) -> list[Departure]:
        """Ways out of a junction."""
        if junction.ways is None:
            junction.ways = departures(
                junction.around, self.model, self.system.dof, self.failures
            )
            self.attempts += len(junction.ways)
        return junction.ways

    def take(self, junction: Junction, way: int) -> Piece | None:
        """Follow one way out of a junction; None if it ends at once."""
        if way not in junction.pieces:
            departure = self.ways(junction)[way]
            trace = self._follow(departure.formation, junction.z, departure)
            if np.abs(trace.end - junction.z).max() < SAME:
                junction.pieces[way] = None
                self.failures[f'at once {trace.kind.value}'] += 1
            else:
                self._add_piece(departure.formation, trace.points, (junction, self._end(trace)))
        return junction.pieces[way]

    def through(self, z: FloatArray, formation: Formation) -> Piece:
        """Trace the piece of a one-dimensional formation through a point inside it."""
        junction = self.junction(z)
        gradients = junction.around.gradients
        tangent = tangent_basis(gradients[list(independent_rows(gradients))])[0]
        halves = [
            self._follow(formation, z, Departure(formation, sign * tangent, frozenset()))
            for sign in (1.0, -1.0)
        ]
        points = np.concatenate([halves[1].points[:0:-1], halves[0].points])
        return self._add_piece(formation, points, (self._end(halves[1]), self._end(halves[0])))

    def _follow(self, formation: Formation, z: FloatArray, departure: Departure) -> Trace:
        heading = departure.direction

        def steer(_: FloatArray, basis: FloatArray) -> FloatArray:
            nonlocal heading
            heading = basis[0] if basis[0] @ heading > 0.0 else -basis[0]
            return heading

        return self.tracer.follow(formation, z, steer, departure.departing)

    def _end(self, trace: Trace) -> Junction | None:
        if trace.kind in OPEN_EVENTS:
            return self.junction(trace.end)
        self.failures[trace.kind.value] += 1
        return None

    def _add_piece(
        self,
        formation: Formation,
        points: FloatArray,
        ends: tuple[Junction | None, Junction | None],
    ) -> Piece:
        middle = points[len(points) // 2][None]
        stability = classify(self.tracer.margins(formation, middle))
        piece = Piece(len(self.pieces), formation, stability, points, ends)
        self.pieces.append(piece)
        for junction, z in zip(ends, (points[1], points[-2]), strict=True):
            if junction is None:
                continue
            for way, departure in enumerate(self.ways(junction)):
                leads = (z - junction.z) @ departure.direction > 0.0
                if departure.formation == formation and leads:
                    junction.pieces[way] = piece
        return piece
