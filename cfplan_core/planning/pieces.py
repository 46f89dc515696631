"""Pieces of contact formations and the junctions where they meet."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from cfplan_core.contact.formation import Formation
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import Stability
from cfplan_core.planning.transitions import Departure, Surroundings

# Configurations nearer than this, in radians and object sizes, are the same.
SAME = 1e-6


@dataclass(eq=False)
class Junction:
    """A configuration where pieces meet.

    Attributes:
        z: Shape (3 + n,).
        formation: All contacts that touch.
        stability: Of that formation; `UNSTABLE` if a vertex lies on a vertex.
        isolated: True if that formation is a piece of its own: a point, stable.
        around: What touches there; None where only the stability class changes.
        ways: Ways out, found when first asked for.
        taken: Piece behind each way out that was taken, None where it led nowhere.
        point: The piece, if isolated and asked for.
    """

    z: FloatArray
    formation: Formation
    stability: Stability
    isolated: bool
    around: Surroundings | None
    ways: list[Departure] | None = None
    taken: dict[int, Piece | None] = field(default_factory=dict)
    point: Piece | None = None


@dataclass(eq=False)
class Piece:
    """A connected part of a contact formation within one stability class: a point or a curve.

    Attributes:
        index: Position in the roadmap.
        formation: The contacts.
        stability: The class.
        dimension: 0 for a point, 1 for a curve.
        points: Shape (s, 3 + n), along the curve.
        ends: Junctions at the first and last point, None at a dead end.
    """

    index: int
    formation: Formation
    stability: Stability
    dimension: int
    points: FloatArray
    ends: tuple[Junction | None, ...]

    def path(self, start: FloatArray, end: FloatArray) -> FloatArray:
        """Points from one configuration on the piece to another, shape (s, 3 + n)."""
        if self.dimension == 0:
            return start[None]
        a, b = self.place(start), self.place(end)
        low, high = min(a, b), max(a, b)
        between = self.points[int(np.floor(low)) + 1 : int(np.ceil(high))]
        if b < a:
            between = between[::-1]
        return np.concatenate([start[None], between, end[None]])

    def place(self, z: FloatArray) -> float:
        """Tell where a configuration lies on the curve: an index of `points`, or between two."""
        for place, end in ((0, self.points[0]), (len(self.points) - 1, self.points[-1])):
            if np.abs(end - z).max() < SAME:
                return float(place)
        chord = np.diff(self.points, axis=0)
        length = (chord**2).sum(axis=1)
        fraction = ((z - self.points[:-1]) * chord).sum(axis=1) / np.where(length > 0, length, 1)
        fraction = np.clip(fraction, 0.0, 1.0)
        near = self.points[:-1] + fraction[:, None] * chord
        interval = int(np.argmin(np.abs(near - z).max(axis=1)))
        return interval + float(fraction[interval])


@dataclass(eq=False)
class Region(Piece):
    """A connected part of a contact formation of dimension two or more.

    Its only point is its anchor, from which it is explored.

    Attributes:
        links: Configurations on the region's border or inside, each with the points that lead to
            it from the anchor, shape (s, 3 + n).
    """

    links: list[tuple[FloatArray, FloatArray]] = field(default_factory=list)

    @property
    def anchor(self) -> FloatArray:
        """Shape (3 + n,)."""
        return np.asarray(self.points[0])

    def path(self, start: FloatArray, end: FloatArray) -> FloatArray:
        """Points from one linked configuration over the anchor to another."""
        back, out = self.link(start), self.link(end)
        return np.concatenate([back[::-1], out[1:]])

    def link(self, z: FloatArray) -> FloatArray:
        """Points that lead to a linked configuration, shape (s, 3 + n)."""
        return min(self.links, key=lambda link: float(np.abs(link[0] - z).max()))[1]
