from __future__ import annotations

from cfplan_core.trajectory.plan_result import Segment
from cfplan_core.trajectory.segment_ends import (
    Ending,
    SegmentEnd,
    contact_events,
    segment_ends,
)

SEGMENTS = [
    Segment(('a', 'b'), 'form_closure', 0, 2),
    Segment(('b', 'a'), 'force_closure', 2, 5),
    Segment(('c', 'a', 'd'), 'force_closure', 5, 6),
]


def test_a_segment_ends_with_the_contacts_that_are_made_and_broken() -> None:
    assert segment_ends(SEGMENTS)[1] == SegmentEnd(Ending.CONTACTS, ('c', 'd'), ('b',))


def test_a_change_of_the_stability_class_alone_is_no_contact_event() -> None:
    assert segment_ends(SEGMENTS)[0] == SegmentEnd(Ending.STABILITY)
    assert contact_events(SEGMENTS) == [5]


def test_the_last_segment_ends_at_the_goal() -> None:
    assert segment_ends(SEGMENTS)[-1] == SegmentEnd(Ending.GOAL)


def test_without_a_plan_nothing_ends() -> None:
    assert segment_ends([]) == ()
