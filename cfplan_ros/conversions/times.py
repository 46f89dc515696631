"""Seconds as messages; a message counts whole nanoseconds."""

from __future__ import annotations

import numpy as np
from builtin_interfaces.msg import Duration, Time
from numpy.typing import NDArray

from cfplan_core.errors import CfplanError
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.trajectory.timing import NANOSECONDS as NANOSECONDS

LONGEST = 2**31 - 1
"""Seconds that a message can hold."""


def duration_message(seconds: float) -> Duration:
    """Return a duration, to the nearest nanosecond.

    Args:
        seconds: At least zero.

    Raises:
        CfplanError: It is negative, not a number, or too long for a message.
    """
    if not 0.0 <= seconds <= LONGEST:
        raise CfplanError(f'a time of {seconds:g} s: expected at least 0 and at most {LONGEST} s')
    return duration_of(round(seconds * NANOSECONDS))


def duration_of(nanoseconds: int) -> Duration:
    """Return a duration of so many nanoseconds, at least zero."""
    sec, nanosec = divmod(int(nanoseconds), NANOSECONDS)
    return Duration(sec=sec, nanosec=nanosec)


def stamp_of(nanoseconds: int) -> Time:
    """Return a point in time, in nanoseconds since the clock's zero."""
    sec, nanosec = divmod(int(nanoseconds), NANOSECONDS)
    return Time(sec=sec, nanosec=nanosec)


def nanoseconds_of(message: Duration | Time) -> int:
    """Return a duration or a point in time in nanoseconds."""
    return int(message.sec) * NANOSECONDS + int(message.nanosec)


def seconds_of(message: Duration | Time) -> float:
    """Return a duration or a point in time in seconds, the nearest that a float holds."""
    return nanoseconds_of(message) / NANOSECONDS


def whole_nanoseconds(times: FloatArray) -> NDArray[np.int64]:
    """Round times to nanoseconds that still increase strictly, shape (f,).

    Raises:
        CfplanError: A time is too long for a message.
    """
    if len(times) and not times[-1] <= LONGEST:
        raise CfplanError(f'a plan of {times[-1]:g} s: expected at most {LONGEST} s')
    rounded = np.rint(times * NANOSECONDS).astype(np.int64)
    # The smallest strictly increasing sequence above the rounded one.
    place = np.arange(len(rounded))
    return np.asarray(np.maximum.accumulate(rounded - place) + place)
