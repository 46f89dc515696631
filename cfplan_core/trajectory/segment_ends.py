"""What ends each segment of a plan: what an executive must see before it goes on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise

from cfplan_core.trajectory.plan_result import Segment


class Ending(str, Enum):
    """Why a segment ends."""

    CONTACTS = 'contacts'
    STABILITY = 'stability'
    GOAL = 'goal'


@dataclass(frozen=True)
class SegmentEnd:
    """The event at the last frame of a segment.

    Attributes:
        ending: Contacts change, at rest; or only the stability class does, on the way; or the
            plan is over.
        made: Contacts that begin to touch there, in the order of the next segment.
        broken: Contacts that part as the next segment begins, in the order of this one.
    """

    ending: Ending
    made: tuple[str, ...] = ()
    broken: tuple[str, ...] = ()


def segment_ends(segments: Sequence[Segment]) -> tuple[SegmentEnd, ...]:
    """Tell how each segment of a plan ends."""
    ends = []
    for before, after in pairwise(segments):
        made = tuple(name for name in after.contacts if name not in before.contacts)
        broken = tuple(name for name in before.contacts if name not in after.contacts)
        ending = Ending.CONTACTS if made or broken else Ending.STABILITY
        ends.append(SegmentEnd(ending, made, broken))
    return (*ends, *[SegmentEnd(Ending.GOAL)] * bool(segments))


def contact_events(segments: Sequence[Segment]) -> list[int]:
    """Frames at which a plan makes or breaks contacts, in order."""
    return [
        segment.last_frame
        for segment, end in zip(segments, segment_ends(segments), strict=True)
        if end.ending is Ending.CONTACTS
    ]
