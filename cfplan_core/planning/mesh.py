"""Everything that can be reached as one graph of configurations, for hands of one and two joints.

Its nodes are the points of curves, the vertices of sheets and the places where one piece leads to
another; its edges are motions between neighbouring ones inside a piece, and steps of no length
from piece to piece. What holds of all paths through it holds of all plans, at the resolution of
the sheets' grid.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.pieces import SAME, Piece, Region
from cfplan_core.planning.roadmap import Roadmap
from cfplan_core.planning.sheet_graph import Sheet
from cfplan_core.planning.ways import joint_length

# Sides of a cell whose steps have a smaller product, rad², make a right angle.
_SQUARE = 1e-12


@dataclass(frozen=True, eq=False)
class Motion:
    """An edge of a mesh.

    Attributes:
        first: Node that it leads from.
        second: Node that it leads to; it is an edge in both directions.
        piece: Inside which it is; None from piece to piece.
        points: Shape (s, 3 + n), from first to second.
        length: Of the joints' path, rad; of the straight one over the corner of a sheet's cell.
    """

    first: int
    second: int
    piece: Piece | None
    points: FloatArray
    length: float

    def towards(self, node: int) -> FloatArray:
        """Points in the order that ends at one of its nodes."""
        return self.points if node == self.second else self.points[::-1]


@dataclass(eq=False)
class Mesh:
    """A graph of configurations.

    Attributes:
        z: Configuration of each node, shape (3 + n,).
        pieces: Piece of each node.
        motions: All edges.
        around: For each node the motions that begin or end there, with the other node.
    """

    z: list[FloatArray] = field(default_factory=list)
    pieces: list[Piece] = field(default_factory=list)
    motions: list[Motion] = field(default_factory=list)
    around: list[list[tuple[int, Motion]]] = field(default_factory=list)

    def add(self, piece: Piece, z: FloatArray) -> int:
        """Add a node and return its index."""
        self.z.append(z)
        self.pieces.append(piece)
        self.around.append([])
        return len(self.z) - 1

    def connect(self, first: int, second: int, piece: Piece | None, points: FloatArray) -> None:
        """Add an edge."""
        self._add(Motion(first, second, piece, points, joint_length(points)))

    def add_diagonals(self) -> None:
        """Add motions over two sides of a sheet's cell that count as straight.

        Without them a way over the grid is up to 1.41 times as long as the straight one, and with
        them 1.08 times.
        """
        known = {(motion.first, motion.second) for motion in self.motions}
        diagonals = []
        for node, piece in enumerate(self.pieces):
            if not isinstance(piece, Sheet):
                continue
            sides = [(u, motion) for u, motion in self.around[node] if motion.piece is piece]
            for corner, side in sides:
                for other, next_side in self.around[corner]:
                    if next_side.piece is not piece or other <= node or (node, other) in known:
                        continue
                    one, two = self.z[corner] - self.z[node], self.z[other] - self.z[corner]
                    if abs(float(one[3:] @ two[3:])) > _SQUARE:
                        continue
                    known.add((node, other))
                    points = np.concatenate([side.towards(corner), next_side.towards(other)[1:]])
                    straight = float(np.linalg.norm(one[3:] + two[3:]))
                    diagonals.append(Motion(node, other, piece, points, straight))
        for motion in diagonals:
            self._add(motion)

    def _add(self, motion: Motion) -> None:
        first, second = motion.first, motion.second
        self.motions.append(motion)
        self.around[first].append((second, motion))
        if second != first:
            self.around[second].append((first, motion))


# A place where one piece leads to another: both and the configuration, shape (3 + n,).
Crossing = tuple[Piece, FloatArray, Piece]


def reachable(
    roadmap: Roadmap, start: Piece, met: Callable[[int], None] = lambda count: None
) -> tuple[list[Piece], list[Crossing]]:
    """Find all pieces that can be reached from one, breadth first, and what leads from each on.

    Args:
        roadmap: Explored on the way.
        start: Its first piece.
        met: Called with the number of pieces before one is added; may raise.
    """
    pieces, crossings = [start], []
    known = {start.index}
    for piece in pieces:
        beside = [*roadmap.regions.beside(piece), *roadmap.settling.beside(piece)]
        for z, other in [*roadmap.neighbours(piece), *beside]:
            crossings.append((piece, z, other))
            if other.index not in known:
                met(len(pieces))
                known.add(other.index)
                pieces.append(other)
    return pieces, crossings


def build_mesh(
    pieces: Sequence[Piece],
    crossings: Sequence[Crossing],
    ends: Sequence[tuple[Piece, FloatArray]],
    checkpoint: Callable[[], None] = lambda: None,
) -> tuple[Mesh, list[int]]:
    """Turn pieces into a mesh.

    Args:
        pieces: All of them.
        crossings: From each of them to each.
        ends: Configurations on pieces, linked to them, that shall be nodes, too.
        checkpoint: Called on the way; may raise.

    Returns:
        The mesh, and the nodes of the ends.
    """
    meshing = _Meshing(pieces)
    joined: set[tuple[int, int]] = set()
    for piece, z, other in crossings:
        checkpoint()
        first, second = meshing.node(piece, z), meshing.node(other, z)
        if first != second and (first, second) not in joined:
            joined |= {(first, second), (second, first)}
            meshing.mesh.connect(first, second, None, z[None])
    nodes = [meshing.node(piece, z) for piece, z in ends]
    for piece in pieces:
        meshing.string(piece)
    return meshing.mesh, nodes


class _Meshing:
    """A mesh that grows."""

    def __init__(self, pieces: Sequence[Piece]) -> None:
        self.mesh = Mesh()
        self._stations: dict[tuple[int, bytes], int] = {}
        self._curves: dict[int, list[tuple[float, int]]] = {}
        self._sheets: dict[int, tuple[int, dict[bytes, FloatArray]]] = {}
        for piece in pieces:
            if isinstance(piece, Sheet):
                self._lay_sheet(piece)
            elif not isinstance(piece, Region):
                self._curves[piece.index] = [
                    (float(k), self._station(piece, z)) for k, z in enumerate(piece.points)
                ]

    def node(self, piece: Piece, z: FloatArray) -> int:
        """Node at a configuration, shape (3 + n,), on a piece, linked to it; made if it is new."""
        known = self._stations.get((piece.index, _key(z)))
        if known is not None:
            return known
        node = self._station(piece, z)
        if isinstance(piece, Sheet):
            base, links = self._sheets[piece.index]
            points = links.get(z.tobytes())
            points = piece.link(z) if points is None else points
            vertex = base + piece.index_of(points[0])
            self.mesh.connect(vertex, node, piece, points)
        elif not isinstance(piece, Region):
            self._curves[piece.index].append((piece.place(z), node))
        return node

    def _station(self, piece: Piece, z: FloatArray) -> int:
        node = self.mesh.add(piece, z)
        self._stations.setdefault((piece.index, _key(z)), node)
        return node

    def _lay_sheet(self, sheet: Sheet) -> None:
        base = len(self.mesh.z)
        for z in sheet.vertices:
            self._station(sheet, z)
        for first, beside in enumerate(sheet.edges):
            for second, between in beside.items():
                if first < second:
                    ends = sheet.vertices[first][None], sheet.vertices[second][None]
                    points = np.concatenate([ends[0], between, ends[1]])
                    self.mesh.connect(base + first, base + second, sheet, points)
        self._sheets[sheet.index] = (base, {z.tobytes(): points for z, points in sheet.links})

    def string(self, piece: Piece) -> None:
        """Join the nodes of a curve in their order."""
        stations = sorted(self._curves.get(piece.index, ()))
        for (_, first), (_, second) in pairwise(stations):
            points = np.stack([self.mesh.z[first], self.mesh.z[second]])
            self.mesh.connect(first, second, piece, points)


def _key(z: FloatArray) -> bytes:
    return np.round(z / (10.0 * SAME)).astype(np.int64).tobytes()
