"""How far bodies are apart: a bound that never says too much, for many configurations at once.

Convex polygons are apart if an edge of one has all of the other before it. The largest distance,
over the edges of both, of the nearest vertex before the edge is at most their distance, and
negative where they overlap. Edges that have a vertex of their own body before them, of bodies
that are not convex, tell nothing and are left out.
"""

from __future__ import annotations

import numpy as np

from cfplan_core.contact.gaps import gaps
from cfplan_core.contact.system import ContactSystem, IntArray
from cfplan_core.geometry.polygon import FloatArray

_BEFORE = 1e-9


class Clearance:
    """Distances between the bodies that some joints move and all others that they may meet.

    Attributes:
        bodies: Shape (m, 2), the two bodies of each distance.
    """

    def __init__(self, system: ContactSystem, joints: IntArray) -> None:
        """Choose the pairs of bodies that come nearer or part by some joints.

        Args:
            system: Compiled problem.
            joints: Indices of joints.
        """
        self._system = system
        vertex_body = system.body_of[system.pair_vertex]
        edge_body = system.body_of[system.pair_edge]
        concerned = (system.pair_moves[:, joints] != 0.0).any(axis=1)
        concerned &= _outer_edges(system)[system.pair_edge]
        chosen = np.flatnonzero(concerned)
        low = np.minimum(vertex_body, edge_body)[chosen]
        high = np.maximum(vertex_body, edge_body)[chosen]
        order = np.lexsort((system.pair_edge[chosen], high, low))
        self._pairs: IntArray = chosen[order]
        low, high, edge = low[order], high[order], system.pair_edge[self._pairs]
        new_bodies = np.append(True, (np.diff(low) != 0) | (np.diff(high) != 0))
        new_edge = np.append(True, np.diff(edge) != 0) | new_bodies
        self._edges: IntArray = np.flatnonzero(new_edge)
        self._groups: IntArray = np.flatnonzero(new_bodies[self._edges])
        first = self._edges[self._groups]
        self.bodies = np.stack([low[first], high[first]], axis=1)

    def distances(self, z: FloatArray) -> FloatArray:
        """Bounds from below, in object sizes, shape (s, m), at configurations (s, 3 + n)."""
        gap = gaps(self._system, self._system.place(z), self._pairs).gap
        before_edge = np.minimum.reduceat(gap, self._edges, axis=1)
        return np.asarray(np.maximum.reduceat(before_edge, self._groups, axis=1))


def _outer_edges(system: ContactSystem) -> FloatArray:
    """Which edges have their whole body behind them, shape (v,), boolean."""
    placed = system.place(np.zeros((1, system.dof)))
    vertices, normals = placed.vertices[0], placed.normals[0]
    height = (normals.conj()[:, None] * (vertices[None] - vertices[:, None])).real
    own = system.body_of[:, None] == system.body_of[None]
    return np.asarray((np.where(own, height, -1.0) <= _BEFORE).all(axis=1))
