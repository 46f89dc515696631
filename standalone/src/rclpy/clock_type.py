"""The kinds of clock that ROS knows."""

from enum import IntEnum


class ClockType(IntEnum):
    """Kind of a clock, with the values of rcl."""

    UNINITIALIZED = 0
    ROS_TIME = 1
    SYSTEM_TIME = 2
    STEADY_TIME = 3
