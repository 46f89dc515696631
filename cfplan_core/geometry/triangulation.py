"""Cuts a polygon into triangles by clipping ears."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cfplan_core.geometry.polygon import FloatArray, convex_vertices, diameter

# Doubled area, per squared diameter, up to which a corner counts as straight.
_STRAIGHT = 1e-12


def triangulate(vertices: FloatArray) -> NDArray[np.intp]:
    """Cut a simple polygon into triangles.

    Args:
        vertices: Shape (v, 2), counter-clockwise; convex or not.

    Returns:
        Shape (t, 3), indices of the triangles' corners, counter-clockwise. Together they cover
        the polygon once. A straight corner may be left out.
    """
    points = vertices / diameter(vertices)
    reflex = ~convex_vertices(points)
    after = np.roll(np.arange(len(points)), -1)
    before = np.roll(np.arange(len(points)), 1)
    triangles: list[tuple[int, int, int]] = []
    tip, left, since_last = 0, len(points), 0
    while left > 2:
        a, b = int(before[tip]), int(after[tip])
        area = _doubled_area(points[a], points[tip], points[b])
        straight = abs(area) <= _STRAIGHT
        # A simple polygon always has an ear; where rounding hides it any convex corner must do.
        forced = since_last > left and area > 0.0
        if straight or forced or (area > 0.0 and _is_ear(points, reflex, a, tip, b)):
            if not straight:
                triangles.append((a, tip, b))
            after[a], before[b] = b, a
            reflex[tip] = False
            left -= 1
            since_last = 0
            for corner in (a, b):
                turn = _doubled_area(points[before[corner]], points[corner], points[after[corner]])
                reflex[corner] = turn < -_STRAIGHT
        elif since_last > 2 * left:
            break
        since_last += 1
        tip = b
    return np.array(triangles, dtype=np.intp).reshape(-1, 3)


def _doubled_area(a: FloatArray, b: FloatArray, c: FloatArray) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def _is_ear(points: FloatArray, reflex: NDArray[np.bool_], a: int, tip: int, b: int) -> bool:
    """Tell whether no corner of the polygon lies in a triangle or on its border."""
    others = np.flatnonzero(reflex)
    others = others[(others != a) & (others != b)]
    if not len(others):
        return True
    p = points[others]
    inside = np.ones(len(p), dtype=bool)
    for start, end in ((a, tip), (tip, b), (b, a)):
        edge = points[end] - points[start]
        away = p - points[start]
        inside &= edge[0] * away[:, 1] - edge[1] * away[:, 0] >= -_STRAIGHT
    return not inside.any()
