from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

from cfplan_core.trajectory.timing import NANOSECONDS, fastest, frame_times, joint_velocities

ANGLES = st.floats(-3.0, 3.0).map(lambda angle: round(angle, 6))
PATHS = st.integers(2, 12).flatmap(lambda count: arrays(float, (count, 2), elements=ANGLES))
LIMITS = np.array([1.0, 0.5])


def needed(joints: np.ndarray) -> np.ndarray:
    """Time that the fastest joint of each step needs at its limit."""
    return (np.abs(np.diff(joints, axis=0)) / LIMITS).max(axis=1, initial=0.0)


def cubics(joints: np.ndarray) -> CubicHermiteSpline:
    times = frame_times(joints, LIMITS)
    return CubicHermiteSpline(times, joints, joint_velocities(times, joints))


def within_steps(times: np.ndarray, count: int) -> np.ndarray:
    return (times[:-1, None] + np.linspace(0.0, 1.0, count) * np.diff(times)[:, None]).ravel()


@given(PATHS)
def test_slopes_between_the_ends_are_scipys_pchip(joints: np.ndarray) -> None:
    times = frame_times(joints, LIMITS)
    expected = PchipInterpolator(times, joints).derivative()(times)
    assert np.allclose(joint_velocities(times, joints)[1:-1], expected[1:-1], rtol=1e-9)


@given(PATHS)
def test_the_joints_rest_at_both_ends(joints: np.ndarray) -> None:
    assert not joint_velocities(frame_times(joints, LIMITS), joints)[[0, -1]].any()


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
def test_the_cubics_keep_to_the_velocity_limits(joints: np.ndarray) -> None:
    spline = cubics(joints)
    assert (np.abs(spline(within_steps(spline.x, 41), 1)) <= LIMITS * (1.0 + 1e-9)).all()


@given(PATHS)
def test_no_step_is_shorter_than_its_fastest_joint_needs(joints: np.ndarray) -> None:
    assert (np.diff(frame_times(joints, LIMITS)) >= needed(joints)).all()


@given(PATHS)
def test_a_plan_takes_at_most_half_as_long_again_as_its_joints_need(joints: np.ndarray) -> None:
    shortest = np.maximum(needed(joints), 1e-6).sum()
    assert frame_times(joints, LIMITS)[-1] <= 1.5001 * shortest + 1e-6


@given(PATHS)
def test_times_are_whole_nanoseconds(joints: np.ndarray) -> None:
    times = frame_times(joints, LIMITS)
    assert np.array_equal(np.rint(times * NANOSECONDS) / NANOSECONDS, times)


def test_a_single_step_takes_half_as_long_again() -> None:
    # From rest to rest the cubic's largest speed is 3/2 of the average.
    times = frame_times(np.array([[0.0, 0.0], [1.0, 0.0]]), LIMITS)
    assert times[-1] == pytest.approx(1.5, rel=1e-5)


def test_a_single_frame_is_at_time_zero() -> None:
    assert frame_times(np.array([[0.3, 0.4]]), LIMITS).tolist() == [0.0]


def test_a_plan_of_a_million_years_still_has_increasing_times() -> None:
    times = frame_times(np.array([[0.0], [1.0], [2.0]]), np.array([1e-14]))
    assert (np.diff(times) > 1e14).all()
