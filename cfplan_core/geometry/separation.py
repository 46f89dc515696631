"""How deep two polygons overlap."""

from __future__ import annotations

import numpy as np

from cfplan_core.geometry.polygon import FloatArray


def penetration_depth(a: FloatArray, b: FloatArray) -> float:
    """Largest distance by which the boundary of one polygon reaches into the other.

    Args:
        a: Shape (n, 2), m, a simple polygon, convex or not.
        b: Shape (m, 2), likewise.

    Returns:
        Depth in m, measured from boundary points of one polygon to the boundary of the other:
        its vertices and the middles of those pieces of its edges that run inside. Zero if the
        polygons are apart or touch.
    """
    if (a.max(axis=0) < b.min(axis=0)).any() or (b.max(axis=0) < a.min(axis=0)).any():
        return 0.0
    return max(_reach(a, b), _reach(b, a))


def _reach(a: FloatArray, b: FloatArray) -> float:
    """Depth in b of the vertices of a and of the middles of its edges' pieces."""
    points = [a]
    for start, end in zip(a, np.roll(a, -1, axis=0), strict=True):
        cuts = _cuts(start, end, b)
        bounds = np.concatenate([[0.0], cuts, [1.0]])
        middles = 0.5 * (bounds[1:] + bounds[:-1])
        points.append(start + middles[:, None] * (end - start))
    samples = np.concatenate(points)
    inside = _contains(b, samples)
    if not inside.any():
        return 0.0
    return float(_boundary_distance(b, samples[inside]).max())


def _cuts(start: FloatArray, end: FloatArray, polygon: FloatArray) -> FloatArray:
    """Where a line segment crosses the edges of a polygon: sorted fractions of its length."""
    along = end - start
    edge = np.roll(polygon, -1, axis=0) - polygon
    offset = polygon - start
    cross = along[0] * edge[:, 1] - along[1] * edge[:, 0]
    safe = np.where(cross == 0.0, 1.0, cross)
    on_segment = (offset[:, 0] * edge[:, 1] - offset[:, 1] * edge[:, 0]) / safe
    on_edge = (offset[:, 0] * along[1] - offset[:, 1] * along[0]) / safe
    hit = (cross != 0.0) & (on_segment > 0.0) & (on_segment < 1.0)
    hit &= (on_edge >= 0.0) & (on_edge <= 1.0)
    return np.sort(on_segment[hit])


def _contains(polygon: FloatArray, points: FloatArray) -> FloatArray:
    """Tell which points lie inside a polygon (even-odd rule; either way on the boundary)."""
    start, end = polygon, np.roll(polygon, -1, axis=0)
    x, y = points[:, :1], points[:, 1:]
    spans = (start[:, 1] > y) != (end[:, 1] > y)
    rise = np.where(end[:, 1] == start[:, 1], 1.0, end[:, 1] - start[:, 1])
    at = start[:, 0] + (y - start[:, 1]) / rise * (end[:, 0] - start[:, 0])
    return np.asarray((spans & (x < at)).sum(axis=1) % 2 == 1)


def _boundary_distance(polygon: FloatArray, points: FloatArray) -> FloatArray:
    """Distance of points, shape (s, 2), to the nearest edge."""
    edge = np.roll(polygon, -1, axis=0) - polygon
    offset = points[:, None, :] - polygon
    fraction = (offset * edge).sum(axis=-1) / (edge**2).sum(axis=-1)
    nearest = offset - np.clip(fraction, 0.0, 1.0)[..., None] * edge
    return np.asarray(np.sqrt((nearest**2).sum(axis=-1)).min(axis=1))
