from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.interpolate import CubicHermiteSpline

from cfplan_core.trajectory.plan_result import Segment
from cfplan_core.trajectory.timing import (
    NANOSECONDS,
    fastest,
    frame_times,
    joint_velocities,
    rest_frames,
    strongest,
)

ANGLES = st.floats(-3.0, 3.0).map(lambda angle: round(angle, 6))
PATHS = st.integers(2, 12).flatmap(lambda count: arrays(float, (count, 2), elements=ANGLES))
VELOCITY = np.array([1.0, 0.5])
ACCELERATION = np.array([4.0, 9.0])


def timed(joints: np.ndarray) -> np.ndarray:
    return frame_times(joints, 2, VELOCITY, ACCELERATION)


def cubics(joints: np.ndarray) -> CubicHermiteSpline:
    times = timed(joints)
    return CubicHermiteSpline(times, joints, joint_velocities(times, joints))


def within_steps(times: np.ndarray, count: int) -> np.ndarray:
    return (times[:-1, None] + np.linspace(0.0, 1.0, count) * np.diff(times)[:, None]).ravel()


def straight(length: float, frames: int) -> np.ndarray:
    return np.linspace(0.0, length, frames)[:, None]


def test_slopes_of_a_steady_acceleration_are_exact() -> None:
    times = np.array([0.0, 0.3, 0.5, 0.9, 1.0, 1.4])
    slopes = joint_velocities(times, times[:, None] ** 2)
    np.testing.assert_allclose(slopes[1:-1, 0], 2.0 * times[1:-1], rtol=1e-12)


@given(PATHS)
def test_the_joints_rest_at_both_ends_and_where_they_are_to(joints: np.ndarray) -> None:
    times = timed(joints)
    rests = range(1, len(joints) - 1, 2)
    assert not joint_velocities(times, joints, list(rests))[[0, -1, *rests]].any()


@given(PATHS)
def test_cubics_stay_between_neighbouring_frames(joints: np.ndarray) -> None:
    spline = cubics(joints)
    between = spline(within_steps(spline.x, 17)).reshape(len(joints) - 1, 17, 2)
    low = np.minimum(joints[:-1], joints[1:])[:, None] - 1e-9
    high = np.maximum(joints[:-1], joints[1:])[:, None] + 1e-9
    assert ((low <= between) & (between <= high)).all()


@given(PATHS)
def test_the_fastest_speed_of_a_step_is_that_of_its_cubic(joints: np.ndarray) -> None:
    spline = cubics(joints)
    sampled = np.abs(spline(within_steps(spline.x, 401), 1)).reshape(len(joints) - 1, 401, 2)
    peak = fastest(spline.x, joints, joint_velocities(spline.x, joints))
    assert np.allclose(peak, sampled.max(axis=1), rtol=1e-3, atol=1e-6)


@given(PATHS)
def test_the_strongest_acceleration_of_a_step_is_that_of_its_cubic(joints: np.ndarray) -> None:
    spline = cubics(joints)
    inside = np.clip(np.linspace(0.0, 1.0, 5), 1e-6, 1.0 - 1e-6)
    times = (spline.x[:-1, None] + inside * np.diff(spline.x)[:, None]).ravel()
    sampled = np.abs(spline(times, 2)).reshape(len(joints) - 1, 5, 2).max(axis=1)
    peak = strongest(spline.x, joints, joint_velocities(spline.x, joints))
    assert np.allclose(peak, sampled, rtol=1e-4, atol=1e-6)


@given(PATHS)
def test_the_cubics_keep_to_the_limits(joints: np.ndarray) -> None:
    spline = cubics(joints)
    times = within_steps(spline.x, 41)
    assert (np.abs(spline(times, 1)) <= VELOCITY * (1.0 + 1e-9)).all()
    assert (np.abs(spline(times, 2)) <= ACCELERATION * (1.0 + 1e-5)).all()


@given(PATHS)
def test_times_are_whole_nanoseconds(joints: np.ndarray) -> None:
    times = timed(joints)
    assert np.array_equal(np.rint(times * NANOSECONDS) / NANOSECONDS, times)


@pytest.mark.parametrize(('acceleration', 'seconds'), [(1e3, 1.5), (1.5, 2.0)])
def test_a_single_step_is_one_cubic_from_rest_to_rest(acceleration: float, seconds: float) -> None:
    # Its largest speed is 3/2 of the average, its largest acceleration 6 Δ / T².
    times = frame_times(straight(1.0, 2), 1, np.array([1.0]), np.array([acceleration]))
    assert times[-1] == pytest.approx(seconds, rel=1e-5)


def test_a_short_way_is_half_speeding_up_and_half_stopping() -> None:
    times = frame_times(straight(1.0, 41), 1, np.array([9.0]), np.array([4.0]))
    assert 1.0 <= times[-1] <= 1.15
    assert times[20] == pytest.approx(times[-1] / 2.0, rel=0.02)


def test_a_long_way_is_mostly_at_the_velocity_limit() -> None:
    # Half a second each of speeding up and of stopping, at 1 rad/s in between.
    times = frame_times(straight(3.0, 81), 1, np.array([1.0]), np.array([2.0]))
    assert 3.5 <= times[-1] <= 3.75


def test_around_a_bend_the_acceleration_across_it_limits_the_speed() -> None:
    # At speed v on a circle of radius r the acceleration is v² / r.
    angle = np.linspace(0.0, np.pi, 121)
    circle = 0.1 * np.column_stack([np.cos(angle), np.sin(angle)])
    times = frame_times(circle, 2, np.full(2, np.inf), np.full(2, 2.0))
    speed = 0.1 * np.diff(angle)[60] / np.diff(times)[60]
    assert speed**2 / 0.1 == pytest.approx(2.0, rel=0.15)


def test_coordinates_that_are_no_joints_limit_the_acceleration_too() -> None:
    alone = frame_times(straight(1.0, 41), 1, np.array([9.0]), np.array([4.0]))
    path = np.column_stack([straight(1.0, 41), straight(3.0, 41)])
    both = frame_times(path, 1, np.array([9.0, np.inf]), np.array([4.0, 3.0]))
    # Thrice as far at 3/4 of the acceleration takes twice as long.
    assert both[-1] == pytest.approx(2.0 * alone[-1], rel=1e-3)


def test_a_pace_slows_the_steps_that_it_is_given_for() -> None:
    pace = np.ones(80)
    pace[30:50] = 0.25
    path, limits = straight(4.0, 81), (np.array([1.0]), np.array([8.0]))
    steps = np.diff(frame_times(path, 1, *limits, pace=pace))
    free = np.diff(frame_times(path, 1, *limits))
    assert (0.05 / steps[33:47] <= 0.25).all()
    assert steps[33:47] == pytest.approx(4.0 * free[33:47], rel=0.01)
    assert steps[5:20] == pytest.approx(free[5:20], rel=0.3)


def test_a_stop_on_the_way_makes_two_motions_of_one() -> None:
    path, limits = straight(2.0, 41), (np.array([1.0]), np.array([2.0]))
    half = frame_times(path[:21], 1, *limits)
    whole = frame_times(path, 1, *limits, rests=[20])
    np.testing.assert_allclose(whole[:21], half, atol=1e-9)
    assert whole[-1] == pytest.approx(2.0 * half[-1], rel=1e-5)


def test_a_single_frame_is_at_time_zero() -> None:
    assert timed(np.array([[0.3, 0.4]])).tolist() == [0.0]


def test_frames_that_do_not_move_still_have_increasing_times() -> None:
    times = frame_times(np.zeros((3, 2)), 2, VELOCITY, ACCELERATION, rests=[1])
    assert (np.diff(times) > 0.0).all()


def test_a_plan_of_a_million_years_still_has_increasing_times() -> None:
    times = frame_times(np.array([[0.0], [1.0], [2.0]]), 1, np.array([1e-14]), np.array([1.0]))
    assert (np.diff(times) > 1e14).all()


def test_a_plan_rests_at_contact_events_and_at_corners() -> None:
    joints = np.array([[0.0, 0.0], [0.1, 0.0], [0.2, 0.0], [0.2, 0.1], [0.21, 0.2], [0.2, 0.3]])
    segments = [Segment(('a',), 'force_closure', 0, 1), Segment(('b',), 'force_closure', 1, 5)]
    assert rest_frames(joints, segments) == [1, 2]


def test_a_joint_that_turns_round_alone_rests_there() -> None:
    joints = np.array([[0.0], [0.1], [0.05], [0.0]])
    assert rest_frames(joints, [Segment(('a',), 'force_closure', 0, 3)]) == [1]
