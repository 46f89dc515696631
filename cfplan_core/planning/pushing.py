"""Push a configuration along a drive, through as many contact formations as it takes.

Where an event ends a motion, the drive is projected onto the ways out of the configuration
(`cfplan_core.planning.branching`) and goes on along the one that serves it best, so that contacts
are made and broken as the drive needs.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator

import numpy as np

from cfplan_core.contact.detection import touching
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.gaps import gaps
from cfplan_core.contact.system import BoolArray, IntArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import Stability
from cfplan_core.planning.branching import Branch, branches
from cfplan_core.planning.drives import Drive
from cfplan_core.planning.efforts import within_efforts
from cfplan_core.planning.events import OPEN_EVENTS, EventKind
from cfplan_core.planning.milestones import Milestone, Stretch
from cfplan_core.planning.pieces import SAME, Region
from cfplan_core.planning.stability_classes import split_by_class
from cfplan_core.planning.steering import COMFORT, Helm
from cfplan_core.planning.tracing import Trace, Tracer
from cfplan_core.planning.transitions import Surroundings, surroundings

# Ways out of a configuration that are tried, the best first.
_WAYS = 2
_MOST_EVENTS = 12
_LONGEST = 12.0
# Contacts nearer than this, in m, that are not made are not told apart from those that are, but
# for those that open or close within so many radians and object sizes of an end.
_DISTINCT = 3e-6
_BESIDE = 0.02
# A contact that opens and closes again does so on a motion at least as long as this.
_EXCURSION = 0.15
# and one that makes or breaks a contact is at least as long as this.
_HOP = 0.02
# A configuration on a way is reached this near to it.
_THERE = 1e-10
# A motion counts if it brings at least this part of what is missing.
_PROGRESS = 0.01

# Gives the region, known at a configuration or new, that a stretch leads into from there.
Classifier = Callable[[list[Region], Formation, Stability], Region]
# Says why contacts, shape (k,), of which some are together, shape (k, k), may not touch; or None.
Refusal = Callable[[IntArray, BoolArray], 'str | None']


class Pusher:
    """Pushes along drives, under one tracer."""

    def __init__(
        self,
        tracer: Tracer,
        failures: Counter[str],
        region_of: Classifier,
        refusal: Refusal = lambda pairs, together: None,
    ) -> None:
        """Prepare.

        Args:
            tracer: Follows motions.
            failures: Counts why ways out are not taken.
            region_of: Names the connected piece that a motion lies in.
            refusal: Refuses configurations for what touches there.
        """
        self._tracer = tracer
        self._helm = Helm(tracer)
        self._failures = failures
        self._region_of = region_of
        self._refusal = refusal
        self.attempts = 0

    def push(
        self, begin: Milestone, drive: Drive, keep_on_edges: bool, most: int = _MOST_EVENTS
    ) -> Iterator[Milestone]:
        """Push from a milestone; yields the milestones that are reached, one after the other."""
        at = begin
        for _ in range(most):
            rest = drive.remaining(at.z)
            if rest < SAME:
                return
            reached = self._step(at, drive, keep_on_edges, rest)
            if reached is None:
                return
            yield reached
            at = reached

    def _step(
        self, at: Milestone, drive: Drive, keep_on_edges: bool, rest: float
    ) -> Milestone | None:
        tracer = self._tracer
        ways = branches(at.around, tracer, self._helm, drive, keep_on_edges, self._failures)
        for branch in [way for way in ways if way.gain > _PROGRESS * min(rest, 0.3)][:_WAYS]:
            reached = self._follow(at, branch, drive, keep_on_edges)
            if reached is not None and drive.remaining(reached.z) < rest * (1.0 - _PROGRESS):
                return reached
        return None

    def _follow(
        self, at: Milestone, branch: Branch, drive: Drive, keep_on_edges: bool
    ) -> Milestone | None:
        way = branch.departure
        self.attempts += 1
        steer = self._helm.steering(way.formation, drive, keep_on_edges, heading=branch.ahead)
        trace = self._tracer.follow(way.formation, at.z, steer, way.departing, longest=_LONGEST)
        return self._arrival(at, way.formation, trace)

    def along(self, at: Milestone, formation: Formation, way: FloatArray) -> Milestone | None:
        """Go from a milestone through given configurations to the last of them, in straight lines.

        Args:
            at: Where to begin.
            formation: The contacts that are kept; the straight lines lie on its manifold.
            way: Shape (w, 3 + n).

        Returns:
            The last configuration; None if an event ends the motion before.
        """
        rest = list(way)

        def steer(z: FloatArray, basis: FloatArray) -> FloatArray | None:
            while rest and np.abs(rest[0] - z).max() < _THERE:
                rest.pop(0)
            return rest[0] - z if rest else None

        self.attempts += 1
        departing = frozenset(at.around.pairs.tolist()) - set(formation.pairs)
        trace = self._tracer.follow(formation, at.z, steer, departing)
        if np.abs(trace.end - way[-1]).max() > SAME:
            self._failures[trace.kind.value] += 1
            return None
        reached = self._arrival(at, formation, trace)
        if reached is None or np.abs(reached.z - way[-1]).max() > SAME:
            return None
        return reached

    def _arrival(self, at: Milestone, formation: Formation, trace: Trace) -> Milestone | None:
        """The milestone where a motion inside a formation ends, so far as it may be used."""
        points = trace.points
        if trace.kind is EventKind.UNSTABLE:
            points = self._comfortable(formation, points)
        points = self._strong(formation, points)
        points = self._distinct(at, formation, points, trace.kind in OPEN_EVENTS)
        if np.abs(points[-1] - at.z).max() < SAME:
            self._failures[f'at once, {trace.kind.value}'] += 1
            return None
        points, around = self._allowed(points)
        if around is None:
            return None
        before, after = set(at.around.pairs.tolist()), set(around.pairs.tolist())
        extent = float(np.abs(points - at.z).max())
        for shortest, opened in ((_EXCURSION, before & after), (_HOP, before | after)):
            if extent < shortest and opened - set(formation.pairs):
                self._failures['a contact would open for an instant only'] += 1
                return None
        if trace.kind is not EventKind.TARGET:
            self._failures[trace.kind.value] += 1
        stretches = []
        known = at.entered
        for stability, part in split_by_class(self._tracer, formation, points):
            region = self._region_of(known, formation, stability)
            stretches.append(Stretch(formation, stability, part, region))
            known = [region]
        return Milestone(points[-1], around, at, tuple(stretches), known)

    def _allowed(self, points: FloatArray) -> tuple[FloatArray, Surroundings | None]:
        """Points up to their end or, if that is refused, to some way before it."""
        away = np.abs(points - points[-1]).max(axis=1)
        for last in (len(points) - 1, int(np.argmax(away < _BESIDE)) - 1):
            if last > 0:
                around = surroundings(self._tracer.system, points[last])
                refusal = self._refusal(around.pairs, around.together)
                if refusal is None:
                    return points[: last + 1], around
                self._failures[refusal] += 1
        return points, None

    def _comfortable(self, formation: Formation, points: FloatArray) -> FloatArray:
        """Points of a motion that ran out of stability up to where there was plenty left."""
        margins = self._tracer.margins(formation, points).stable
        plenty = np.flatnonzero(margins > 0.5 * min(float(margins[0]), COMFORT))
        return points[: int(plenty[-1]) + 1] if len(plenty) else points[:1]

    def _distinct(
        self, at: Milestone, formation: Formation, points: FloatArray, event: bool
    ) -> FloatArray:
        """Points up to where another contact nearly touches without being made.

        Near the start contacts of the milestone open, near an event those of the event close.
        """
        system = self._tracer.system
        near = _DISTINCT / system.size
        placed = system.place(points)
        contacts = slice(0, system.contact_count)
        gap, offset = gaps(system, placed, contacts)
        length = system.pair_length[contacts]
        doubtful = (np.abs(gap) < near) & (offset > -near) & (offset < length + near)
        doubtful[:, formation.array] = False
        away = np.abs(points - points[0]).max(axis=1)
        doubtful[np.ix_(away < _BESIDE, at.around.pairs)] = False
        if event:
            ahead = np.abs(points - points[-1]).max(axis=1) < _BESIDE
            doubtful[np.ix_(ahead, touching(system, points[-1], near))] = False
        for index in np.flatnonzero(doubtful.any(axis=1)):
            others = set(touching(system, points[index], near).tolist())
            if (others - set(formation.pairs)) & set(np.flatnonzero(doubtful[index]).tolist()):
                self._failures['a contact would nearly be made'] += 1
                return points[: max(1, int(index))]
        return points

    def _strong(self, formation: Formation, points: FloatArray) -> FloatArray:
        """Points up to where a joint would exceed its effort limit."""
        system = self._tracer.system
        holds = within_efforts(system, self._tracer.model, formation, points)
        if holds.all():
            return points
        self._failures['a joint would exceed its effort limit'] += 1
        return points[: max(1, int(np.argmin(holds)))]
