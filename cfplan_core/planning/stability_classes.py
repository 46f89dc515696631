"""Split a curve of one contact formation by stability class."""

from __future__ import annotations

import numpy as np

from cfplan_core.contact.formation import Formation
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import Stability
from cfplan_core.planning.bracketing import enclose
from cfplan_core.planning.equations import is_second_order
from cfplan_core.planning.manifold import Chart, independent_rows, tangent_basis
from cfplan_core.planning.tracing import STABILITY_MARGIN, Tracer

_INNER = np.arange(1, 8) / 8.0
# Width, as a part of the interval between two points, to which a change of class is located.
_WIDTH = 1e-6
# Length, in radians and object sizes, below which a part is not told apart.
_HAIR = 1e-4


def split_by_class(
    tracer: Tracer, formation: Formation, points: FloatArray
) -> list[tuple[Stability, FloatArray]]:
    """Cut a stable curve where form closure is won or lost.

    Args:
        tracer: Knows system and model.
        formation: The contacts.
        points: Shape (s, 3 + n), successive points on the formation's manifold.

    Returns:
        Classes with their points; neighbours share a point, which has form closure, by a hair.
    """
    if is_second_order(formation):
        return [(Stability.SECOND_ORDER, points)]
    points = _refined(tracer, formation, points)
    closed = tracer.margins(formation, points).form_closure > STABILITY_MARGIN
    parts = []
    begin: list[FloatArray] = []
    first = 0
    for change in np.flatnonzero(np.diff(closed)):
        edge = _boundary(tracer, formation, points[change], points[change + 1], closed[change])
        parts.append((_name(closed[change]), [*begin, *points[first : change + 1], edge]))
        begin, first = [edge], int(change) + 1
    parts.append((_name(closed[-1]), [*begin, *points[first:]]))
    return _without_hairs([(stability, np.array(part)) for stability, part in parts])


def _without_hairs(
    parts: list[tuple[Stability, FloatArray]],
) -> list[tuple[Stability, FloatArray]]:
    """Give parts that are hardly longer than a point to the longer one of their neighbours."""
    while len(parts) > 1:
        extents = [float(np.abs(part - part[0]).max()) for _, part in parts]
        hair = int(np.argmin(extents))
        if extents[hair] >= _HAIR:
            break
        low, high = max(hair - 1, 0), min(hair + 2, len(parts))
        beside = [k for k in range(low, high) if k != hair]
        stability = parts[max(beside, key=lambda k: extents[k])][0]
        joined = [parts[low][1], *(part[1:] for _, part in parts[low + 1 : high])]
        parts = [*parts[:low], (stability, np.concatenate(joined)), *parts[high:]]
    return parts


def _name(closed: bool) -> Stability:
    return Stability.FORM_CLOSURE if closed else Stability.FORCE_CLOSURE


def _refined(tracer: Tracer, formation: Formation, points: FloatArray) -> FloatArray:
    """Insert points where form closure may be won and lost, or lost and won, between two."""
    margins = tracer.margins(formation, points)
    closed = margins.form_closure > STABILITY_MARGIN
    turns = (margins.signs[1:] != margins.signs[:-1]).any(axis=1)
    for interval in np.flatnonzero(turns & (closed[1:] == closed[:-1]))[::-1]:
        before, after = points[interval], points[interval + 1]
        between = _chart(tracer, formation, before).between(before, after, _INNER)
        inner = tracer.margins(formation, between).form_closure > STABILITY_MARGIN
        if (inner != closed[interval]).any():
            points = np.insert(points, interval + 1, between, axis=0)
    return points


def _boundary(
    tracer: Tracer, formation: Formation, before: FloatArray, after: FloatArray, closed: bool
) -> FloatArray:
    """Locate the change between two points; the result has form closure."""
    chart = _chart(tracer, formation, before)

    def margin(fractions: FloatArray) -> FloatArray:
        points = chart.between(before, after, fractions)
        return tracer.margins(formation, points).form_closure - STABILITY_MARGIN

    low, high = enclose(margin, _WIDTH)
    place = np.array([low if closed else high])
    return np.asarray(chart.between(before, after, place)[0])


def _chart(tracer: Tracer, formation: Formation, z: FloatArray) -> Chart:
    gradients = tracer.gradients(z[None], formation.array)[0]
    rows = list(independent_rows(gradients))
    basis = tangent_basis(gradients[rows])
    return Chart(tracer.system, formation.array[rows], z, basis, np.empty((0, len(z))))
