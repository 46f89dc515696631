"""Drive configurations inside a contact formation towards a goal."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cfplan_core.contact.detection import touching
from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.events import EventKind
from cfplan_core.planning.goal_region import GoalRegion
from cfplan_core.planning.grasp_check import TOUCHING
from cfplan_core.planning.pieces import Region
from cfplan_core.planning.stability_classes import split_by_class
from cfplan_core.planning.tracing import Tracer

_ARRIVED = 1e-9
_LONGEST = 10.0
# Other configurations than the anchor and the entry that are driven from, and how far apart.
_MOST_STARTS = 3
_APART = 0.1
# How far inside its border a region is driven from.
_INSIDE = 0.02


def drive(
    tracer: Tracer,
    region: Region,
    goal: GoalRegion,
    start: FloatArray,
    held: tuple[int, ...] = (),
    longest: float = _LONGEST,
) -> FloatArray | None:
    """Move inside a region straight to where a goal's coordinates are least off.

    Args:
        tracer: Knows system and model.
        region: To move in.
        goal: With coordinates.
        start: Inside the region, shape (3 + n,).
        held: Columns of z, joints, that are held still.
        longest: Way after which to stop, in radians and object sizes.

    Returns:
        Points from start to the configuration nearest to what is wanted, shape (s, 3 + n); None
        if none on the way is within the tolerances. What ends a motion, be it a contact or lost
        stability, is come near to only where there is nothing else.
    """

    def steer(z: FloatArray, basis: FloatArray) -> FloatArray | None:
        ahead = goal.step(z, basis)
        return ahead if np.abs(ahead).max() > _ARRIVED else None

    trace = tracer.follow(region.formation, start, steer, longest=longest, held=held)
    points, ended = trace.points, trace.kind is not EventKind.TARGET
    if len(points) > 1:
        (stability, points), *others = split_by_class(tracer, region.formation, points)
        if stability is not region.stability:
            return None
        ended = ended or bool(others)
    ratios = goal.ratios(points)
    if ended and ratios[-1] <= 1.0:
        # Of all that will do the border is the last choice.
        ratios[-1] = 1.0
    for nearest in np.argsort(ratios, kind='stable'):
        if ratios[nearest] > 1.0:
            break
        if lies_inside(tracer.system, region, points[nearest]):
            return points[: nearest + 1]
    return None


def lies_inside(system: ContactSystem, region: Region, z: FloatArray) -> bool:
    """Tell whether nothing but a region's contacts touches, by as much as files are rounded."""
    return tuple(touching(system, z, TOUCHING / system.size).tolist()) == region.formation.pairs


def drives(
    tracer: Tracer, region: Region, goal: GoalRegion, near: FloatArray | None
) -> Iterator[FloatArray]:
    """Ways from a region's anchor to configurations within a goal's tolerances.

    From the anchor, first with all joints, then with each of the others held still, as links may
    be in the way; then from a place near where the region is entered, and from those places on
    the ways to its borders that are nearest to the goal.

    Args:
        tracer: Knows system and model.
        region: Explored from its anchor.
        goal: What is looked for.
        near: Where the region is entered, shape (3 + n,), if that matters.

    Yields:
        Points from the anchor, shape (s, 3 + n).
    """
    anchor = region.anchor
    if not goal.count:
        yield anchor[None]
        return
    free = [k for k in range(3, len(anchor)) if k not in goal.columns]
    for held in ((), *((column,) for column in free)):
        points = drive(tracer, region, goal, anchor, held)
        if points is not None:
            yield points
    for way in _starts(region, goal, near):
        points = drive(tracer, region, goal, way[-1])
        if points is not None:
            yield np.concatenate([way, points[1:]])


def _starts(region: Region, goal: GoalRegion, near: FloatArray | None) -> Iterator[FloatArray]:
    """Ways from the anchor to places to drive from: that near the entry, then the best."""
    ways = [points for _, points in region.links if len(points) > 1]
    taken = [region.anchor]
    if near is not None and ways:
        entering = min(ways, key=lambda way: float(np.abs(way[-1] - near).max()))
        inside = np.flatnonzero(np.abs(entering - entering[-1]).max(axis=1) >= _INSIDE)
        if len(inside) and inside[-1] > 0:
            taken.append(entering[inside[-1]])
            yield entering[: inside[-1] + 1]
    # Ends of ways lie on the border.
    places = [(way, k) for way in ways for k in range(1, len(way) - 1)]
    if not places:
        return
    ratios = goal.ratios(np.array([way[k] for way, k in places]))
    most = len(taken) + _MOST_STARTS
    for index in np.argsort(ratios, kind='stable'):
        way, k = places[int(index)]
        if all(np.abs(way[k] - other).max() > _APART for other in taken):
            taken.append(way[k])
            yield way[: k + 1]
            if len(taken) >= most:
                return
