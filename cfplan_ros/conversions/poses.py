"""Planar poses as messages: in the plane z = 0, turned about z."""

from __future__ import annotations

import math

from geometry_msgs.msg import Point, Pose, Quaternion

from cfplan_core.geometry.polygon import FloatArray


def pose_message(pose: FloatArray) -> Pose:
    """Return a pose as message.

    The quaternion is (0, 0, sin φ/2, cos φ/2) without a choice of sign, so that of an object that
    turns steadily it changes steadily.

    Args:
        pose: Shape (3,): x, y in m and φ in rad.
    """
    x, y, angle = (float(value) for value in pose)
    return Pose(
        position=Point(x=x, y=y, z=0.0),
        orientation=Quaternion(x=0.0, y=0.0, z=math.sin(angle / 2.0), w=math.cos(angle / 2.0)),
    )


def turn_about_z(orientation: Quaternion) -> float:
    """Return the angle of a turn about z in (-π, π], rad; the quaternion need not be exact."""
    angle = wrapped(2.0 * math.atan2(orientation.z, orientation.w))
    return math.pi if angle == -math.pi else angle


def wrapped(angle: float) -> float:
    """Return an angle without whole turns, in [-π, π], rad; an angle inside is not changed."""
    return math.remainder(angle, 2.0 * math.pi) if abs(angle) > math.pi else angle


def nearest_turn(angle: float, to: float) -> float:
    """Add whole turns to an angle so that it lies within half a turn of another, rad."""
    turns = round((to - angle) / (2.0 * math.pi))
    return angle + turns * 2.0 * math.pi
