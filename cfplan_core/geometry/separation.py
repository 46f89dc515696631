"""How deep two polygons overlap."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cfplan_core.geometry.polygon import FloatArray


def penetration_depth(a: FloatArray, b: FloatArray) -> float:
    """Distance by which one polygon reaches into the other.

    Args:
        a: Shape (n, 2), m, a simple polygon, convex or not.
        b: Shape (m, 2), likewise.

    Returns:
        Largest depth, in m, of points of one polygon below the boundary of the other: of its
        vertices, of the middles of those pieces of its edges that run inside, and of one point
        inside it, for polygons that coincide. At least half as deep as its whole boundary where
        the other is convex. Zero if the polygons are apart or touch.
    """
    if (a.max(axis=0) < b.min(axis=0)).any() or (b.max(axis=0) < a.min(axis=0)).any():
        return 0.0
    # All but parallel edges: what overflows lies off both.
    with np.errstate(over='ignore', invalid='ignore'):
        return max(_reach(a, b), _reach(b, a))


def _reach(a: FloatArray, b: FloatArray) -> float:
    """Depth in b of the vertices of a, of the middles of its edges' pieces and of its inside."""
    points = [a, _inner_point(a)[None]]
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


def _inner_point(polygon: FloatArray) -> FloatArray:
    """A point inside: half way on the widest chord at half way between two vertices' heights."""
    heights = np.unique(polygon[:, 1])
    lower = np.argmax(np.diff(heights))
    y = 0.5 * (heights[lower] + heights[lower + 1])
    end = np.roll(polygon, -1, axis=0)
    crossing = (polygon[:, 1] > y) != (end[:, 1] > y)
    start, end = polygon[crossing], end[crossing]
    fraction = (y - start[:, 1]) / (end[:, 1] - start[:, 1])
    x = np.sort(start[:, 0] + fraction * (end[:, 0] - start[:, 0]))
    chord = 2 * np.argmax(x[1::2] - x[::2])
    return np.array([0.5 * (x[chord] + x[chord + 1]), y])


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
    # A cut too many does no harm; one at a vertex must not be lost between its two edges.
    hit &= (on_edge >= -1e-9) & (on_edge <= 1.0 + 1e-9)
    return np.sort(on_segment[hit])


def _contains(polygon: FloatArray, points: FloatArray) -> NDArray[np.bool_]:
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
