"""Timers, and the rate that sleeps on one."""

from __future__ import annotations

import functools
import inspect
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rclpy.clock import Clock, JumpThreshold, ROSClock, TimeJump
from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.exceptions import InvalidHandle, RCLError, ROSInterruptException
from rclpy.time import Time

if TYPE_CHECKING:
    from rclpy._executor import Executor
    from rclpy.callback_groups import CallbackGroup
    from rclpy.context import Context


@dataclass(frozen=True)
class TimerInfo:
    """When a timer's call was due and when it was made.

    Args:
        expected_call_time: When it was due, in nanoseconds of the timer's clock.
        actual_call_time: When it was made, in nanoseconds of the timer's clock.
        clock_type: The type of the timer's clock.
    """

    expected_call_time: int
    actual_call_time: int
    clock_type: ClockType

    @property
    def expected(self) -> Time:
        """When the call was due."""
        return Time(nanoseconds=self.expected_call_time, clock_type=self.clock_type)

    @property
    def actual(self) -> Time:
        """When the call was made."""
        return Time(nanoseconds=self.actual_call_time, clock_type=self.clock_type)


class Timer:
    """Calls back once every period; calls that were missed are left out, the phase stays.

    Args:
        callback: Function or coroutine function, without arguments or with one TimerInfo.
        callback_group: The group that the callback belongs to.
        timer_period_ns: Period [ns], zero for as often as possible.
        clock: The clock that counts.
        context: The context of the node.
        autostart: Whether to start at once; else `reset` starts it.
        wake: Wakes the executor of the node.

    Raises:
        RCLError: if the period is negative.
    """

    def __init__(
        self,
        callback: Callable[..., Any] | None,
        callback_group: CallbackGroup | None,
        timer_period_ns: int,
        clock: Clock,
        *,
        context: Context | None = None,
        autostart: bool = True,
        wake: Callable[[], None] | None = None,
    ) -> None:
        _check_period(timer_period_ns)
        self.callback = callback
        self.callback_group = callback_group
        self.context = context
        self._clock = clock
        self._period = timer_period_ns
        self._wake = wake or (lambda: None)
        self._lock = threading.Lock()
        self._canceled = not autostart
        self._destroyed = False
        self._last_call = self._now()
        self._next_call = self._last_call + timer_period_ns
        self._jump_handle = clock.create_jump_callback(
            JumpThreshold(
                min_forward=None, min_backward=Duration(nanoseconds=-1), on_clock_change=True
            ),
            post_callback=self._after_jump,
        )

    @property
    def clock(self) -> Clock:
        """The clock that counts."""
        return self._clock

    @property
    def timer_period_ns(self) -> int:
        """The period [ns]; a new one counts from the next call on."""
        self._check()
        return self._period

    @timer_period_ns.setter
    def timer_period_ns(self, value: int) -> None:
        self._check()
        period = int(value)
        _check_period(period)
        self._period = period

    def is_ready(self) -> bool:
        """Return whether a call is due."""
        self._check()
        return not self._canceled and self._next_call <= self._now()

    def is_canceled(self) -> bool:
        """Return whether the timer stands still."""
        self._check()
        return self._canceled

    def cancel(self) -> None:
        """Let the timer stand still until `reset`."""
        self._check()
        self._canceled = True

    def reset(self) -> None:
        """Start anew: the next call is due one period from now."""
        self._check()
        with self._lock:
            self._next_call = self._now() + self._period
            self._canceled = False
        self._wake()

    def time_since_last_call(self) -> int:
        """Return the time since the last call, or since the start [ns]."""
        self._check()
        return self._now() - self._last_call

    def time_until_next_call(self) -> int | None:
        """Return the time until the next call [ns], negative if overdue; None if canceled."""
        self._check()
        return None if self._canceled else self._next_call - self._now()

    def destroy(self) -> None:
        """End the timer for good; prefer `Node.destroy_timer`."""
        if not self._destroyed:
            self._destroyed = True
            self._jump_handle.unregister()

    _source = None

    def _due_in_ns(self) -> int | None:
        """Return how long an executor may wait for this timer; None without limit."""
        if self._destroyed or self._canceled:
            return None
        left = self._next_call - self._now()
        # Simulated time goes on when a message says so, and that wakes the executor.
        is_simulated = isinstance(self._clock, ROSClock) and self._clock.ros_time_is_active
        return None if left > 0 and is_simulated else left

    def _take_job(self, executor: Executor) -> Callable[[], Any] | None:
        info = self._take()
        if info is None:
            return None
        return (lambda: None) if self.callback is None else _bind(self.callback, info)

    def _take(self) -> TimerInfo | None:
        """Return the call that is due and plan the one after it; None if none is due."""
        with self._lock:
            now = self._now()
            if self._destroyed or self._canceled or self._next_call > now:
                return None
            due = self._next_call
            self._last_call = now
            self._next_call += self._period
            behind = now - self._next_call
            if behind > 0:
                missed = -(-behind // self._period) if self._period else 0
                self._next_call = max(self._next_call + missed * self._period, now)
        return TimerInfo(due, now, self._clock.clock_type)

    def _after_jump(self, jump: TimeJump) -> None:
        with self._lock:
            self._last_call = self._now()
            self._next_call = self._last_call + self._period
        self._wake()

    def _now(self) -> int:
        return int(self._clock.now().nanoseconds)

    def _check(self) -> None:
        if self._destroyed:
            raise InvalidHandle('cannot use Destroyable because destruction was requested')


class Rate:
    """Sleeps until the next beat; made by `Node.create_rate`.

    Args:
        timer: The timer that beats; the executor of its node must spin in another thread.
        context: The context whose end wakes all sleepers.
    """

    def __init__(self, timer: Timer, *, context: Context) -> None:
        self._timer = timer
        self._beat = threading.Condition()
        self._beats = 0
        self._is_shutdown = False
        self._is_destroyed = False
        timer.callback = self._on_beat
        self._context = context
        context.on_shutdown(self._on_shutdown)

    def sleep(self) -> None:
        """Sleep until the timer's next call.

        Raises:
            ROSInterruptException: if the context ends before.
            RuntimeError: if the rate was destroyed.
        """
        with self._beat:
            before = self._beats
            while self._beats == before:
                if self._is_shutdown or not self._context.ok():
                    raise ROSInterruptException()
                if self._is_destroyed:
                    raise RuntimeError('Rate cannot sleep because it has been destroyed')
                # A signal ends the context without calling back.
                self._beat.wait(0.1)

    def destroy(self) -> None:
        """Wake all sleepers and end the use of the rate; prefer `Node.destroy_rate`."""
        self._is_destroyed = True
        self._notify()

    def _on_beat(self) -> None:
        with self._beat:
            self._beats += 1
            self._beat.notify_all()

    def _on_shutdown(self) -> None:
        self._is_shutdown = True
        self._notify()

    def _notify(self) -> None:
        with self._beat:
            self._beat.notify_all()


def _bind(callback: Callable[..., Any], info: TimerInfo) -> Callable[[], Any]:
    """Return the callback with `info` bound to its argument annotated as TimerInfo, if any."""
    try:
        parameters = inspect.signature(callback).parameters.values()
    except (TypeError, ValueError):
        return callback
    for parameter in parameters:
        if parameter.annotation in (TimerInfo, 'TimerInfo'):
            return functools.partial(callback, **{parameter.name: info})
    return callback


def _check_period(period_ns: int) -> None:
    if period_ns < 0:
        raise RCLError('failed to create timer: timer period must be non-negative')
