"""Follow a contact formation along a curve to the event that ends it.

The curve is the formation's manifold itself where that has dimension one, and a path steered in
the manifold where it has more. It is followed in stretches: a whole stretch of steps along the
tangent is projected onto the manifold by one batched Newton iteration, searched for events, and
cut at the first.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cfplan_core.contact.curvature import wrench_rates
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.gaps import gap_gradients, gaps, wedge_lifts
from cfplan_core.contact.system import ContactSystem, IntArray, Placement
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import ContactModel, Margins, Stability
from cfplan_core.planning.bounds import Bound
from cfplan_core.planning.bracketing import enclose
from cfplan_core.planning.equations import (
    equation_gradients,
    formation_rows,
    is_second_order,
)
from cfplan_core.planning.events import Candidate, EventKind, sight
from cfplan_core.planning.locating import locate
from cfplan_core.planning.manifold import Chart, formation_equations, tangent_basis

# Margins below this count as lost: nothing is planned that is held by less.
STABILITY_MARGIN = 1e-6
# Distance, in radians and object sizes, of successive points on a curve.
STEP = 0.04
_STRETCH = 10
_SMALLEST_STEP = 1e-7
_INNER = np.array([0.25, 0.5, 0.75])
# Bounds are looked at between samples, too, where they come nearer than this.
_NARROW = 0.1
LONGEST = 100.0

# Chooses the motion from a configuration and the tangent basis there: a vector in the span of the
# basis, beyond whose length it is asked again, or None where there is nowhere left to go.
Steering = Callable[[FloatArray, FloatArray], 'FloatArray | None']


@dataclass(frozen=True, eq=False)
class Trace:
    """A followed curve.

    Attributes:
        points: Shape (s, 3 + n), from the start to the event, both included.
        kind: What ended it.
        pairs: The pairs that closed or reached their edge's end; a joint's index for a limit.
        why: Says what ended it: the event, or which bound was reached.
    """

    points: FloatArray
    kind: EventKind
    pairs: tuple[int, ...] = ()
    why: str = ''

    @property
    def end(self) -> FloatArray:
        """Last configuration."""
        return np.asarray(self.points[-1])


def classify(margins: Margins) -> Stability:
    """Name the stability class of the first configuration of a batch."""
    if not margins.stable[0] > STABILITY_MARGIN:
        return Stability.UNSTABLE
    if margins.second_order:
        return Stability.SECOND_ORDER
    if margins.form_closure[0] > STABILITY_MARGIN:
        return Stability.FORM_CLOSURE
    return Stability.FORCE_CLOSURE


def stability_margins(
    system: ContactSystem,
    model: ContactModel,
    z: FloatArray,
    gradients: FloatArray,
    pairs: IntArray,
) -> Margins:
    """Judge the stability of contacts, of two by second order.

    Args:
        system: Compiled problem.
        model: Mechanics.
        z: Shape (s, 3 + n).
        gradients: Shape (s, k, 3 + n), of the contacts' gaps there.
        pairs: The contacts, shape (k,).
    """
    if not is_second_order(pairs):
        return model.margins(gradients)
    return model.second_order_margins(gradients, wrench_rates(system, system.place(z), pairs))


class Tracer:
    """Follows curves of one system under one contact model."""

    def __init__(
        self,
        system: ContactSystem,
        model: ContactModel,
        checkpoint: Callable[[], None] = lambda: None,
        bounds: Sequence[Bound] = (),
    ) -> None:
        """Prepare.

        Args:
            system: Compiled problem.
            model: Judges stability.
            checkpoint: Called before every stretch; may raise to interrupt.
            bounds: What a motion must stay within, besides stable; it ends where it does not.
        """
        self.system = system
        self.model = model
        self.checkpoint = checkpoint
        self.bounds = tuple(bounds)

    def margins(self, formation: Formation, z: FloatArray) -> Margins:
        """Stability margins of a formation at configurations of shape (s, 3 + n)."""
        pairs = formation.array
        return self.judge(z, self.gradients(z, pairs), pairs)

    def judge(self, z: FloatArray, gradients: FloatArray, pairs: IntArray) -> Margins:
        """Stability margins, lowered to those of the bounds.

        Args:
            z: Shape (s, 3 + n).
            gradients: Shape (s, k, 3 + n), of the gaps of the contacts there.
            pairs: These contacts, shape (k,).
        """
        margins = stability_margins(self.system, self.model, z, gradients, pairs)
        for bound in self.bounds:
            margins = margins._replace(
                stable=np.minimum(margins.stable, bound.margins(z, gradients))
            )
        return margins

    def binding(self, z: FloatArray, gradients: FloatArray, pairs: IntArray) -> Bound | None:
        """Which bound ends a motion at a configuration; None if stability does.

        Args:
            z: Shape (1, 3 + n).
            gradients: Shape (1, k, 3 + n).
            pairs: The contacts, shape (k,).
        """
        tightest = None
        margins = stability_margins(self.system, self.model, z, gradients, pairs)
        least = float(margins.stable[0])
        for bound in self.bounds:
            margin = float(bound.margins(z, gradients)[0])
            if margin < least:
                tightest, least = bound, margin
        return tightest

    def gradients(self, z: FloatArray, pairs: IntArray) -> FloatArray:
        """Gap gradients of pairs at configurations of shape (s, 3 + n)."""
        return gap_gradients(self.system, self.system.place(z), pairs)

    def follow(
        self,
        formation: Formation,
        start: FloatArray,
        steer: Steering,
        departing: frozenset[int] = frozenset(),
        longest: float = LONGEST,
        held: tuple[int, ...] = (),
    ) -> Trace:
        """Follow a formation until an event.

        Args:
            formation: The contacts that are kept.
            start: Configuration on its manifold, shape (3 + n,).
            steer: Chooses the direction at the beginning of every stretch.
            departing: Other pairs that touch at the start and open.
            longest: Stop with `EventKind.FAR` after this length.
            held: Columns of z that do not change.
        """
        return _Pursuit(self, formation, start, steer, departing, longest, held).run()


class _Pursuit:
    """State of following one curve."""

    def __init__(
        self,
        tracer: Tracer,
        formation: Formation,
        start: FloatArray,
        steer: Steering,
        departing: frozenset[int],
        longest: float,
        held: tuple[int, ...],
    ) -> None:
        self.tracer = tracer
        self.system = tracer.system
        self.checkpoint = tracer.checkpoint
        self._gradients = tracer.gradients
        self.formation = formation
        self.contacts = formation.array
        self.start = start
        self.steer = steer
        self.departing = departing
        self.longest = longest
        self.points = [start[None]]
        self.step = STEP
        self.fresh = True
        self.rows, _ = formation_equations(self.system, self.contacts, start)
        self.redundant = len(self.rows) < len(formation_rows(self.contacts))
        self.held = np.eye(self.system.dof)[list(held)]
        self.chart = self._chart(start)

    def run(self) -> Trace:
        z = self.start
        length = 0.0
        while length < self.longest:
            self.checkpoint()
            direction = self.steer(z, self.chart.basis)
            if direction is None:
                return self._finish(EventKind.TARGET)
            samples = self._stretch(z, direction)
            if samples is None:
                return self._finish(EventKind.LOST)
            ended = self._advance(samples, direction)
            if ended is not None:
                return ended
            if length > 4.0 * STEP and self._returned(self.points[-1]):
                return self._finish(EventKind.CLOSED)
            z = self.points[-1][-1]
            length += float(np.abs(z - samples[0]).max())
        return self._finish(EventKind.FAR)

    def _returned(self, samples: FloatArray) -> bool:
        """Tell whether a closed curve has come back to its start."""
        return bool(np.abs(samples - self.start).max(axis=1).min() < 0.75 * STEP)

    def _finish(
        self, kind: EventKind, pairs: tuple[int, ...] = (), last: FloatArray | None = None
    ) -> Trace:
        """The trace so far; `last`, shape (1, 3 + n), is where the end was seen if not there."""
        points, why = np.concatenate(self.points), kind.value
        if kind is EventKind.UNSTABLE and self.tracer.bounds:
            at = points[-1:] if last is None else last
            gradients = self._gradients(at, self.contacts)
            bound = self.tracer.binding(at, gradients, self.contacts)
            why = why if bound is None else bound.reason
        return Trace(points, kind, pairs, why)

    def _stretch(self, z: FloatArray, direction: FloatArray) -> FloatArray | None:
        """Points ahead along a direction, shape (s, 3 + n), z first; None if there are none."""
        while self.step > _SMALLEST_STEP:
            reach = float(np.abs(direction).max())
            count = min(_STRETCH, max(1, int(np.ceil(reach / self.step))))
            steps = np.arange(1, count + 1) * min(self.step / reach, 1.0 / count)
            if self.fresh:
                # A short first step shows what holds just behind the start.
                steps = np.concatenate([[0.02 * steps[0]], steps])
            found = self.chart.project(z + steps[:, None] * direction)
            samples = np.concatenate([z[None], found.points])
            change = np.abs(np.diff(samples, axis=0)).max(axis=1)
            smooth = found.converged & (change < 1.5 * self.step)
            good = int(np.argmin(smooth)) if not smooth.all() else len(smooth)
            if good > (1 if self.fresh else 0):
                if good < len(smooth):
                    self.step *= 0.5
                return samples[: good + 1]
            self.step *= 0.25
        return None

    def _advance(self, samples: FloatArray, direction: FloatArray) -> Trace | None:
        """Take the samples up to the first event; return the finished trace if there is one."""
        placed = self.system.place(samples)
        gradients = gap_gradients(self.system, placed, self.contacts)
        if self.fresh:
            for kind, pairs in (
                (EventKind.CONTACT, sorted(self.departing)),
                (EventKind.LINKS_MEET, self._meeting_links(placed)),
            ):
                overlapping = self._overlapping(samples[1:2], pairs)
                if overlapping:
                    return self._finish(kind, overlapping)
            just_behind = self.system.place(samples[1:2])
            if np.min(wedge_lifts(self.system, just_behind, self.contacts)) < -1e-9:
                # An edge that lay flush would dip into the edge that its vertex touches.
                return self._finish(EventKind.CONTACT, self.formation.pairs)
        sighting = sight(self.system, self.formation, samples, placed)
        margins = self.tracer.judge(samples, gradients, self.contacts)
        samples, stable = self._watch(samples, margins, sighting.interval)
        lost = int(np.argmax(stable[1:] <= 0.0)) if (stable[1:] <= 0.0).any() else len(stable)
        if self.fresh and lost == 0:
            return self._finish(EventKind.UNSTABLE, last=samples[1:2])
        if self.fresh and self.tracer.bounds and self._out_of_bounds(samples[:1]):
            return self._finish(EventKind.UNSTABLE)
        if self.redundant:
            apart = np.abs(gaps(self.system, placed, self.contacts).gap).max(axis=1) > 1e-7
            if apart.any() and int(np.argmax(apart)) <= min(lost, sighting.interval):
                return self._finish(EventKind.LOST)
        if lost < sighting.interval or (lost == sighting.interval and not sighting.closer):
            candidates = sighting.candidates if lost == sighting.interval else ()
            ended = self._end(samples, lost, candidates, direction, unstable=True)
            if ended is not None:
                return ended
        elif sighting.closer and self.step > STEP / 100:
            interval = max(sighting.interval, 1)
            self._take(samples[1 : interval + 1])
            self.step *= 0.125
        elif sighting.candidates:
            ended = self._end(samples, sighting.interval, sighting.candidates, direction)
            if ended is not None:
                return ended
        else:
            self._take(samples[1:])
            self.step = min(2.0 * self.step, STEP)
        self.chart = self._chart(self.points[-1][-1])
        return None

    def _watch(
        self, samples: FloatArray, margins: Margins, last: int
    ) -> tuple[FloatArray, FloatArray]:
        """Look between samples, up to an interval, where stability may be lost and regained.

        Returns:
            The samples, cut behind a point that is not stable if there is one, and by how much
            each is stable.
        """
        stable = margins.stable - STABILITY_MARGIN
        turns = (margins.signs[1:] != margins.signs[:-1]).any(axis=1)
        if self.tracer.bounds or margins.second_order:
            lowest = (stable[1:-1] <= stable[:-2]) & (stable[1:-1] <= stable[2:])
            lowest &= stable[1:-1] < _NARROW
            turns[:-1] |= lowest
            turns[1:] |= lowest
        suspects = turns & (stable[1:] > 0.0) & (stable[:-1] > 0.0)
        suspects[last + 1 :] = False
        for interval in np.flatnonzero(suspects):
            ends = samples[interval], samples[interval + 1]
            between = self.chart.between(*ends, _INNER)
            inner = self.tracer.margins(self.formation, between).stable
            if (inner <= STABILITY_MARGIN).any():
                first = int(np.argmax(inner <= STABILITY_MARGIN))
                samples = np.concatenate([samples[: interval + 1], between[first : first + 1]])
                return samples, np.append(stable[: interval + 1], -STABILITY_MARGIN)
        return samples, stable

    def _out_of_bounds(self, z: FloatArray) -> bool:
        """Tell whether a configuration of shape (1, 3 + n) breaks a bound."""
        gradients = self._gradients(z, self.contacts)
        return any(
            not bound.margins(z, gradients)[0] > STABILITY_MARGIN for bound in self.tracer.bounds
        )

    def _take(self, samples: FloatArray) -> None:
        self.points.append(samples)
        self.fresh = False

    def _chart(self, z: FloatArray) -> Chart:
        gradients = equation_gradients(self.system, z[None], self.rows)[0]
        basis = tangent_basis(np.concatenate([gradients, self.held]))
        return Chart(self.system, self.rows, z, basis, self.held)

    def _overlapping(self, z: FloatArray, pairs: list[int]) -> tuple[int, ...]:
        """Those of some pairs, which touch at the start, that overlap just behind it."""
        if not pairs:
            return ()
        chosen = np.array(pairs, dtype=np.intp)
        gap, offset = gaps(self.system, self.system.place(z), chosen)
        within = (offset >= 0.0) & (offset <= self.system.pair_length[chosen])
        return tuple(int(pair) for pair in chosen[(within & (gap < -1e-12))[0]])

    def _meeting_links(self, placed: Placement) -> list[int]:
        """Pairs of links that touch at the start."""
        first = self.system.contact_count
        start = Placement(*(feature[:1] for feature in placed))
        gap, offset = gaps(self.system, start, slice(first, None))
        length = self.system.pair_length[first:]
        touching = (np.abs(gap[0]) < 1e-8) & (offset[0] > -1e-8) & (offset[0] < length + 1e-8)
        return [first + int(k) for k in np.flatnonzero(touching)]

    def _end(
        self,
        samples: FloatArray,
        interval: int,
        candidates: tuple[Candidate, ...],
        direction: FloatArray,
        unstable: bool = False,
    ) -> Trace | None:
        """Locate the first of the events in an interval and finish, or go on if it was none."""
        before, after = samples[interval], samples[interval + 1]
        unit = direction / float(direction @ direction)

        def along(z: FloatArray) -> float:
            return float((z - samples[0]) @ unit)

        located: list[tuple[float, FloatArray, EventKind, int]] = []
        if unstable:
            edge = self._locate_loss(self.chart, before, after)
            located.append((along(edge), edge, EventKind.UNSTABLE, -1))
        tried: set[tuple[EventKind, int]] = set()
        while candidates:
            for candidate in candidates:
                tried.add((candidate.kind, candidate.index))
                z = locate(self.chart, candidate, before, after, direction)
                if z is not None:
                    located.append((along(z), z, candidate.kind, candidate.index))
            if not located:
                break
            # A gap may have closed and, beyond the edge of its contact, opened again before.
            _, after, _, _ = min(located, key=lambda item: item[0])
            both = np.stack([before, after])
            sighting = sight(self.system, self.formation, both, self.system.place(both))
            candidates = tuple(c for c in sighting.candidates if (c.kind, c.index) not in tried)
        self._take(samples[1 : interval + 1])
        if not located:
            self._take(samples[interval + 1 : interval + 2])
            return None
        at, z, kind, _ = min(located, key=lambda item: item[0])
        together = tuple(sorted(i for s, _, k, i in located if k is kind and s <= at + 1e-9))
        self._take(z[None])
        return self._finish(kind, together)

    def _locate_loss(self, chart: Chart, before: FloatArray, after: FloatArray) -> FloatArray:
        """Find the last stable configuration between two points of which the first is stable."""

        def margin(places: FloatArray) -> FloatArray:
            between = chart.between(before, after, places)
            return self.tracer.margins(self.formation, between).stable - STABILITY_MARGIN

        place = np.array([enclose(margin)[0]])
        return np.asarray(chart.between(before, after, place)[0])
