from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from cfplan_ros.conversions.poses import nearest_turn, pose_message, turn_about_z, wrapped

ANGLES = st.floats(-20.0, 20.0)


@given(ANGLES)
def test_a_quaternion_is_the_turn_that_scipy_makes_of_it(angle: float) -> None:
    q = pose_message(np.array([0.0, 0.0, angle])).orientation
    expected = Rotation.from_euler('z', angle).as_matrix()
    assert np.allclose(Rotation.from_quat([q.x, q.y, q.z, q.w]).as_matrix(), expected, atol=1e-12)


@given(ANGLES)
def test_an_angle_survives_its_quaternion_but_for_whole_turns(angle: float) -> None:
    back = turn_about_z(pose_message(np.array([0.0, 0.0, angle])).orientation)
    assert -math.pi < back <= math.pi
    assert abs(math.remainder(back - angle, 2.0 * math.pi)) < 1e-12


def test_half_a_turn_is_positive() -> None:
    for angle in (math.pi, -math.pi):
        back = turn_about_z(pose_message(np.array([0.0, 0.0, angle])).orientation)
        assert back == pytest.approx(math.pi, abs=1e-15)


@given(st.floats(-1e5, 1e5), st.floats(-1e5, 1e5))
def test_a_position_survives_exactly(x: float, y: float) -> None:
    position = pose_message(np.array([x, y, 0.3])).position
    assert (position.x, position.y, position.z) == (x, y, 0.0)


@given(ANGLES, st.floats(0.0, 0.1))
def test_a_small_turn_changes_the_quaternion_little(angle: float, turn: float) -> None:
    before = pose_message(np.array([0.0, 0.0, angle])).orientation
    after = pose_message(np.array([0.0, 0.0, angle + turn])).orientation
    assert math.hypot(after.z - before.z, after.w - before.w) <= turn / 2.0 + 1e-12


@given(ANGLES, ANGLES)
def test_the_nearest_turn_is_the_angle_and_whole_turns_within_half_a_turn(
    angle: float, to: float
) -> None:
    found = nearest_turn(angle, to)
    assert abs(found - to) <= math.pi + 1e-12
    assert abs(math.remainder(found - angle, 2.0 * math.pi)) < 1e-12


@given(st.floats(-3.1, 3.1), st.floats(-0.04, 0.04))
def test_an_angle_near_enough_is_left_as_it_is(angle: float, off: float) -> None:
    assert nearest_turn(angle, angle + off) == angle
    assert wrapped(angle) == angle
