import threading
import time

import pytest

from rclpy.clock import Clock, ClockChange, JumpThreshold, ROSClock
from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.exceptions import NotInitializedException
from rclpy.time import Time

ANY_JUMP = JumpThreshold(
    min_forward=Duration(nanoseconds=1), min_backward=Duration(nanoseconds=-1)
)


class Context:
    """What a sleeping clock needs of rclpy.context.Context."""

    def __init__(self, initialised=True):
        self._ok = initialised
        self._callbacks = []
        self.sleeping = threading.Event()

    def ok(self):
        return self._ok

    def on_shutdown(self, callback):
        self._callbacks.append(callback)
        self.sleeping.set()

    def shutdown(self):
        self._ok = False
        for callback in self._callbacks:
            callback()


def ros_time(seconds):
    return Time(seconds=seconds, clock_type=ClockType.ROS_TIME)


def simulated(seconds):
    clock = ROSClock()
    clock.set_ros_time_override(ros_time(seconds))
    clock._set_ros_time_is_active(True)
    return clock


def in_thread(function):
    """Start a function in a thread; the returned function waits for its result."""
    results = []
    thread = threading.Thread(target=lambda: results.append(function()), daemon=True)
    thread.start()

    def result():
        thread.join(10)
        assert results, 'the thread did not end in time'
        return results[0]

    return result


def test_a_clock_of_ros_time_is_a_ros_clock():
    assert isinstance(Clock(clock_type=ClockType.ROS_TIME), ROSClock)
    assert ROSClock().clock_type is ClockType.ROS_TIME


def test_a_clock_type_must_be_one():
    with pytest.raises(TypeError, match='ClockType enum'):
        Clock(clock_type='ROS_TIME')


def test_the_system_clock_shows_the_systems_time():
    before = time.time_ns()
    assert before <= Clock().now().nanoseconds <= time.time_ns()


def test_the_steady_clock_never_goes_back():
    clock = Clock(clock_type=ClockType.STEADY_TIME)
    times = [clock.now() for _ in range(100)]
    assert times == sorted(times, key=lambda moment: moment.nanoseconds)


def test_overridden_time_is_what_it_was_set_to():
    clock = simulated(5)
    assert clock.ros_time_is_active
    assert clock.now() == ros_time(5)


def test_time_set_while_not_overridden_counts_later():
    clock = ROSClock()
    clock.set_ros_time_override(ros_time(5))
    assert clock.now() > ros_time(6)


def test_a_jump_tells_how_far():
    clock, jumps = simulated(5), []
    clock.create_jump_callback(ANY_JUMP, post_callback=jumps.append)
    clock.set_ros_time_override(ros_time(3))
    assert [(jump.clock_change, jump.delta) for jump in jumps] == [
        (ClockChange.ROS_TIME_NO_CHANGE, Duration(seconds=-2))
    ]


def test_the_first_callback_of_a_jump_sees_the_old_time_and_the_second_the_new():
    clock, seen = simulated(1), []
    clock.create_jump_callback(
        ANY_JUMP,
        pre_callback=lambda: seen.append(clock.now()),
        post_callback=lambda jump: seen.append(clock.now()),
    )
    clock.set_ros_time_override(ros_time(2))
    assert seen == [ros_time(1), ros_time(2)]


def test_a_jump_below_the_threshold_is_not_told():
    clock, jumps = simulated(1), []
    threshold = JumpThreshold(min_forward=Duration(seconds=2), min_backward=None)
    clock.create_jump_callback(threshold, post_callback=jumps.append)
    clock.set_ros_time_override(ros_time(2))
    clock.set_ros_time_override(ros_time(0))
    assert jumps == []


def test_an_ended_registration_is_told_nothing():
    clock, jumps = simulated(1), []
    with clock.create_jump_callback(ANY_JUMP, post_callback=jumps.append):
        pass
    clock.set_ros_time_override(ros_time(2))
    assert jumps == []


@pytest.mark.parametrize(
    ('forward', 'backward', 'reason'),
    [(0, -1, 'min_forward must be'), (1, 0, 'min_backward must be')],
)
def test_a_threshold_of_the_wrong_sign_is_refused(forward, backward, reason):
    with pytest.raises(ValueError, match=reason):
        JumpThreshold(
            min_forward=Duration(nanoseconds=forward), min_backward=Duration(nanoseconds=backward)
        )


def test_a_threshold_of_nothing_is_refused():
    with pytest.raises(ValueError, match='At least one jump threshold'):
        JumpThreshold(min_forward=None, min_backward=None, on_clock_change=False)


@pytest.mark.parametrize('clock_type', [ClockType.SYSTEM_TIME, ClockType.STEADY_TIME])
def test_a_sleep_lasts_as_long_as_asked(clock_type):
    start = time.monotonic()
    assert Clock(clock_type=clock_type).sleep_for(Duration(seconds=0.05), Context())
    assert time.monotonic() - start >= 0.045


def test_a_sleep_in_simulated_time_ends_when_that_time_comes():
    clock, context = simulated(1), Context()
    result = in_thread(lambda: clock.sleep_until(ros_time(3), context))
    assert context.sleeping.wait(10)
    clock.set_ros_time_override(ros_time(2))
    clock.set_ros_time_override(ros_time(3))
    assert result() is True


def test_shutdown_ends_a_sleep():
    context = Context()
    result = in_thread(lambda: Clock().sleep_for(Duration(seconds=60), context))
    assert context.sleeping.wait(10)
    context.shutdown()
    assert result() is False


def test_a_sleep_ends_when_the_time_gets_another_source():
    clock, context = simulated(1), Context()
    result = in_thread(lambda: clock.sleep_until(ros_time(3), context))
    assert context.sleeping.wait(10)
    clock._set_ros_time_is_active(False)
    assert result() is False


def test_sleep_needs_a_living_context():
    with pytest.raises(NotInitializedException):
        Clock().sleep_for(Duration(seconds=1), Context(initialised=False))


def test_sleep_needs_a_time_of_its_own_clock():
    with pytest.raises(ValueError, match='clock type does not match'):
        Clock().sleep_until(ros_time(1), Context())
