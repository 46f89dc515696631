"""Clocks: system, steady, and ROS's, which a simulation may set."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from enum import IntEnum
from types import TracebackType
from typing import TYPE_CHECKING

from rclpy.clock_type import ClockType
from rclpy.constants import S_TO_NS
from rclpy.duration import Duration
from rclpy.exceptions import NotInitializedException
from rclpy.time import Time

if TYPE_CHECKING:
    from rclpy.context import Context

__all__ = [
    'Clock',
    'ClockChange',
    'ClockType',
    'JumpHandle',
    'JumpThreshold',
    'ROSClock',
    'TimeJump',
]


class ClockChange(IntEnum):
    """What a jump did to a clock's source, with the values of rcl."""

    ROS_TIME_NO_CHANGE = 1
    ROS_TIME_ACTIVATED = 2
    ROS_TIME_DEACTIVATED = 3
    SYSTEM_TIME_NO_CHANGE = 4


class JumpThreshold:
    """Which jumps a callback is for.

    Args:
        min_forward: The smallest jump forwards, above zero; None for none.
        min_backward: The smallest jump backwards, below zero; None for none.
        on_clock_change: Whether a change of the clock's source counts.

    Raises:
        ValueError: If a duration has the wrong sign, or no jump counts at all.
    """

    def __init__(
        self,
        *,
        min_forward: Duration | None,
        min_backward: Duration | None,
        on_clock_change: bool = True,
    ) -> None:
        if min_forward is not None and min_forward.nanoseconds <= 0:
            raise ValueError('min_forward must be a positive non-zero duration')
        if min_backward is not None and min_backward.nanoseconds >= 0:
            raise ValueError('min_backward must be a negative non-zero duration')
        if min_forward is None and min_backward is None and not on_clock_change:
            raise ValueError('At least one jump threshold must be enabled')
        self.min_forward = min_forward
        self.min_backward = min_backward
        self.on_clock_change = on_clock_change

    def is_exceeded(self, jump: TimeJump) -> bool:
        """Whether a jump counts."""
        if jump.clock_change in (ClockChange.ROS_TIME_ACTIVATED, ClockChange.ROS_TIME_DEACTIVATED):
            return self.on_clock_change
        forward = self.min_forward is not None and jump.delta >= self.min_forward
        backward = self.min_backward is not None and jump.delta <= self.min_backward
        return forward or backward


class TimeJump:
    """A jump of a clock.

    Args:
        clock_change: What happened to the clock's source.
        delta: How far the time jumped; negative is backwards.
    """

    def __init__(self, clock_change: ClockChange, delta: Duration) -> None:
        if not isinstance(clock_change, ClockChange):
            raise TypeError('clock_change must be an instance of rclpy.clock.ClockChange')
        self._clock_change = clock_change
        self._delta = delta

    @property
    def clock_change(self) -> ClockChange:
        """What happened to the clock's source."""
        return self._clock_change

    @property
    def delta(self) -> Duration:
        """How far the time jumped."""
        return self._delta


class JumpHandle:
    """A registration for a clock's jumps, ended by `unregister` or as a context manager.

    Args:
        clock: The clock.
        threshold: Which jumps count.
        pre_callback: Called before the time changes.
        post_callback: Called after it, with the TimeJump.

    Raises:
        ValueError: If there is no callback, or one is not callable.
    """

    def __init__(
        self,
        *,
        clock: Clock,
        threshold: JumpThreshold,
        pre_callback: Callable[[], None] | None,
        post_callback: Callable[[TimeJump], None] | None,
    ) -> None:
        if pre_callback is None and post_callback is None:
            raise ValueError('One of pre_callback or post_callback must be callable')
        if pre_callback is not None and not callable(pre_callback):
            raise ValueError('pre_callback must be callable if given')
        if post_callback is not None and not callable(post_callback):
            raise ValueError('post_callback must be callable if given')
        self.threshold = threshold
        self.pre_callback = pre_callback
        self.post_callback = post_callback
        self._clock: Clock | None = clock
        clock._jump_handles.append(self)

    def unregister(self) -> None:
        """End the registration."""
        if self._clock is not None:
            self._clock._jump_handles.remove(self)
            self._clock = None

    def __enter__(self) -> JumpHandle:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc_value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.unregister()


class Clock:
    """A clock of one type; of ROS_TIME it is a ROSClock.

    Args:
        clock_type: The type.

    Raises:
        TypeError: If clock_type is not a ClockType.
    """

    _clock_type: ClockType
    _jump_handles: list[JumpHandle]

    def __new__(cls, *, clock_type: ClockType = ClockType.SYSTEM_TIME) -> Clock:
        """Make a clock of the class that its type asks for."""
        if not isinstance(clock_type, ClockType):
            raise TypeError('Clock type must be a ClockType enum')
        self = super().__new__(ROSClock if clock_type is ClockType.ROS_TIME else cls)
        self._clock_type = clock_type
        self._jump_handles = []
        return self

    @property
    def clock_type(self) -> ClockType:
        """The clock's type."""
        return self._clock_type

    def __repr__(self) -> str:
        return f'Clock(clock_type={self.clock_type.name})'

    def now(self) -> Time:
        """The time."""
        return Time(nanoseconds=self._nanoseconds(), clock_type=self._clock_type)

    def _nanoseconds(self) -> int:
        if self._clock_type is ClockType.STEADY_TIME:
            return time.monotonic_ns()
        return time.time_ns()

    def create_jump_callback(
        self,
        threshold: JumpThreshold,
        *,
        pre_callback: Callable[[], None] | None = None,
        post_callback: Callable[[TimeJump], None] | None = None,
    ) -> JumpHandle:
        """Call back when the time jumps; see JumpHandle."""
        return JumpHandle(
            clock=self,
            threshold=threshold,
            pre_callback=pre_callback,
            post_callback=post_callback,
        )

    def sleep_until(self, until: Time, context: Context | None = None) -> bool:
        """Sleep until a time of this clock.

        Args:
            until: When to wake.
            context: Ends the sleep when it is shut down; the default one when None.

        Returns:
            Whether the time has come; False after shutdown, or when the clock changed its source.

        Raises:
            NotInitializedException: If the context is not initialised.
            ValueError: If the time is of another type of clock.
        """
        if context is None:
            from rclpy.utilities import get_default_context

            context = get_default_context()
        if not context.ok():
            raise NotInitializedException()
        if until.clock_type != self._clock_type:
            raise ValueError("until's clock type does not match this clock's type")
        woken = threading.Event()
        source_changed = False

        def after_jump(jump: TimeJump) -> None:
            nonlocal source_changed
            if jump.clock_change in (
                ClockChange.ROS_TIME_ACTIVATED,
                ClockChange.ROS_TIME_DEACTIVATED,
            ):
                # Another source has another epoch: `until` means nothing there.
                source_changed = True
            if source_changed or self.now() >= until:
                woken.set()

        threshold = JumpThreshold(
            min_forward=Duration(nanoseconds=1),
            min_backward=Duration(nanoseconds=-1),
            on_clock_change=True,
        )
        with self.create_jump_callback(threshold, post_callback=after_jump):
            context.on_shutdown(woken.set)
            while not woken.is_set() and self.now() < until:
                woken.wait(self._longest_wait(until))
        if not context.ok() or source_changed:
            return False
        return self.now() >= until

    def sleep_for(self, rel_time: Duration, context: Context | None = None) -> bool:
        """Sleep for a span of this clock's time; see sleep_until."""
        return self.sleep_until(self.now() + rel_time, context)

    def _longest_wait(self, until: Time) -> float | None:
        return max(0.0, (until.nanoseconds - self._nanoseconds()) / S_TO_NS)


class ROSClock(Clock):
    """The clock of ROS time: the system's, or while it is overridden what it was set to last."""

    _override: int | None = None
    _overridden: int = 0

    def __new__(cls) -> ROSClock:
        """Make a clock of ROS time."""
        clock = Clock.__new__(cls, clock_type=ClockType.ROS_TIME)
        assert isinstance(clock, ROSClock)
        return clock

    @property
    def ros_time_is_active(self) -> bool:
        """Whether the time is overridden."""
        return self._override is not None

    def set_ros_time_override(self, time: Time) -> None:
        """Set the time that the clock shows while it is overridden."""
        if not isinstance(time, Time):
            raise TypeError(
                f'Time must be specified as rclpy.time.Time. Received type: {type(time)}'
            )
        if self._override is None:
            self._overridden = time.nanoseconds
            return
        delta = Duration(nanoseconds=time.nanoseconds - self._override)
        self._jump(TimeJump(ClockChange.ROS_TIME_NO_CHANGE, delta), time.nanoseconds)

    def _set_ros_time_is_active(self, enabled: bool) -> None:
        if enabled and self._override is None:
            self._jump(TimeJump(ClockChange.ROS_TIME_ACTIVATED, Duration()), self._overridden)
        elif not enabled and self._override is not None:
            self._overridden = self._override
            self._jump(TimeJump(ClockChange.ROS_TIME_DEACTIVATED, Duration()), None)

    def _jump(self, jump: TimeJump, override: int | None) -> None:
        concerned = [h for h in list(self._jump_handles) if h.threshold.is_exceeded(jump)]
        for handle in concerned:
            if handle.pre_callback is not None:
                handle.pre_callback()
        self._override = override
        for handle in concerned:
            if handle.post_callback is not None:
                handle.post_callback(jump)

    def _nanoseconds(self) -> int:
        return super()._nanoseconds() if self._override is None else self._override

    def _longest_wait(self, until: Time) -> float | None:
        # Overridden time moves only by jumps, which wake the sleeper.
        return super()._longest_wait(until) if self._override is None else None
