"""A sheet: a connected stable region of a contact formation over the plane of two joints.

It is a graph: vertices are configurations over nodes of a grid of joint angles, edges are steps
between neighbouring nodes that keep the contacts and meet nothing. Where a step meets something
there is a border.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.joint_grid import Place
from cfplan_core.planning.pieces import SAME, Piece, Region


@dataclass(frozen=True, eq=False)
class Border:
    """Where a step off a vertex ends, and other contact formations may lie behind.

    Attributes:
        vertex: Index of the vertex.
        points: Shape (s, 3 + n), from the vertex to the border.
        beyond: Node of the grid that the step led to.
        changes_class: True where only the stability class changes.
    """

    vertex: int
    points: FloatArray
    beyond: Place
    changes_class: bool = False

    @property
    def z(self) -> FloatArray:
        """Configuration on the border, shape (3 + n,)."""
        return np.asarray(self.points[-1])


@dataclass(eq=False)
class Sheet(Region):
    """A region over the joint plane that was explored completely, to the grid's spacing.

    Its links lead from a vertex of it to a configuration. One too small to hold a node of the
    grid has its anchor for its only vertex.

    Attributes:
        vertices: Configurations, each of shape (3 + n,).
        places: Node of the grid below each vertex; None below an anchor that is on none.
        edges: For each vertex those next to it, with the configurations between, shape (s, 3 + n).
        borders: Where it ends at something that may lead on.
        losses: Steps that lose stability: vertices, with the joint angles that they lead to.
        straight: Follows the straight path between two configurations inside; None if it leaves.
    """

    vertices: list[FloatArray] = field(default_factory=list)
    places: list[Place | None] = field(default_factory=list)
    edges: list[dict[int, FloatArray]] = field(default_factory=list)
    borders: list[Border] = field(default_factory=list)
    losses: list[tuple[int, FloatArray]] = field(default_factory=list)
    straight: Callable[[FloatArray, FloatArray], FloatArray | None] = lambda start, end: None
    _index_of: dict[bytes, int] = field(default_factory=dict)

    def add(self, z: FloatArray, place: Place | None) -> int:
        """Add a vertex and return its index."""
        self.vertices.append(z)
        self.places.append(place)
        self.edges.append({})
        self._index_of[z.tobytes()] = len(self.vertices) - 1
        return len(self.vertices) - 1

    def index_of(self, z: FloatArray) -> int:
        """Index of the vertex at a configuration, shape (3 + n,)."""
        return self._index_of[z.tobytes()]

    def connect(self, first: int, second: int, between: FloatArray) -> None:
        """Add an edge; the configurations between lead from the first vertex to the second."""
        self.edges[first][second] = between
        self.edges[second][first] = between[::-1]

    def path(self, start: FloatArray, end: FloatArray) -> FloatArray:
        """Points from one linked configuration or vertex to another, shape (s, 3 + n).

        Along the grid, cut short where the straight path stays on the sheet.
        """
        if np.abs(start - end).max() < SAME:
            return start[None]
        back, out = self.link(start), self.link(end)
        first, last = (self._index_of[link[0].tobytes()] for link in (back, out))
        along = self._shortened(self._route(first, last))
        return np.concatenate([back[::-1], along[1:], out[1:]])

    def link(self, z: FloatArray) -> FloatArray:
        """Points that lead from a vertex to a linked configuration, shape (s, 3 + n)."""
        return z[None] if z.tobytes() in self._index_of else super().link(z)

    def _route(self, first: int, last: int) -> list[int]:
        """Vertices of a shortest path over the grid."""
        before = {last: last}
        queue = deque([last])
        while first not in before:
            vertex = queue.popleft()
            for other in self.edges[vertex]:
                if other not in before:
                    before[other] = vertex
                    queue.append(other)
        route = [first]
        while route[-1] != last:
            route.append(before[route[-1]])
        return route

    def _shortened(self, route: list[int]) -> FloatArray:
        """Points along a route, straight from vertex to vertex as far as the sheet allows."""
        parts = [self.vertices[route[0]][None]]
        at, last = 0, len(route) - 1
        while at < last:
            ahead = last
            while ahead > at:
                begin, end = route[at], route[ahead]
                if ahead == at + 1:
                    part: FloatArray | None = np.concatenate(
                        [self.edges[begin][end], self.vertices[end][None]]
                    )
                else:
                    part = self.straight(self.vertices[begin], self.vertices[end])
                if part is not None:
                    parts.append(part)
                    break
                ahead = at + (ahead - at) // 2
            at = ahead
        return np.concatenate(parts)


def configurations(piece: Piece) -> FloatArray:
    """Configurations of a piece that were looked at, shape (s, 3 + n)."""
    return np.array(piece.vertices) if isinstance(piece, Sheet) else piece.points
