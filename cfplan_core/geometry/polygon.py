"""Simple polygons: area, centroid, convexity, validity.

A polygon is an array of shape (n, 2), vertices counter-clockwise, in m. Edge k runs from vertex k
to vertex k + 1 (modulo n).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def signed_area(vertices: FloatArray) -> float:
    """Area of a polygon, positive if counter-clockwise.

    Args:
        vertices: Shape (n, 2), m.

    Returns:
        Area in m², by the shoelace formula.
    """
    x, y = vertices[:, 0], vertices[:, 1]
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
    return origin + (p + q).T @ cross / (3.0 * cross.sum())


def diameter(vertices: FloatArray) -> float:
    """Largest distance between two vertices, m: the length by which tests are scaled."""
    difference = vertices[:, None, :] - vertices[None, :, :]
    return float(np.sqrt((difference**2).sum(axis=2).max()))


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
    cross = incoming[:, 0] * outgoing[:, 1] - incoming[:, 1] * outgoing[:, 0]
    scale = np.linalg.norm(incoming, axis=1) * np.linalg.norm(outgoing, axis=1)
    return np.asarray(cross > tolerance * scale)


def first_self_intersection(vertices: FloatArray) -> tuple[int, int] | None:
    """Find two edges of a polygon that meet where they should not.

    Args:
        vertices: Shape (n, 2), m.

    Returns:
        Indices of the first pair of edges that cross or touch (neighbours: that fold back onto
        each other), or None if the polygon is simple.
    """
    n = len(vertices)
    start = vertices
    direction = np.roll(vertices, -1, axis=0) - vertices
    scale = diameter(vertices) ** 2
    if scale == 0.0:
        return (0, 1)
    eps = 1e-12 * scale

    def cross(a: FloatArray, b: FloatArray) -> FloatArray:
        return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])

    offset = start[None, :, :] - start[:, None, :]
    side_start = cross(direction[:, None, :], offset)
    side_end = np.roll(side_start, -1, axis=1)
    straddles = (np.minimum(side_start, side_end) <= eps) & (
        np.maximum(side_start, side_end) >= -eps
    )
    meets = straddles & straddles.T
    parallel = (np.abs(side_start) <= eps) & (np.abs(side_end) <= eps)
    for i in range(n):
        for j in range(i + 1, n):
            if j == i + 1 or (i == 0 and j == n - 1):
                a, b = (i, j) if j == i + 1 else (j, i)
                folds = abs(float(cross(direction[a], direction[b]))) <= eps and (
                    float(direction[a] @ direction[b]) < 0.0
                )
                if folds:
                    return (i, j)
            elif meets[i, j]:
                if parallel[i, j]:
                    axis = direction[i]
                    length = float(axis @ axis)
                    along = sorted(
                        [float(axis @ offset[i, j]), float(axis @ offset[i, (j + 1) % n])]
                    )
                    if along[1] < 0.0 or along[0] > length:
                        continue
                return (i, j)
    return None
