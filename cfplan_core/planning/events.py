"""What ends a stretch of motion inside a contact formation, found on sampled configurations.

A sampled stretch is searched for the first interval in which one of these happens; the exact
place is then found by root finding (`cfplan_core.planning.tracing`).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np

from cfplan_core.contact.formation import Formation
from cfplan_core.contact.gaps import gaps, wedge_lifts
from cfplan_core.contact.system import ContactSystem, IntArray, Placement
from cfplan_core.geometry.polygon import FloatArray

# Offsets at a crossing are interpolated: how far outside an edge one still gets a closer look.
_OFFSET_SLACK = 0.01
# A gap whose interpolated minimum lies below this between samples gets a closer look.
_GRAZE = 1e-6
_NEAR = 1e-9


class EventKind(str, Enum):
    """Why a motion cannot simply go on."""

    CONTACT = 'a gap closes'
    EDGE_END = 'a contact reaches the end of its edge'
    FLUSH_AFTER = 'an edge behind a touching vertex comes to lie on an edge'
    FLUSH_BEFORE = 'an edge before a touching vertex comes to lie on an edge'
    UNSTABLE = 'stability is lost'
    JOINT_LIMIT = 'a joint reaches its limit'
    LINKS_MEET = 'two links meet'
    CLOSED = 'the curve closes'
    FAR = 'the path is long enough'
    TARGET = 'the target is reached'
    LOST = 'the curve cannot be followed'


# Events behind which other contact formations may lie.
OPEN_EVENTS = frozenset(
    {
        EventKind.CONTACT,
        EventKind.EDGE_END,
        EventKind.FLUSH_AFTER,
        EventKind.FLUSH_BEFORE,
    }
)


@dataclass(frozen=True)
class Candidate:
    """An event that happens between two samples, to be located.

    Attributes:
        kind: What happens.
        index: Pair or joint index.
        target: Value of the offset or joint angle at the event.
        fraction: Estimated place in the interval, 0 to 1.
    """

    kind: EventKind
    index: int
    target: float
    fraction: float


class Sighting(NamedTuple):
    """The first interval of a stretch with events.

    Attributes:
        interval: Index of the sample before it; number of intervals if there is none.
        candidates: What may happen in it.
        closer: True if the interval needs finer samples first: a gap may graze zero.
    """

    interval: int
    candidates: tuple[Candidate, ...]
    closer: bool


def sight(
    system: ContactSystem,
    formation: Formation,
    z: FloatArray,
    placed: Placement,
) -> Sighting:
    """Find the first interval in which geometry ends a motion.

    Args:
        system: Compiled problem.
        formation: The contacts that are kept.
        z: Shape (s, 3 + n), successive configurations.
        placed: The features at z.
    """
    gap, offset = gaps(system, placed, slice(None))
    found: list[tuple[int, Candidate]] = []
    kept = formation.array
    found += _closing_gaps(system, gap, offset, kept)
    found += _edge_ends(system, offset[:, kept], kept)
    found += _flush_edges(system, placed, kept)
    found += _joint_limits(system, z)
    grazing = _first_graze(system, gap, offset, kept)
    first = min((interval for interval, _ in found), default=len(z) - 1)
    if grazing < first:
        return Sighting(grazing, (), True)
    return Sighting(first, tuple(c for interval, c in found if interval == first), False)


def _closing_gaps(
    system: ContactSystem,
    gap: FloatArray,
    offset: FloatArray,
    kept: IntArray,
) -> list[tuple[int, Candidate]]:
    """Gaps that close within their edge; those that are closed at the first sample open."""
    closes = (gap[:-1] > _NEAR) & (gap[1:] <= _NEAR)
    closes[:, kept] = False
    if not closes.any():
        return []
    found = []
    for interval, pair in zip(*np.nonzero(closes), strict=True):
        before, after = gap[interval, pair], gap[interval + 1, pair]
        fraction = before / (before - after)
        at = offset[interval, pair] + fraction * (
            offset[interval + 1, pair] - offset[interval, pair]
        )
        if -_OFFSET_SLACK <= at <= system.pair_length[pair] + _OFFSET_SLACK:
            is_contact = pair < system.contact_count
            kind = EventKind.CONTACT if is_contact else EventKind.LINKS_MEET
            found.append((int(interval), Candidate(kind, int(pair), 0.0, float(fraction))))
    return found


def _edge_ends(
    system: ContactSystem, offset: FloatArray, kept: IntArray
) -> list[tuple[int, Candidate]]:
    """Kept contacts that slide off their edge."""
    length = system.pair_length[kept]
    found = []
    for target, outside in (
        (np.zeros_like(length), offset < -_NEAR),
        (length, offset > length + _NEAR),
    ):
        if not outside.any():
            continue
        for k in np.flatnonzero(outside.any(axis=0)):
            sample = int(np.argmax(outside[:, k]))
            interval = max(sample - 1, 0)
            before = offset[interval, k] - target[k]
            after = offset[interval + 1, k] - target[k]
            fraction = min(max(before / (before - after), 0.0), 1.0) if before != after else 0.0
            found.append(
                (
                    interval,
                    Candidate(EventKind.EDGE_END, int(kept[k]), float(target[k]), float(fraction)),
                )
            )
    return found


def _flush_edges(
    system: ContactSystem, placed: Placement, kept: IntArray
) -> list[tuple[int, Candidate]]:
    """Edges beside a touching vertex that dip into the edge that it touches."""
    found = []
    kinds = (EventKind.FLUSH_AFTER, EventKind.FLUSH_BEFORE)
    for kind, lift in zip(kinds, wedge_lifts(system, placed, kept), strict=True):
        dips = (lift[:-1] > _NEAR) & (lift[1:] < -_NEAR)
        if not dips.any():
            continue
        for k in np.flatnonzero(dips.any(axis=0)):
            interval = int(np.argmax(dips[:, k]))
            before, after = lift[interval, k], lift[interval + 1, k]
            fraction = float(before / (before - after))
            found.append((interval, Candidate(kind, int(kept[k]), 0.0, fraction)))
    return found


def _joint_limits(system: ContactSystem, z: FloatArray) -> list[tuple[int, Candidate]]:
    found = []
    joints = z[:, 3:]
    for limit, outside in (
        (system.lower, joints < system.lower - _NEAR),
        (system.upper, joints > system.upper + _NEAR),
    ):
        for k in np.flatnonzero(outside.any(axis=0)):
            interval = max(int(np.argmax(outside[:, k])) - 1, 0)
            before, after = joints[interval, k] - limit[k], joints[interval + 1, k] - limit[k]
            fraction = min(max(before / (before - after), 0.0), 1.0) if before != after else 0.0
            found.append(
                (
                    interval,
                    Candidate(EventKind.JOINT_LIMIT, int(k), float(limit[k]), float(fraction)),
                )
            )
    return found


def _first_graze(
    system: ContactSystem, gap: FloatArray, offset: FloatArray, kept: IntArray
) -> int:
    """First interval beside a sample whose gap is smallest and, interpolated, may be negative."""
    before, middle, after = gap[:-2], gap[1:-1], gap[2:]
    bend = before - 2.0 * middle + after
    dips = (middle > 0.0) & (before >= middle) & (after >= middle) & (bend > _NEAR)
    bend = np.where(dips, bend, 1.0)
    lowest = middle - 0.125 * (after - before) ** 2 / bend
    inner = offset[1:-1]
    inside = (inner > -_OFFSET_SLACK) & (inner < system.pair_length + _OFFSET_SLACK)
    grazes = dips & (lowest < _GRAZE) & inside
    grazes[:, kept] = False
    samples = np.flatnonzero(grazes.any(axis=1))
    return int(samples[0]) if len(samples) else len(gap)
