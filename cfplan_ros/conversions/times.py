"""Seconds as messages; a message counts whole nanoseconds."""

from __future__ import annotations

from builtin_interfaces.msg import Duration, Time

from cfplan_core.errors import CfplanError

NANOSECONDS = 1_000_000_000
"""In a second."""

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
