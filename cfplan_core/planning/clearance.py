"""How far bodies are apart: a bound that never says too much, for many configurations at once.

Convex polygons are apart if an edge of one has all of the other before it. The largest distance,
over the edges of both, of the nearest vertex before the edge is at most their distance, and
negative where they overlap. Edges that have a vertex of their own body before them, of bodies
that are not convex, tell nothing and are left out.
"""

from __future__ import annotations

import numpy as np

from cfplan_core.contact.gaps import gaps
from cfplan_core.contact.system import BoolArray, ContactSystem, IntArray
from cfplan_core.geometry.polygon import FloatArray

_BEFORE = 1e-9
# Bodies with bounding circles nearer than this, in object sizes, are looked at more closely.
_NEAR = 0.02


class Clearance:
    """Distances between the bodies that some joints move and others that they may meet.

    Attributes:
        bodies: Shape (m, 2), the two bodies of each distance.
    """

    def __init__(
        self,
        system: ContactSystem,
        joints: IntArray,
        other: IntArray | None = None,
        alone: bool = False,
    ) -> None:
        """Choose the pairs of bodies that come nearer or part by some joints.

        Args:
            system: Compiled problem.
            joints: Indices of joints.
            other: Joints of bodies that alone are looked at besides; any if None.
            alone: True if bodies that other joints move are not looked at.
        """
        self._system = system
        vertex_body = system.body_of[system.pair_vertex]
        edge_body = system.body_of[system.pair_edge]
        concerned = (system.pair_moves[:, joints] != 0.0).any(axis=1)
        concerned &= _outer_edges(system)[system.pair_edge]
        moved: BoolArray = np.asarray(system.moves[:, joints].any(axis=1))
        if other is not None:
            seconds: BoolArray = np.asarray(system.moves[:, other].any(axis=1))
            concerned &= (moved | seconds)[vertex_body] & (moved | seconds)[edge_body]
            concerned &= seconds[vertex_body] | seconds[edge_body]
        if alone:
            strange: BoolArray = np.asarray(system.moves.any(axis=1) & ~moved)
            concerned &= ~(strange[vertex_body] | strange[edge_body])
        chosen = np.flatnonzero(concerned)
        low = np.minimum(vertex_body, edge_body)[chosen]
        high = np.maximum(vertex_body, edge_body)[chosen]
        order = np.lexsort((system.pair_edge[chosen], high, low))
        self._pairs: IntArray = chosen[order]
        low, high, edge = low[order], high[order], system.pair_edge[self._pairs]
        new_bodies = np.append(True, (np.diff(low) != 0) | (np.diff(high) != 0))
        starts_edge = np.append(True, np.diff(edge) != 0) | new_bodies
        self._starts_edge: BoolArray = starts_edge
        self._bodies_of: IntArray = np.cumsum(new_bodies) - 1
        self.bodies = np.stack([low[new_bodies], high[new_bodies]], axis=1)
        of = system.body_of[:, None] == np.arange(len(system.body_names))
        self._mean = of / of.sum(axis=0)
        placed = system.place(np.zeros((1, system.dof))).vertices[0]
        away = np.abs(placed - (placed @ self._mean)[system.body_of])
        self._radius = np.array([away[column].max() for column in of.T])

    def distances(self, z: FloatArray) -> FloatArray:
        """Bounds from below, in object sizes, shape (s, m), at configurations (s, 3 + n).

        Bodies whose bounding circles are far apart are not looked at more closely.
        """
        placed = self._system.place(z)
        center = placed.vertices @ self._mean
        one, two = self.bodies.T
        found = np.abs(center[:, one] - center[:, two]) - (self._radius[one] + self._radius[two])
        near = found.min(axis=0, initial=np.inf) < _NEAR
        if not near.any():
            return np.asarray(found)
        chosen = near[self._bodies_of]
        edges = np.flatnonzero(self._starts_edge[chosen])
        bodies = self._bodies_of[chosen][edges]
        groups = np.flatnonzero(np.append(True, np.diff(bodies) != 0))
        gap = gaps(self._system, placed, self._pairs[chosen]).gap
        before_edge = np.minimum.reduceat(gap, edges, axis=1)
        found[:, near] = np.maximum(
            found[:, near], np.maximum.reduceat(before_edge, groups, axis=1)
        )
        return np.asarray(found)


def _outer_edges(system: ContactSystem) -> BoolArray:
    """Which edges have their whole body behind them, shape (v,), boolean."""
    placed = system.place(np.zeros((1, system.dof)))
    vertices, normals = placed.vertices[0], placed.normals[0]
    height = (normals.conj()[:, None] * (vertices[None] - vertices[:, None])).real
    own = system.body_of[:, None] == system.body_of[None]
    return np.asarray((np.where(own, height, -1.0) <= _BEFORE).all(axis=1))
