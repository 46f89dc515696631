"""Steer a motion along a drive, inside what holds: limits, links, edges, stability.

The displacement of a stretch is the one on the formation's tangent space that serves the drive
best among those that use up only a part of every distance left: to joint limits, to other links,
to contacts that shall not close, to ends of edges, and to the loss of stability. These are
linearised; whatever a stretch runs into none the less ends it as an event
(`cfplan_core.planning.tracing`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cfplan_core.contact.formation import Formation
from cfplan_core.contact.gaps import (
    gap_gradients,
    gaps,
    offset_gradients,
    wedge_lift_gradients,
    wedge_lifts,
)
from cfplan_core.contact.system import IntArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.drives import Drive
from cfplan_core.planning.least_squares import constrained_minimum
from cfplan_core.planning.tracing import Steering, Tracer

# Longest displacement, in radians and object sizes, of a stretch.
REACH = 0.3
# Part of a distance left that one stretch may use up.
_USED = 0.7
# Gaps and lifts above this are not looked at; beyond an edge's ends by this they are.
_NEAR = 0.5
_BEYOND = 0.1
_MOST_GAPS = 24
# Distance, in object sizes, that is kept where nothing shall touch.
_CLEARANCE = 0.004
# Stability margin that a steered motion keeps if it can.
COMFORT = 0.02
_DIFFERENCE = 1e-6
# A drive ends where less than this part of what it asks for is allowed.
_BLOCKED = 0.03
_ARRIVED = 1e-10
# and where a stretch brings less than this part of what is missing.
_LEAST_PROGRESS = 0.002
_PLACES = np.array([0.0, 0.125, 0.25, 0.5, 0.75, 1.0])
_DAMPING = 1e-9


@dataclass(frozen=True, eq=False)
class Limits:
    """Inequalities rows · t ≥ bounds for a displacement t.

    Attributes:
        rows: Shape (m, 3 + n).
        bounds: Shape (m,).
    """

    rows: FloatArray
    bounds: FloatArray

    def with_rows(self, rows: FloatArray, bounds: FloatArray) -> Limits:
        """Add further inequalities."""
        return Limits(np.concatenate([self.rows, rows]), np.concatenate([self.bounds, bounds]))


def displacement(
    drive: Drive, z: FloatArray, basis: FloatArray, limits: Limits
) -> FloatArray | None:
    """Best displacement of a stretch.

    Args:
        drive: What is wanted.
        z: Shape (3 + n,).
        basis: Tangent basis, shape (d, 3 + n).
        limits: What is allowed.

    Returns:
        Shape (3 + n,), no coordinate larger than `REACH` without limits, or None if nothing is
        allowed.
    """
    rows, values = drive.task(z)
    reduced = rows @ basis.T
    h_matrix = reduced.T @ reduced + _DAMPING * np.eye(len(basis))
    f = reduced.T @ values
    free = np.linalg.solve(h_matrix, f) @ basis
    largest = float(np.abs(free).max())
    if largest > REACH:
        f = f * (REACH / largest)
    along = constrained_minimum(h_matrix, f, limits.rows @ basis.T, limits.bounds)
    if along is None:
        return None
    ahead = np.asarray(along @ basis)
    largest = float(np.abs(ahead).max())
    return ahead if largest <= 2.0 * REACH else ahead * (2.0 * REACH / largest)


def gained(drive: Drive, z: FloatArray, ahead: FloatArray) -> float:
    """How much of what a drive wants a displacement brings, by its least squares."""
    rows, values = drive.task(z)
    return float(np.linalg.norm(values) - np.linalg.norm(rows @ ahead - values))


class Helm:
    """Steers the motions of one tracer."""

    def __init__(self, tracer: Tracer) -> None:
        """Steer for a tracer."""
        self._tracer = tracer
        self._system = tracer.system
        self._movable = np.flatnonzero(tracer.system.moves.any(axis=1))

    def steering(
        self,
        formation: Formation,
        drive: Drive,
        keep_on_edges: bool,
        departing: frozenset[int] = frozenset(),
        heading: FloatArray | None = None,
    ) -> Steering:
        """Steering for `Tracer.follow`.

        Args:
            formation: The contacts that are kept.
            drive: What is wanted.
            keep_on_edges: True if contacts shall not slide off their edges.
            departing: Pairs that touch at the start and open.
            heading: First displacement, if it is known already.
        """
        first = heading
        least = np.inf

        def steer(z: FloatArray, basis: FloatArray) -> FloatArray | None:
            nonlocal first, least
            self._tracer.checkpoint()
            rest = drive.remaining(z)
            if rest > (1.0 - _LEAST_PROGRESS) * least:
                return None
            least = rest
            if first is not None:
                ahead, first = first, None
                return self._steady(formation, z, ahead)
            limits = self.limits(formation, drive, z, basis, keep_on_edges)
            found = displacement(drive, z, basis, limits)
            if found is None or np.abs(found).max() <= _ARRIVED:
                return None
            if rest > 1e-4 and gained(drive, z, found) < _BLOCKED * min(rest, 0.1):
                return None
            return self._steady(formation, z, found)

        return steer

    def _steady(self, formation: Formation, z: FloatArray, ahead: FloatArray) -> FloatArray:
        """Shorten a displacement so that the margin of stability holds all along it."""
        margins = self._tracer.margins(formation, z + _PLACES[:, None] * ahead).stable
        poor = margins[1:] < 0.5 * min(float(margins[0]), COMFORT)
        return ahead * float(_PLACES[max(1, int(np.argmax(poor)))]) if poor.any() else ahead

    def limits(
        self,
        formation: Formation,
        drive: Drive,
        z: FloatArray,
        basis: FloatArray,
        keep_on_edges: bool,
        ignored: frozenset[int] = frozenset(),
    ) -> Limits:
        """Inequalities for a displacement from z, shape (3 + n,), inside a formation.

        Args:
            formation: The contacts that are kept.
            drive: Tells which contacts may close.
            z: Where.
            basis: Tangent basis, shape (d, 3 + n).
            keep_on_edges: True if contacts shall not slide off their edges.
            ignored: Pairs whose gaps are not looked at.
        """
        joints = self._joint_limits(z)
        near = self._near_gaps(formation, drive, z, ignored)
        stable = self._stability(formation, z, basis)
        limits = joints.with_rows(near.rows, near.bounds).with_rows(stable.rows, stable.bounds)
        if keep_on_edges:
            edges = self._edges(formation, z)
            limits = limits.with_rows(edges.rows, edges.bounds)
        return limits

    def _joint_limits(self, z: FloatArray) -> Limits:
        system = self._system
        unit = np.eye(system.dof)[3:]
        below, above = z[3:] - system.lower, system.upper - z[3:]
        low, high = np.flatnonzero(below < 2.0 * REACH), np.flatnonzero(above < 2.0 * REACH)
        bounds = np.concatenate([below[low], above[high]])
        return Limits(np.concatenate([unit[low], -unit[high]]), -0.9 * np.maximum(bounds, 0.0))

    def _near_gaps(
        self, formation: Formation, drive: Drive, z: FloatArray, ignored: frozenset[int]
    ) -> Limits:
        """Keep links apart, and contacts open that shall not close."""
        system = self._system
        placed = system.place(z[None])
        first = 0 if drive.closing is not None else system.contact_count
        gap, offset = (values[0] for values in gaps(system, placed, slice(first, None)))
        length = system.pair_length[first:]
        # Links may touch, and must not come nearer; contacts that touch are judged elsewhere.
        lowest = np.where(np.arange(first, first + len(gap)) < system.contact_count, 0.0, -1e-7)
        near = (gap > lowest) & (gap < _NEAR) & (offset > -_BEYOND) & (offset < length + _BEYOND)
        pairs = np.flatnonzero(near)
        pairs = pairs[np.argsort(gap[pairs], kind='stable')]
        open_gap = gap[pairs]
        pairs = pairs + first
        skipped = {*formation.pairs, *(drive.closing or ()), *ignored}
        wanted = np.array([int(pair) not in skipped for pair in pairs], dtype=bool)
        pairs, open_gap = pairs[wanted][:_MOST_GAPS], open_gap[wanted][:_MOST_GAPS]
        return Limits(
            gap_gradients(system, placed, pairs)[0],
            -_USED * np.maximum(open_gap - _CLEARANCE, 0.0),
        )

    def _edges(self, formation: Formation, z: FloatArray) -> Limits:
        """Keep contacts on their edges, and edges beside touching vertices off them."""
        system = self._system
        kept: IntArray = formation.array
        placed = system.place(z[None])
        offset = gaps(system, placed, kept).offset[0]
        slide = offset_gradients(system, placed, kept)[0]
        rest = system.pair_length[kept] - offset
        lifts = wedge_lifts(system, placed, kept)
        turns = wedge_lift_gradients(system, placed, kept)
        left = np.concatenate([offset, rest, lifts[0][0], lifts[1][0]])
        rows = np.concatenate([slide, -slide, turns[0][0], turns[1][0]])
        # Those that are used up already are for the departure to judge.
        inside = left > 1e-7
        return Limits(rows[inside], -_USED * np.maximum(left[inside] - _CLEARANCE, 0.0))

    def _stability(self, formation: Formation, z: FloatArray, basis: FloatArray) -> Limits:
        margin, slope = self.margin_slope(formation, z, basis)
        return Limits(slope[None], np.array([-max(0.0, _USED * (margin - COMFORT))]))

    def margin_slope(
        self, formation: Formation, z: FloatArray, basis: FloatArray
    ) -> tuple[float, FloatArray]:
        """Stability margin of a formation and its gradient along a tangent basis, (3 + n,)."""
        points = np.concatenate([z[None], z + _DIFFERENCE * basis])
        margins = self._tracer.margins(formation, points).stable
        return float(margins[0]), (margins[1:] - margins[0]) / _DIFFERENCE @ basis
