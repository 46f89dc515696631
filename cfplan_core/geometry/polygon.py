"""Simple polygons: area, centroid, convexity, validity.

A polygon is an array of shape (n, 2), vertices counter-clockwise, in m. Edge k runs from vertex k
to vertex k + 1 (modulo n).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

TOUCHING = 1e-12
"""Distance up to which features of one polygon count as one place, per length of the polygon."""

PAIRS_AT_ONCE = 1 << 16
"""Pairs of vertices or edges that are compared in one array: bounds the memory."""


def signed_area(vertices: FloatArray) -> float:
    """Area of a polygon, positive if counter-clockwise.

    Args:
        vertices: Shape (n, 2), m.

    Returns:
        Area in m², by the shoelace formula about the first vertex: exact enough for a small
        polygon far from the origin.
    """
    x, y = (vertices - vertices[0]).T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def centroid(vertices: FloatArray) -> FloatArray:
    """Centroid of a polygon's area.

    Args:
        vertices: Shape (n, 2), m; the area may not be zero.

    Returns:
        Shape (2,), m.
    """
    origin = vertices[0]
    p = vertices - origin
    q = np.roll(p, -1, axis=0)
    cross = p[:, 0] * q[:, 1] - q[:, 0] * p[:, 1]
    return np.asarray(origin + (p + q).T @ cross / (3.0 * cross.sum()))


def second_moment(vertices: FloatArray, about: FloatArray) -> float:
    """Mean squared distance of a polygon's area from a point, m².

    Args:
        vertices: Shape (n, 2), m; the area may not be zero.
        about: Shape (2,), m.
    """
    p = vertices - about
    q = np.roll(p, -1, axis=0)
    cross = p[:, 0] * q[:, 1] - q[:, 0] * p[:, 1]
    squares = (p * p + p * q + q * q).sum(axis=1)
    return float(squares @ cross / (6.0 * cross.sum()))


def diameter(vertices: FloatArray) -> float:
    """Largest distance between two vertices, m: the length by which tests are scaled."""
    n = len(vertices)
    rows = max(1, PAIRS_AT_ONCE // n)
    largest = 0.0
    for first in range(0, n, rows):
        x, y = (vertices[first : first + rows, None, :] - vertices[None, first:, :]).T
        largest = max(largest, float((x * x + y * y).max()))
    return float(np.sqrt(largest))


def convex_vertices(vertices: FloatArray, tolerance: float = 1e-9) -> NDArray[np.bool_]:
    """Tell which vertices can touch an edge of another body.

    Args:
        vertices: Shape (n, 2), m, counter-clockwise.
        tolerance: Sine of the turning angle up to which a vertex counts as straight.

    Returns:
        Shape (n,): true where the boundary turns left by more than the tolerance. A reflex vertex
        lies in a notch that no edge can enter, a straight one is part of its edge.
    """
    incoming = vertices - np.roll(vertices, 1, axis=0)
    outgoing = np.roll(incoming, -1, axis=0)
    cross = _cross(incoming, outgoing)
    scale = np.linalg.norm(incoming, axis=1) * np.linalg.norm(outgoing, axis=1)
    return np.asarray(cross > tolerance * scale)


def repeated_vertices(vertices: FloatArray) -> NDArray[np.intp]:
    """Find the vertices that lie where the vertex before them lies.

    Args:
        vertices: Shape (n, 2), m.

    Returns:
        Their indices, increasing; 0 if the first vertex repeats the last.
    """
    step = vertices - np.roll(vertices, 1, axis=0)
    return np.flatnonzero(np.hypot(step[:, 0], step[:, 1]) <= TOUCHING * _extent(vertices))


def is_flat(vertices: FloatArray) -> bool:
    """Tell whether all vertices lie on one straight line.

    Args:
        vertices: Shape (n, 2), m.
    """
    offset = vertices - vertices[0]
    distance = np.hypot(offset[:, 0], offset[:, 1])
    far = int(distance.argmax())
    if distance[far] == 0.0:
        return True
    away = np.abs(_cross(offset[far] / distance[far], offset))
    return bool(away.max() <= TOUCHING * distance[far])


def first_self_intersection(vertices: FloatArray) -> tuple[int, int] | None:
    """Find two edges of a polygon that meet where they should not.

    All pairs of edges are compared, in blocks: 10,000 vertices take seconds at most.

    Args:
        vertices: Shape (n, 2), m, n at least 3.

    Returns:
        Indices of the first pair of edges that cross or touch (neighbours: that fold back onto
        each other), or None if the polygon is simple.
    """
    n = len(vertices)
    reach = TOUCHING * _extent(vertices)
    corners = np.append(vertices, vertices[:1], axis=0) - vertices[0]
    direction = np.diff(corners, axis=0)
    length = np.hypot(direction[:, 0], direction[:, 1])
    normal = direction[:, ::-1] * [-1.0, 1.0] / np.where(length > 0.0, length, 1.0)[:, None]
    level = (normal * corners[:-1]).sum(axis=1)
    rows = max(1, PAIRS_AT_ONCE // n)
    for first in range(0, n, rows):
        last = min(first + rows, n)
        side = normal[first:last] @ corners[first:].T - level[first:last, None]
        other = normal[first:] @ corners[first : last + 1].T - level[first:, None]
        i, j = np.nonzero(np.triu(_straddles(side, reach) & _straddles(other, reach).T, 1))
        hits = np.flatnonzero(_meet(corners, i + first, j + first, reach))
        if len(hits):
            return int(i[hits[0]]) + first, int(j[hits[0]]) + first
    return None


def _straddles(side: FloatArray, reach: float) -> NDArray[np.bool_]:
    """Tell where successive vertices (columns) do not lie on one side of an edge's line (rows)."""
    below, above = side <= reach, side >= -reach
    return np.asarray((below[:, :-1] | below[:, 1:]) & (above[:, :-1] | above[:, 1:]))


def _meet(
    corners: FloatArray, i: NDArray[np.intp], j: NDArray[np.intp], reach: float
) -> NDArray[np.bool_]:
    """Tell which pairs of edges (i, j), i < j, meet apart from the vertex that neighbours share.

    Args:
        corners: Shape (n + 1, 2), m, the first vertex once more at the end.
        i: Shape (k,).
        j: Shape (k,).
        reach: Distance up to which edges touch, m.
    """
    a, b, c, d = corners[i], corners[i + 1], corners[j], corners[j + 1]
    after = j == i + 1
    before = (i == 0) & (j == len(corners) - 2)
    # On one line, rounding alone decides the sides: only edges that also lie abreast can cross.
    abreast = (
        (np.minimum(a, b) <= np.maximum(c, d)) & (np.minimum(c, d) <= np.maximum(a, b))
    ).all(axis=1)
    crossing = (_cross(d - c, a - c) * _cross(d - c, b - c) < 0.0) & (
        _cross(b - a, c - a) * _cross(b - a, d - a) < 0.0
    )
    return np.asarray(
        (crossing & abreast & ~after & ~before)
        | ((_distance(a, c, d) <= reach) & ~before)
        | ((_distance(b, c, d) <= reach) & ~after)
        | ((_distance(c, a, b) <= reach) & ~after)
        | ((_distance(d, a, b) <= reach) & ~before)
    )


def _distance(points: FloatArray, starts: FloatArray, ends: FloatArray) -> FloatArray:
    """Distance of each point from each segment, all of shape (k, 2) in m; returns shape (k,)."""
    direction = ends - starts
    offset = points - starts
    squared = (direction * direction).sum(axis=1)
    along = (offset * direction).sum(axis=1) / np.where(squared > 0.0, squared, 1.0)
    nearest = offset - np.clip(along, 0.0, 1.0)[:, None] * direction
    return np.asarray(np.hypot(nearest[:, 0], nearest[:, 1]))


def _extent(vertices: FloatArray) -> float:
    """Longest side of the bounding box, m."""
    return float(np.ptp(vertices, axis=0).max())


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Third component of the cross product of plane vectors in the last axis."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
