from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

from cfplan_core import CfplanError, Hand, PlanResult, Problem, Status
from cfplan_core.model import Finger, Joint, Link
from cfplan_ros.conversions.velocities import (
    fastest,
    followable,
    joint_velocities,
    whole_nanoseconds,
)

ANGLES = st.floats(-3.0, 3.0).map(lambda angle: round(angle, 6))
PATHS = st.integers(2, 12).flatmap(lambda count: arrays(float, (count, 2), elements=ANGLES))
SPEEDS = (1.0, 0.5)
LINK = Link('link', 1.0, np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]))


def a_hand(speeds: tuple[float, ...] = SPEEDS) -> Hand:
    joints = [Joint(f'joint_{k}', -4.0, 4.0, speed, 1.0) for k, speed in enumerate(speeds)]
    return Hand((), tuple(Finger(j.name, np.zeros(2), 0.0, (j,), (LINK,)) for j in joints))


def a_plan(joints: np.ndarray, speeds: tuple[float, ...] = SPEEDS) -> PlanResult:
    """A plan in which one joint moves at its limit between frames, as the planner's do."""
    steps = (np.abs(np.diff(joints, axis=0)) / speeds).max(axis=1, initial=0.0)
    times = np.concatenate([[0.0], np.cumsum(np.maximum(steps, 1e-6))])
    return PlanResult('any', Status.SOLVED, ('joint_0', 'joint_1'), times=times, joints=joints)


def speeds_of(result: PlanResult) -> np.ndarray:
    """Speed of the cubics through the frames at many times, shape (t, n)."""
    velocities = joint_velocities(result.times, result.joints)
    spline = CubicHermiteSpline(result.times, result.joints, velocities)
    fractions = np.linspace(0.0, 1.0, 41)
    times = result.times[:-1, None] + fractions * np.diff(result.times)[:, None]
    return np.abs(spline(times.ravel(), 1))


@given(PATHS)
def test_slopes_between_the_ends_are_scipys_pchip(joints: np.ndarray) -> None:
    times = a_plan(joints).times
    expected = PchipInterpolator(times, joints).derivative()(times)
    assert np.allclose(joint_velocities(times, joints)[1:-1], expected[1:-1], rtol=1e-9)


@given(PATHS)
def test_the_joints_rest_at_both_ends(joints: np.ndarray) -> None:
    velocities = joint_velocities(a_plan(joints).times, joints)
    assert not velocities[[0, -1]].any()


@given(PATHS)
def test_cubics_stay_between_neighbouring_frames(joints: np.ndarray) -> None:
    times = a_plan(joints).times
    spline = CubicHermiteSpline(times, joints, joint_velocities(times, joints))
    between = spline(times[:-1, None] + np.linspace(0.0, 1.0, 17) * np.diff(times)[:, None])
    low = np.minimum(joints[:-1], joints[1:])[:, None] - 1e-9
    high = np.maximum(joints[:-1], joints[1:])[:, None] + 1e-9
    assert ((low <= between) & (between <= high)).all()


@given(PATHS)
def test_the_fastest_speed_of_a_step_is_that_of_its_cubic(joints: np.ndarray) -> None:
    times = a_plan(joints).times
    velocities = joint_velocities(times, joints)
    spline = CubicHermiteSpline(times, joints, velocities)
    sampled = np.abs(
        spline(times[:-1, None] + np.linspace(0, 1, 401) * np.diff(times)[:, None], 1)
    )
    peak = fastest(times, joints, velocities)
    assert np.allclose(peak, sampled.max(axis=1), rtol=1e-3, atol=1e-6)


@given(PATHS)
def test_a_followable_plan_keeps_to_the_velocity_limits(joints: np.ndarray) -> None:
    result = followable(a_plan(joints), a_hand())
    assert (speeds_of(result) <= np.array(SPEEDS) * (1.0 + 1e-9)).all()


@given(PATHS)
def test_no_step_of_a_followable_plan_is_shorter_than_planned(joints: np.ndarray) -> None:
    planned = a_plan(joints)
    result = followable(planned, a_hand())
    assert (np.diff(result.times) >= np.diff(planned.times) - 1.1e-9).all()


@given(PATHS)
def test_a_followable_plan_takes_at_most_half_as_long_again(joints: np.ndarray) -> None:
    planned = a_plan(joints)
    result = followable(planned, a_hand())
    assert result.times[-1] <= 1.5001 * planned.times[-1] + 1e-6


@given(PATHS)
def test_a_followable_plan_is_left_as_it_is(joints: np.ndarray) -> None:
    result = followable(a_plan(joints), a_hand())
    assert np.array_equal(followable(result, a_hand()).times, result.times)


def test_a_single_step_at_the_limit_takes_half_as_long_again() -> None:
    # From rest to rest the cubic's largest speed is 3/2 of the average.
    result = followable(a_plan(np.array([[0.0, 0.0], [1.0, 0.0]])), a_hand())
    assert result.times[-1] == pytest.approx(1.5, rel=1e-5)


def test_a_plan_slow_enough_keeps_its_times() -> None:
    joints = np.array([[0.0, 0.0], [0.1, 0.0], [0.2, 0.1]])
    planned = replace(a_plan(joints), times=np.array([0.0, 1.0, 2.0]))
    assert np.array_equal(followable(planned, a_hand()).times, planned.times)


def test_an_example_takes_at_most_a_tenth_longer(
    example: tuple[Path, Problem, PlanResult],
) -> None:
    _, problem, planned = example
    result = followable(planned, problem.hand)
    limits = np.array([joint.velocity_limit for joint in problem.hand.joints])
    assert (speeds_of(result) <= limits * (1.0 + 1e-9)).all()
    assert result.times[-1] <= 1.1 * planned.times[-1]


def test_what_is_no_plan_stays(story: Problem) -> None:
    result = PlanResult('any', Status.INFEASIBLE, story.hand.joint_names)
    assert followable(result, story.hand) is result


def test_a_plan_of_one_frame_stays_at_time_zero() -> None:
    result = followable(a_plan(np.array([[0.3, 0.4]])), a_hand())
    assert result.times.tolist() == [0.0]


def test_a_plan_of_a_century_is_refused() -> None:
    joints = np.array([[0.0, 0.0], [1.0, 0.0]])
    slow = (1e-10, 1e-10)
    with pytest.raises(CfplanError, match='2147483647 s'):
        followable(a_plan(joints, slow), a_hand(slow))


@given(st.lists(st.floats(0.0, 1e-6), min_size=1, max_size=20))
def test_rounded_times_increase_strictly(steps: list[float]) -> None:
    times = np.cumsum(steps)
    rounded = whole_nanoseconds(times)
    assert (np.diff(rounded) >= 1).all()
    assert (rounded >= np.rint(times * 1e9) - 1e-9).all()
