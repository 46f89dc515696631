from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cfplan_core import CfplanError
from cfplan_ros.conversions.times import (
    LONGEST,
    duration_message,
    nanoseconds_of,
    seconds_of,
    stamp_of,
    whole_nanoseconds,
)

LAST = (2**31 - 1) * 10**9 + 999_999_999


@given(st.integers(0, LAST))
def test_nanoseconds_survive_a_stamp(nanoseconds: int) -> None:
    assert nanoseconds_of(stamp_of(nanoseconds)) == nanoseconds


@given(st.floats(0.0, 1e6))
def test_seconds_survive_a_duration_to_a_nanosecond(seconds: float) -> None:
    assert abs(seconds_of(duration_message(seconds)) - seconds) <= 0.5e-9 + 1e-15 * seconds


@given(st.integers(0, 10**15))
def test_whole_nanoseconds_survive_as_seconds_exactly(nanoseconds: int) -> None:
    assert nanoseconds_of(duration_message(nanoseconds / 1e9)) == nanoseconds


def test_a_duration_splits_into_seconds_and_nanoseconds() -> None:
    message = duration_message(2.25)
    assert (message.sec, message.nanosec) == (2, 250_000_000)


@pytest.mark.parametrize('seconds', [-1e-9, float('nan'), float('inf'), LONGEST + 1.0])
def test_a_time_that_no_message_holds_is_refused(seconds: float) -> None:
    with pytest.raises(CfplanError, match=f'at most {LONGEST} s'):
        duration_message(seconds)


@given(st.lists(st.floats(0.0, 1e-6), min_size=1, max_size=20))
def test_rounded_times_increase_strictly(steps: list[float]) -> None:
    times = np.cumsum(steps)
    rounded = whole_nanoseconds(times)
    assert (np.diff(rounded) >= 1).all()
    assert (rounded >= np.rint(times * 1e9) - 1e-9).all()


def test_a_plan_longer_than_a_message_can_say_is_refused() -> None:
    with pytest.raises(CfplanError, match='2147483647 s'):
        whole_nanoseconds(np.array([0.0, 3e9]))
