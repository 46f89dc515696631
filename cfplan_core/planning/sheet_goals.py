"""Where a sheet fulfils a goal: the level set of one coordinate, or the nearest of several.

A sheet is known by its vertices, the straight steps between them and its borders. One coordinate
has the value wanted somewhere on every step along which its offset changes sign, so that no level
set that passes between vertices is missed. Several coordinates are driven to their values from
the vertices that are nearer to these than those beside them, and from all within the tolerance.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cfplan_core.contact.system import BoolArray, IntArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.bracketing import enclose
from cfplan_core.planning.goal_drives import drive
from cfplan_core.planning.goal_region import GoalRegion
from cfplan_core.planning.manifold import project
from cfplan_core.planning.sheet_graph import Sheet
from cfplan_core.planning.tracing import Tracer

# Stability margins above this part of the largest on a sheet are comfortable.
_COMFORTABLE = 0.5
_SAMPLES = 17
# Steps over the grid after which a vertex is too far from a goal to be driven from.
_MOST_STEPS = 4.0
# Vertices that are driven from, before the borders are looked at.
_MOST_DRIVES = 40


def goals_on_sheet(
    tracer: Tracer, sheet: Sheet, rows: IntArray, goal: GoalRegion, near: FloatArray | None
) -> Iterator[FloatArray]:
    """Ways from a vertex to configurations on a sheet that fulfil a goal's coordinates.

    Those that hold the object well come first, of these the nearest to where the sheet is
    entered.

    Args:
        tracer: Knows system and model.
        sheet: With vertices over the grid.
        rows: Three of its contacts that are independent for fixed joints, shape (3,).
        goal: What is looked for; the sheet has its contacts.
        near: Where the sheet is entered, shape (3 + n,); None for all ways, in no order.

    Yields:
        Points, shape (s, 3 + n), the first a vertex.
    """
    vertices = np.array(sheet.vertices)
    order = list(range(len(vertices)))
    if near is not None:
        order = _order(tracer, sheet, vertices, near)
    if not goal.count:
        yield from (vertices[k][None] for k in order)
        return
    offsets = goal.offsets(vertices)
    if goal.count == 1:
        yield from _crossings(tracer, sheet, rows, goal, vertices, offsets[:, 0], order)
    ratios = goal.ratios(vertices)
    within = ratios <= 1.0
    lowest = [
        k
        for k in order
        if within[k] or (_is_lowest(sheet, ratios, k) and _may_reach(sheet, offsets, k))
    ]
    if near is None:
        yield from (vertices[k][None] for k in np.flatnonzero(within))
        lowest = [k for k in lowest if not within[k]]
    for k in lowest[:_MOST_DRIVES]:
        points = drive(tracer, sheet, goal, vertices[k], longest=1.0)
        if points is not None:
            yield points
        elif within[k]:
            yield vertices[k][None]
    yield from _at_borders(tracer, sheet, rows, goal, vertices, order)


def _order(tracer: Tracer, sheet: Sheet, vertices: FloatArray, near: FloatArray) -> list[int]:
    """Vertices that hold the object well before the others, those near an entry first."""
    margins = tracer.margins(sheet.formation, vertices).stable
    poor = margins < _COMFORTABLE * margins.max()
    apart = np.abs(vertices[:, 3:] - near[3:]).max(axis=1)
    return [int(k) for k in np.lexsort((apart, poor))]


def _is_lowest(sheet: Sheet, ratios: FloatArray, vertex: int) -> bool:
    """Tell whether no vertex beside one is nearer to the goal."""
    return all(ratios[vertex] <= ratios[other] for other in sheet.edges[vertex])


def _may_reach(sheet: Sheet, offsets: FloatArray, vertex: int) -> bool:
    """Tell whether the goal may lie within a few steps, by how much one step changes."""
    beside = list(sheet.edges[vertex])
    if not beside:
        return True
    change = np.abs(offsets[beside] - offsets[vertex]).max(axis=0)
    return bool((np.abs(offsets[vertex]) - 1.0 <= _MOST_STEPS * change).all())


def _crossings(
    tracer: Tracer,
    sheet: Sheet,
    rows: IntArray,
    goal: GoalRegion,
    vertices: FloatArray,
    offsets: FloatArray,
    order: list[int],
) -> Iterator[FloatArray]:
    """Where the only coordinate of a goal has its value on a step between vertices."""
    done: set[int] = set()
    for first in order:
        done.add(first)
        for second in sheet.edges[first]:
            if second in done or not offsets[first] * offsets[second] <= 0.0:
                continue
            begin, end = vertices[first], vertices[second]
            if offsets[first] == 0.0:
                yield begin[None]
                break

            def offset(
                fractions: FloatArray, first: int = first, end: FloatArray = end
            ) -> FloatArray:
                z, _ = _between(tracer, rows, vertices[first], end, fractions)
                return goal.offsets(z)[:, 0]

            place = np.array([enclose(offset)[0]])
            z, found = _between(tracer, rows, begin, end, place)
            if found[0] and goal.fits(z[0]):
                yield np.stack([begin, z[0]])


def _at_borders(
    tracer: Tracer,
    sheet: Sheet,
    rows: IntArray,
    goal: GoalRegion,
    vertices: FloatArray,
    order: list[int],
) -> Iterator[FloatArray]:
    """Where goals are fulfilled between the outermost vertices and the border only."""
    rank = {vertex: place for place, vertex in enumerate(order)}
    fractions = np.linspace(0.0, 1.0, _SAMPLES)
    for border in sorted(sheet.borders, key=lambda border: rank[border.vertex]):
        parts = [vertices[border.vertex][None]]
        for begin, end in zip(border.points[:-1], border.points[1:], strict=True):
            z, found = _between(tracer, rows, begin, end, fractions)
            parts.append(z[1:][found[1:]])
        points = np.concatenate(parts)
        ratios = goal.ratios(points)
        # What ends the sheet is come near to only where there is nothing else.
        inner = ratios[:-1] if len(ratios) > 1 and ratios[:-1].min() <= 1.0 else ratios
        nearest = int(np.argmin(inner))
        if inner[nearest] <= 1.0:
            yield points[: nearest + 1]


def _between(
    tracer: Tracer, rows: IntArray, begin: FloatArray, end: FloatArray, fractions: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Configurations of a step, shape (s, 3 + n), at fractions of its joints' motion."""
    guesses = begin + fractions[:, None] * (end - begin)
    found = project(tracer.system, rows, begin, np.eye(len(begin))[3:], guesses)
    return found.points, found.converged
