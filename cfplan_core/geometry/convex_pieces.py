"""Polygons shrunk by a distance and cut into convex pieces: what a physics engine collides."""

from __future__ import annotations

import numpy as np

from cfplan_core.geometry.polygon import FloatArray, convex_vertices
from cfplan_core.geometry.triangulation import triangulate


def shrunk(vertices: FloatArray, distance: float) -> FloatArray:
    """Move every edge of a polygon inward; corners stay sharp.

    Args:
        vertices: Shape (v, 2), m, counter-clockwise; no edge folds back onto its neighbour.
        distance: m, small against the polygon's edges and width.

    Returns:
        Shape (v, 2): vertex k is where the moved edges k - 1 and k meet.
    """
    return np.asarray(vertices + distance * _inward(vertices))


def rounded(vertices: FloatArray, radius: float) -> tuple[FloatArray, FloatArray]:
    """Round the corners of a polygon, sharp ones by less.

    No corner moves farther than a right angle does that is rounded by the radius, (√2 − 1) times
    it.

    Args:
        vertices: As of `shrunk`.
        radius: m.

    Returns:
        Centres of the circles that touch both edges of each corner, shape (v, 2), and their radii,
        shape (v,).
    """
    inward = _inward(vertices)
    recedes = np.hypot(inward[:, 0], inward[:, 1]) - 1.0
    right = np.sqrt(2.0) - 1.0
    radii = radius * right / np.maximum(recedes, right)
    return vertices + radii[:, None] * inward, radii


def _inward(vertices: FloatArray) -> FloatArray:
    """How corners move if all edges move inward by a unit, shape (v, 2)."""
    along = np.roll(vertices, -1, axis=0) - vertices
    along = along / np.hypot(along[:, 0], along[:, 1])[:, None]
    after = np.stack([along[:, 1], -along[:, 0]], axis=1)
    before = np.roll(after, 1, axis=0)
    together = 1.0 + (before * after).sum(axis=1, keepdims=True)
    return np.asarray(-(before + after) / together)


def convex_pieces(vertices: FloatArray) -> tuple[FloatArray, ...]:
    """Cut a simple polygon into convex ones that cover it once.

    Args:
        vertices: Shape (v, 2), m, counter-clockwise.

    Returns:
        The polygon itself where it is convex, else triangles.
    """
    reversed_turns = convex_vertices(vertices[::-1])
    if not reversed_turns.any():
        return (vertices,)
    return tuple(vertices[corners] for corners in triangulate(vertices))
