"""Motion inside a region straight from one configuration to another."""

from __future__ import annotations

from cfplan_core.contact.detection import touching
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.connecting import projected_path
from cfplan_core.planning.pieces import Region
from cfplan_core.planning.roadmap import Roadmap
from cfplan_core.planning.stability_classes import split_by_class
from cfplan_core.planning.transitions import TOUCH


def straight_motion(
    roadmap: Roadmap, region: Region, start: FloatArray, end: FloatArray
) -> FloatArray | None:
    """Follow the straight way in joints and pose, projected onto the formation's manifold.

    Args:
        roadmap: That holds the region.
        region: What to move inside.
        start: Shape (3 + n,), inside the region or on its border.
        end: As start.

    Returns:
        Points from start to end, shape (s, 3 + n), inside the region between; None if the way
        ends before or leaves the region's stability class.
    """
    kept = set(region.formation.pairs)
    there = touching(roadmap.system, start, TOUCH).tolist()
    departing = frozenset(int(pair) for pair in there if pair not in kept)
    points = projected_path(roadmap.tracer, region.formation, start, end, departing)
    if points is None:
        return None
    parts = split_by_class(roadmap.tracer, region.formation, points)
    if len(parts) > 1 or parts[0][0] is not region.stability:
        return None
    return points
