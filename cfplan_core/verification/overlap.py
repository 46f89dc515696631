"""How deep two polygons overlap, as a length, also where they are not convex."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np
import shapely

from cfplan_core.verification.mechanism import FloatArray, Mechanism


def link_pairs(mechanism: Mechanism) -> list[tuple[str, str]]:
    """Bodies of the hand that may not overlap.

    Links of different fingers, links of one finger that are not neighbours, links beyond the
    first with the palm.
    """

    def pairs() -> Iterator[tuple[str, str]]:
        for a, b in combinations(mechanism.bodies.values(), 2):
            if a.finger is None and b.finger is None:
                continue
            if a.finger is None:
                if len(b.chain) > 1:
                    yield a.name, b.name
            elif a.finger != b.finger or abs(len(a.chain) - len(b.chain)) > 1:
                yield a.name, b.name

    return list(pairs())


def overlap_depth(first: FloatArray, second: FloatArray) -> float:
    """Depth of the overlap of two simple polygons.

    Args:
        first: Shape (v, 2), m.
        second: Shape (w, 2), m.

    Returns:
        The larger of two lengths in m: how far a vertex of one is inside the other, and the mean
        thickness (twice the area by the circumference) of a piece of the intersection. The first
        is exact for a corner in a body, the second is there where bars cross with no vertex
        inside, and stays small for a long thin sliver between flush edges of any shape. 0 if only
        boundaries meet.
    """
    low = np.maximum(first.min(axis=0), second.min(axis=0))
    high = np.minimum(first.max(axis=0), second.max(axis=0))
    if np.any(low >= high):
        return 0.0
    one, other = shapely.polygons(first), shapely.polygons(second)
    pieces = shapely.get_parts(shapely.intersection(one, other))
    pieces = pieces[shapely.area(pieces) > 0.0]
    if len(pieces) == 0:
        return 0.0
    thickness = 2.0 * shapely.area(pieces) / shapely.length(pieces)
    return max(float(thickness.max()), _deepest_vertex(first, other), _deepest_vertex(second, one))


def _deepest_vertex(vertices: FloatArray, polygon: shapely.Polygon) -> float:
    spots = shapely.points(vertices)
    inside = spots[shapely.contains_properly(polygon, spots)]
    if len(inside) == 0:
        return 0.0
    return float(shapely.distance(inside, shapely.boundary(polygon)).max())
