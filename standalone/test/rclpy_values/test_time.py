import pytest
from hypothesis import given
from hypothesis import strategies as st

from builtin_interfaces.msg import Duration as DurationMsg
from builtin_interfaces.msg import Time as TimeMsg
from rclpy.clock_type import ClockType
from rclpy.duration import Duration, Infinite
from rclpy.time import Time

NANOSECONDS = st.integers(0, (2**31 - 1) * 10**9)


@given(NANOSECONDS)
def test_a_time_survives_its_message(nanoseconds):
    time = Time(nanoseconds=nanoseconds, clock_type=ClockType.ROS_TIME)
    assert Time.from_msg(time.to_msg()) == time


@given(st.integers(-(2**31) * 10**9, (2**31 - 1) * 10**9))
def test_a_duration_survives_its_message(nanoseconds):
    duration = Duration(nanoseconds=nanoseconds)
    assert Duration.from_msg(duration.to_msg()) == duration


@given(NANOSECONDS, st.integers(0, 10**18))
def test_adding_and_subtracting_a_duration_is_nothing(nanoseconds, span):
    time, duration = Time(nanoseconds=nanoseconds), Duration(nanoseconds=span)
    assert (time + duration) - duration == time
    assert (time + duration) - time == duration


def test_a_negative_duration_has_nanoseconds_above_zero():
    assert Duration(seconds=-0.5).to_msg() == DurationMsg(sec=-1, nanosec=500_000_000)


def test_seconds_keep_their_fraction():
    assert Time(seconds=1.5, nanoseconds=7).seconds_nanoseconds() == (1, 500_000_007)


def test_times_order():
    early, late = Time(nanoseconds=1), Time(nanoseconds=2)
    assert early < late
    assert late >= early
    assert early != late


def test_times_of_different_clocks_do_not_compare():
    with pytest.raises(TypeError, match="Can't compare times with different clock types"):
        _ = Time() == Time(clock_type=ClockType.STEADY_TIME)


def test_times_of_different_clocks_do_not_subtract():
    with pytest.raises(TypeError, match="Can't subtract times with different clock types"):
        Time() - Time(clock_type=ClockType.ROS_TIME)


@pytest.mark.parametrize('part', ['seconds', 'nanoseconds'])
def test_a_negative_time_is_refused(part):
    with pytest.raises(ValueError, match='must not be negative'):
        Time(**{part: -1})


def test_a_time_before_the_epoch_cannot_be_computed():
    with pytest.raises(ValueError, match='negative time'):
        Time() - Duration(nanoseconds=1)


def test_a_time_that_does_not_fit_is_refused():
    with pytest.raises(OverflowError, match='C time point'):
        Time(nanoseconds=2**63)


def test_a_sum_that_does_not_fit_is_refused():
    with pytest.raises(OverflowError, match='Addition leads to overflow'):
        Time(nanoseconds=2**63 - 1) + Duration(nanoseconds=1)


def test_a_duration_that_does_not_fit_is_refused():
    with pytest.raises(OverflowError, match='C duration'):
        Duration(nanoseconds=2**63)


@pytest.mark.parametrize(('kind', 'message'), [(Time, DurationMsg()), (Duration, TimeMsg())])
def test_a_message_of_another_type_is_refused(kind, message):
    with pytest.raises(TypeError, match='Must pass a builtin_interfaces'):
        kind.from_msg(message)


def test_a_clock_type_must_be_one():
    with pytest.raises(TypeError, match='ClockType enum'):
        Time(clock_type=1)


def test_texts_are_those_of_ros():
    assert repr(Time(nanoseconds=5)) == 'Time(nanoseconds=5, clock_type=SYSTEM_TIME)'
    assert repr(Duration(seconds=1)) == 'Duration(nanoseconds=1000000000)'
    assert str(Infinite) == 'Infinite'


def test_a_steady_time_has_no_date():
    with pytest.raises(TypeError, match='either ROS_TIME or SYSTEM_TIME'):
        Time(clock_type=ClockType.STEADY_TIME).to_datetime()
