"""Locate an event of a motion between two configurations, to rounding.

Newton's method solves for the contacts, the event and the coordinates across the motion together.
Where it runs to another root, or contacts become dependent just at the event, the root is enclosed
along the motion.
"""

from __future__ import annotations

import numpy as np

from cfplan_core.contact.gaps import (
    gap_gradients,
    gaps,
    offset_gradients,
    wedge_lift_gradients,
    wedge_lifts,
)
from cfplan_core.contact.system import ContactSystem, Placement
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.bracketing import enclose
from cfplan_core.planning.equations import equations
from cfplan_core.planning.events import Candidate, EventKind
from cfplan_core.planning.manifold import CONVERGED, Chart, tangent_basis

_ITERATIONS = 20
_ASTRAY = 1.0
_NEAR = 1e-9


def locate(
    chart: Chart,
    candidate: Candidate,
    before: FloatArray,
    after: FloatArray,
    direction: FloatArray,
) -> FloatArray | None:
    """Locate an event between two configurations.

    Args:
        chart: Of the manifold that the motion stays on.
        candidate: The event, and roughly where.
        before: Shape (3 + n,).
        after: Shape (3 + n,).
        direction: Of the motion, from before to after.

    Returns:
        Configuration, shape (3 + n,), or None if the event does not happen between the two.
    """
    z = _find(chart, candidate, before, after, direction)
    if z is None and _passed(chart.system, candidate, after):
        # It has happened behind, so it must have before.
        return before
    if z is not None and candidate.kind in (EventKind.CONTACT, EventKind.LINKS_MEET):
        system = chart.system
        pair = np.array([candidate.index], dtype=np.intp)
        offset = float(gaps(system, system.place(z[None]), pair).offset[0, 0])
        if not -_NEAR <= offset <= float(system.pair_length[candidate.index]) + _NEAR:
            return None
    return z


def _passed(system: ContactSystem, candidate: Candidate, z: FloatArray) -> bool:
    """Tell whether a configuration is beyond the end of an edge or the limit of a joint."""
    if candidate.kind is EventKind.EDGE_END:
        sign = 1.0 if candidate.target > 0.0 else -1.0
    elif candidate.kind is EventKind.JOINT_LIMIT:
        sign = 1.0 if candidate.target == system.upper[candidate.index] else -1.0
    else:
        return False
    value = _event(system, candidate, z[None], system.place(z[None]))[0]
    return bool(sign * value[0] > _NEAR)


def _find(
    chart: Chart,
    candidate: Candidate,
    before: FloatArray,
    after: FloatArray,
    direction: FloatArray,
) -> FloatArray | None:
    """Find the root of an event's function between two configurations."""
    system = chart.system

    def between(z: FloatArray | None) -> bool:
        if z is None:
            return False
        low, at, high = (float(v @ direction) for v in (before, z, after))
        slack = 1e-6 + 0.01 * (high - low)
        return low - slack <= at <= high + slack

    guess = before + candidate.fraction * (after - before)
    z = _newton(chart, candidate, guess, direction)
    if between(z):
        return z
    ends = np.stack([before, after])
    first, last = _event(system, candidate, ends, system.place(ends))[0]
    if not first * last < 0.0:
        return None

    def values(places: FloatArray) -> FloatArray:
        points = chart.between(before, after, places)
        return _event(system, candidate, points, system.place(points))[0]

    _, place = enclose(values)
    enclosed = np.asarray(chart.between(before, after, np.array([place]))[0])
    z = _newton(chart, candidate, enclosed, direction)
    return z if between(z) else enclosed


def _newton(
    chart: Chart, candidate: Candidate, guess: FloatArray, direction: FloatArray
) -> FloatArray | None:
    """Solve for the contacts, the event and the coordinates across the motion."""
    system = chart.system
    across = tangent_basis((chart.basis @ direction)[None]) @ chart.basis
    across = np.concatenate([across, chart.held])
    z = guess.copy()
    k = len(chart.rows)
    matrix = np.empty((system.dof, system.dof))
    residual = np.empty(system.dof)
    for _ in range(_ITERATIONS):
        placed = system.place(z[None])
        (residual[:k],), (matrix[:k],) = equations(system, placed, chart.rows)
        (residual[k],), (matrix[k],) = _event(system, candidate, z[None], placed)
        matrix[k + 1 :] = across
        residual[k + 1 :] = across @ (z - chart.origin)
        try:
            step = np.linalg.solve(matrix, residual)
        except np.linalg.LinAlgError:
            return None
        z = z - step
        change = float(np.abs(step).max())
        if change < CONVERGED:
            return z
        if not change <= _ASTRAY:
            return None
    return None


def _event(
    system: ContactSystem, candidate: Candidate, z: FloatArray, placed: Placement
) -> tuple[FloatArray, FloatArray]:
    """Function whose root the event is, and its gradient.

    Args:
        system: Compiled problem.
        candidate: The event.
        z: Shape (s, 3 + n).
        placed: The features at z.

    Returns:
        Values, shape (s,), and gradients, shape (s, 3 + n).
    """
    if candidate.kind is EventKind.JOINT_LIMIT:
        column = 3 + candidate.index
        unit = np.eye(system.dof)[column]
        return z[:, column] - candidate.target, np.tile(unit, (len(z), 1))
    pair = np.array([candidate.index], dtype=np.intp)
    if candidate.kind in (EventKind.FLUSH_AFTER, EventKind.FLUSH_BEFORE):
        side = 0 if candidate.kind is EventKind.FLUSH_AFTER else 1
        value = wedge_lifts(system, placed, pair)[side]
        gradient = wedge_lift_gradients(system, placed, pair)[side]
    elif candidate.kind is EventKind.EDGE_END:
        value = gaps(system, placed, pair).offset - candidate.target
        gradient = offset_gradients(system, placed, pair)
    else:
        value = gaps(system, placed, pair).gap
        gradient = gap_gradients(system, placed, pair)
    return value[:, 0], gradient[:, 0]
