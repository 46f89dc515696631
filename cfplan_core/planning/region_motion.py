"""Motion inside a region straight from one configuration to another."""

from __future__ import annotations

import numpy as np

from cfplan_core.contact.detection import touching
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.events import EventKind
from cfplan_core.planning.pieces import SAME, Region
from cfplan_core.planning.roadmap import Roadmap
from cfplan_core.planning.settling import BEHIND
from cfplan_core.planning.stability_classes import split_by_class
from cfplan_core.planning.tracing import Trace
from cfplan_core.planning.transitions import TOUCH

_ARRIVED = 1e-9


def _settles(roadmap: Roadmap, region: Region, trace: Trace, end: FloatArray) -> bool:
    """Tell whether stability ends just before the end, where the object settles."""
    if trace.kind is not EventKind.UNSTABLE or np.abs(trace.end - end).max() > BEHIND:
        return False
    places = [z for z, _ in roadmap.settling.beside(region)]
    return any(np.abs(z - end).max() < SAME for z in places)


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

    def steer(z: FloatArray, basis: FloatArray) -> FloatArray | None:
        ahead = np.asarray(basis.T @ (basis @ (end - z)))
        return ahead if np.abs(ahead).max() > _ARRIVED else None

    apart = float(np.abs(end - start).max())
    if apart < SAME:
        return None
    kept = set(region.formation.pairs)
    there = touching(roadmap.system, start, TOUCH).tolist()
    departing = frozenset(int(pair) for pair in there if pair not in kept)
    trace = roadmap.tracer.follow(region.formation, start, steer, departing, longest=4.0 * apart)
    short = float(np.abs(trace.end - end).max())
    if len(trace.points) < 2 or (short > SAME and not _settles(roadmap, region, trace, end)):
        return None
    points = np.concatenate([trace.points[:-1], end[None]])
    parts = split_by_class(roadmap.tracer, region.formation, points)
    if len(parts) > 1 or parts[0][0] is not region.stability:
        return None
    return points
