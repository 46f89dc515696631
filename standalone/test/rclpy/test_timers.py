from __future__ import annotations

import itertools
import threading
import time

import pytest

import rclpy
from rclpy.clock import ROSClock
from rclpy.clock_type import ClockType
from rclpy.exceptions import InvalidHandle, RCLError, ROSInterruptException
from rclpy.parameter import Parameter
from rclpy.time import Time
from rclpy.timer import Timer, TimerInfo
from rosgraph_msgs.msg import Clock as ClockMessage

SECOND = 1_000_000_000


@pytest.fixture
def clock():
    """A clock that stands still until it is set."""
    clock = ROSClock()
    clock._set_ros_time_is_active(True)
    set_clock(clock, 100 * SECOND)
    return clock


def set_clock(clock, nanoseconds):
    clock.set_ros_time_override(Time(nanoseconds=nanoseconds, clock_type=ClockType.ROS_TIME))


def make(clock, **options):
    return Timer(None, None, SECOND, clock, **options)


def test_a_timer_is_ready_after_its_period(clock):
    timer = make(clock)
    states = [timer.is_ready()]
    set_clock(clock, 101 * SECOND)
    assert [*states, timer.is_ready()] == [False, True]


def test_a_timer_tells_the_time_until_its_next_call(clock):
    timer = make(clock)
    set_clock(clock, 100 * SECOND + 300)
    assert timer.time_until_next_call() == SECOND - 300
    assert timer.time_since_last_call() == 300


def test_calls_that_were_missed_are_left_out_and_the_phase_stays(clock):
    timer = make(clock)
    set_clock(clock, 103 * SECOND + 5)
    info = timer._take()
    assert info == TimerInfo(101 * SECOND, 103 * SECOND + 5, ClockType.ROS_TIME)
    assert timer._take() is None
    assert timer.time_until_next_call() == SECOND - 5


def test_a_canceled_timer_stands_still_until_it_is_reset(clock):
    timer = make(clock)
    timer.cancel()
    set_clock(clock, 102 * SECOND)
    states = timer.is_canceled(), timer.is_ready(), timer.time_until_next_call()
    timer.reset()
    assert states == (True, False, None)
    assert (timer.is_canceled(), timer.time_until_next_call()) == (False, SECOND)


def test_a_timer_without_autostart_waits_for_its_reset(clock):
    assert make(clock, autostart=False).is_canceled()


def test_time_that_goes_back_starts_the_period_anew(clock):
    timer = make(clock)
    set_clock(clock, 50 * SECOND)
    assert timer.time_until_next_call() == SECOND


def test_another_period_counts_from_the_next_call_on(clock):
    timer = make(clock)
    timer.timer_period_ns = 2 * SECOND
    set_clock(clock, 101 * SECOND)
    timer._take()
    assert timer.time_until_next_call() == 2 * SECOND


def test_a_negative_period_is_refused(node):
    with pytest.raises(RCLError, match='timer period must be non-negative'):
        node.create_timer(-0.1, None)


def test_a_destroyed_timer_is_not_used(node):
    timer = node.create_timer(1.0, None)
    assert node.destroy_timer(timer)
    with pytest.raises(InvalidHandle):
        timer.reset()


def test_a_timer_calls_once_every_period(node, until):
    calls = []
    node.create_timer(0.05, lambda: calls.append(time.monotonic()))
    until(lambda: len(calls) == 5)
    assert (calls[4] - calls[0]) / 4 == pytest.approx(0.05, rel=0.3)


def test_a_callback_may_ask_when_it_was_due(node, until):
    calls = []

    def callback(info: TimerInfo):
        calls.append(info)

    node.create_timer(0.01, callback)
    until(lambda: calls)
    assert calls[0].expected <= calls[0].actual


def test_a_timer_of_simulated_time_follows_the_clock_topic(ros):
    node = rclpy.create_node(
        'simulated', parameter_overrides=[Parameter('use_sim_time', value=True)]
    )
    publisher = node.create_publisher(ClockMessage, '/clock', 10)
    calls = []
    node.create_timer(10.0, lambda: calls.append(node.get_clock().now().nanoseconds))
    end = time.monotonic() + 20.0
    now = 0
    while len(calls) < 3 and time.monotonic() < end:
        now += SECOND
        publisher.publish(ClockMessage(clock=Time(nanoseconds=now).to_msg()))
        rclpy.spin_once(node, timeout_sec=0.02)
    steps = [later - earlier for earlier, later in itertools.pairwise(calls[1:])]
    assert steps == pytest.approx([10 * SECOND], abs=2 * SECOND)


def test_a_rate_sleeps_for_its_period(node, executor, in_background):
    in_background(executor)
    rate = node.create_rate(20.0)
    rate.sleep()
    start = time.monotonic()
    rate.sleep()
    rate.sleep()
    assert time.monotonic() - start == pytest.approx(0.1, rel=0.5)


def test_a_shutdown_wakes_who_sleeps_on_a_rate(node):
    rate = node.create_rate(0.01)
    threading.Timer(0.05, rclpy.shutdown).start()
    with pytest.raises((ROSInterruptException, RuntimeError)):
        rate.sleep()


def test_a_rate_needs_a_frequency_above_zero(node):
    with pytest.raises(ValueError, match='frequency must be > 0'):
        node.create_rate(0.0)
