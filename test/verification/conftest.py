"""Plans whose geometry and forces are known in closed form."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from cfplan_core.model import (
    Finger,
    Goal,
    Grasp,
    Hand,
    Joint,
    Link,
    ManipulatedObject,
    Problem,
)
from cfplan_core.trajectory.plan_result import PlanResult, Segment, Status

FloatArray = NDArray[np.float64]
Plan = tuple[Problem, PlanResult]

WEIGHT = 0.981
"""Of every object here, N: 0.1 kg."""

TABLE = [(-0.5, -0.1), (0.5, -0.1), (0.5, 0.0), (-0.5, 0.0)]


def pointed_finger(
    name: str, base: tuple[float, float], length: float, mass: float = 0.0
) -> Finger:
    """One joint, one thin triangle whose vertex 1 is the tip."""
    joint = Joint(f'{name}_joint', 0.0, math.pi, velocity_limit=1.0, effort_limit=5.0)
    outline = [(0.0, -0.002), (length, 0.0), (0.0, 0.002)]
    return Finger(name, base, 0.0, (joint,), (Link('link', length, outline, mass),))


def box(half_width: float, half_height: float) -> ManipulatedObject:
    corners = [
        (-half_width, -half_height),
        (half_width, -half_height),
        (half_width, half_height),
        (-half_width, half_height),
    ]
    return ManipulatedObject(corners, 0.1)


def sliding_geometry() -> tuple[FloatArray, FloatArray]:
    """Poses and joints of a box that two fingertips slide 4 mm to the left, to a wall.

    The box has half width 0.02. Tip heights are base height 0 plus length times sine.
    """
    shifts = -0.0005 * np.arange(9)
    left = np.arccos((shifts + 0.04) / 0.05)
    right = np.arccos((shifts - 0.021) / 0.029)
    # Then the left finger lifts off while the wall holds the box.
    left = np.concatenate([left, left[-1] + 0.04 * np.arange(1, 5)])
    right = np.concatenate([right, np.full(4, right[-1])])
    shifts = np.concatenate([shifts, np.full(4, shifts[-1])])
    poses = np.column_stack([shifts, np.full(13, 0.02), np.zeros(13)])
    return poses, np.column_stack([left, right])


def sliding_limits(joints: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Torque limits by hand.

    Both tips press with the force s, the left at height a, the right at height b < a. The couple
    s (a - b) shifts the weight's support from one lower corner to the other, until that carries
    all of it: s (a - b) = weight * 0.02. At the wall, whose corners are at heights 0.004 and
    0.01, the couple is s (b - 0.01) at least, on the other side. A tip at height h that presses
    with s needs the torque s h, clockwise on the left.
    """
    a, b = 0.05 * np.sin(joints[:, 0]), 0.029 * np.sin(joints[:, 1])
    lower, upper = np.zeros((13, 2)), np.zeros((13, 2))
    force = WEIGHT * 0.02 / (a[:9] - b[:9])
    lower[:9, 0] = -force * a[:9]
    upper[:9, 1] = force * b[:9]
    upper[9:, 1] = WEIGHT * 0.02 / (b[9:] - 0.01) * b[9:]
    return lower, upper


@pytest.fixture
def sliding() -> Plan:
    """Slide a box along the table to a wall, then let go on one side: two force closures."""
    wall = [(-0.03, 0.004), (-0.024, 0.004), (-0.024, 0.01), (-0.03, 0.01)]
    fingers = (
        pointed_finger('left', (-0.06, 0.0), 0.05),
        pointed_finger('right', (0.041, 0.0), 0.029),
    )
    poses, joints = sliding_geometry()
    lower, upper = sliding_limits(joints)
    problem = Problem(
        name='sliding',
        gravity=(0.0, -9.81),
        hand=Hand((TABLE, wall), fingers),
        object=box(0.02, 0.02),
        friction=0.0,
        start=Grasp(poses[0], joints[0]),
        goal=Goal(
            poses[-1],
            {'left_joint': joints[-1, 0], 'right_joint': joints[-1, 1]},
            ('object.e3|palm.1.v2',),
        ),
    )
    table = ('object.v0|palm.0.e2', 'object.v1|palm.0.e2')
    tips = ('object.e3|left.link.v1', 'object.e1|right.link.v1')
    walls = ('object.e3|palm.1.v1', 'object.e3|palm.1.v2')
    result = PlanResult(
        problem='sliding',
        status=Status.SOLVED,
        joint_names=('left_joint', 'right_joint'),
        times=0.1 * np.arange(13),
        joints=joints,
        object_poses=poses,
        torque_lower=lower,
        torque_upper=upper,
        segments=(
            Segment((*table, *tips), 'force_closure', 0, 8),
            Segment((*table, *walls, tips[1]), 'force_closure', 8, 12),
        ),
    )
    return problem, result


@pytest.fixture
def squeezed() -> Plan:
    """Hold a trapezoid on the table between two tips that press inward and down: form closure.

    Half widths 0.03 below and 0.01 above, height 0.04; the tips are on its sides at half height,
    20 mm from the middle, each link leaning at 3-4-5. Any squeeze is balanced by the table, none
    is needed: the torque limits are 0 and infinity.
    """
    fingers = (
        pointed_finger('left', (-0.035, 0.0), 0.025),
        pointed_finger('right', (0.035, 0.0), 0.025),
    )
    lean = math.atan2(4.0, 3.0)
    thing = ManipulatedObject(
        [(-0.03, 0.0), (0.03, 0.0), (0.01, 0.04), (-0.01, 0.04)], 0.1, (0.0, 0.015)
    )
    grasp = Grasp((0.0, 0.0, 0.0), (lean, math.pi - lean))
    problem = Problem(
        name='squeezed',
        gravity=(0.0, -9.81),
        hand=Hand((TABLE,), fingers),
        object=thing,
        friction=0.0,
        start=grasp,
        goal=Goal(grasp.object_pose, {'left_joint': lean}),
    )
    contacts = (
        'object.v0|palm.0.e2',
        'object.v1|palm.0.e2',
        'object.e3|left.link.v1',
        'object.e1|right.link.v1',
    )
    result = PlanResult(
        problem='squeezed',
        status=Status.SOLVED,
        joint_names=('left_joint', 'right_joint'),
        times=np.arange(3.0),
        joints=np.tile(grasp.joints, (3, 1)),
        object_poses=np.tile(grasp.object_pose, (3, 1)),
        torque_lower=np.tile([-np.inf, 0.0], (3, 1)),
        torque_upper=np.tile([0.0, np.inf], (3, 1)),
        segments=(Segment(contacts, 'form_closure', 0, 2),),
    )
    return problem, result


def seat(width: float) -> Plan:
    """A square on its corner between two corners of the hand, `width` apart, and a heavy finger.

    The corner moves on the circle over the width (Thales), twice as fast as the square turns. With
    half diagonal d the centre is at height d cos φ - (width / 2) cos 2φ, so the energy has the
    curvature weight * (2 width - d).
    """
    half = 0.02
    thing = ManipulatedObject([(half, 0.0), (0.0, half), (-half, 0.0), (0.0, -half)], 0.1)
    right = [(width / 2, -0.1), (0.1, -0.1), (0.1, 0.0), (width / 2, 0.0)]
    left = [(-0.1, -0.1), (-width / 2, -0.1), (-width / 2, 0.0), (-0.1, 0.0)]
    finger = pointed_finger('far', (0.3, 0.0), 0.06, mass=0.2)
    grasp = Grasp((0.0, half - width / 2, 0.0), (1.0,))
    problem = Problem(
        name='seat',
        gravity=(0.0, -9.81),
        hand=Hand((right, left), (finger,)),
        object=thing,
        friction=0.0,
        start=grasp,
        goal=Goal(grasp.object_pose),
    )
    # The triangle's centroid is a third of the way to the tip.
    torque = 0.2 * 9.81 * 0.02 * math.cos(1.0)
    result = PlanResult(
        problem='seat',
        status=Status.SOLVED,
        joint_names=('far_joint',),
        times=np.arange(3.0),
        joints=np.tile(grasp.joints, (3, 1)),
        object_poses=np.tile(grasp.object_pose, (3, 1)),
        torque_lower=np.full((3, 1), torque),
        torque_upper=np.full((3, 1), torque),
        segments=(Segment(('object.e3|palm.0.v3', 'object.e2|palm.1.v2'), 'second_order', 0, 2),),
    )
    return problem, result


@pytest.fixture
def seated() -> Plan:
    return seat(0.016)


@pytest.fixture
def make_seat() -> Callable[[float], Plan]:
    return seat
