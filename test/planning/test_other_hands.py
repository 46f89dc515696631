from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from planning.scenes import HALF, TABLE, Polygon, finger, pushed_angles, pushed_block, tip

from cfplan_core import PlanOptions, PlanResult, plan
from cfplan_core.model import Finger, Goal, Grasp, Hand, Joint, Link, ManipulatedObject, Problem
from cfplan_core.verification import verify_plan


def certify(problem: Problem, result: PlanResult) -> None:
    assert result.solved, result.message
    report = verify_plan(problem, result)
    assert report.failures == ()


def grasp_goal(problem: Problem, grasp: Grasp) -> Goal:
    return Goal(
        grasp.object_pose,
        dict(zip(problem.hand.joint_names, grasp.joints.tolist(), strict=True)),
    )


def between(problem: Problem, start: Grasp, goal: Grasp) -> Problem:
    """Replace a problem's grasps."""
    return replace(problem, start=start, goal=grasp_goal(problem, goal))


def at(x: float, angles: Sequence[float] | None = None) -> Grasp:
    return Grasp((x, 0.0, 0.0), pushed_angles(x) if angles is None else angles)


def test_third_finger_keeps_its_contact_on_top_of_the_block() -> None:
    problem, at_top = thumb_problem()
    problem = between(problem, at_top(-0.002, 0.0), at_top(0.006, 0.0))
    result = plan(problem)
    certify(problem, result)
    assert all('object.e2|thumb.link.v1' in segment.contacts for segment in result.segments)


def test_third_finger_that_stays_away_may_move_meanwhile() -> None:
    problem, at_top = thumb_problem()
    problem = between(problem, at_top(-0.002, 0.3), at_top(0.006, 0.1))
    certify(problem, plan(problem))


def test_third_finger_is_put_on_top_of_the_block() -> None:
    problem, at_top = thumb_problem()
    problem = between(problem, at_top(-0.002, 0.3), at_top(0.006, 0.0))
    certify(problem, plan(problem))


def test_pose_a_step_away_is_driven_to_where_four_joints_leave_room() -> None:
    problem = four_joints((0.0005, 0.0, 0.0))
    certify(problem, plan(problem, PlanOptions(time_budget=20.0)))


def four_joints(pose: tuple[float, float, float]) -> Problem:
    """Two fingers of two joints pinch a block that stands on the palm; a goal of a pose only."""
    thick = 0.004
    fingers = []
    for name, side, low, high in (('thumb', -1, 0.0, thick), ('index', 1, -thick, 0.0)):
        links = [
            Link(f'link_{k}', length, [(0.0, low), (length, low), (length, high), (0.0, high)])
            for k, length in enumerate((0.03, 0.045))
        ]
        joints = [
            Joint(f'{name}_0', 0.0, 3.1, 2.0, 1.0),
            Joint(f'{name}_1', -2.5, 2.5, 2.0, 1.0),
        ]
        fingers.append(Finger(name, (side * 0.06, 0.0), 0.0, tuple(joints), tuple(links)))
    block = ManipulatedObject([(-HALF, 0.0), (HALF, 0.0), (HALF, 0.04), (-HALF, 0.04)], 0.05)
    # Of the upper link, at 1.4 rad, the lower one bends back to the block's upper corner.
    bend = _bend_to(complex(-HALF, 0.04), complex(-0.06, 0.0), 1.4)
    start = Grasp((0.0, 0.0, 0.0), (1.4, bend, math.pi - 1.4, -bend))
    return Problem(
        'four_joints',
        (0.0, -9.81),
        Hand((TABLE,), tuple(fingers)),
        block,
        0.0,
        start,
        Goal(object_pose=pose),
    )


def _bend_to(corner: complex, base: complex, turn: float) -> float:
    """Angle of the second joint at which the second link's lower edge runs through a corner."""
    elbow = base + 0.03 * np.exp(1j * turn)
    return float(np.angle(corner - elbow)) - turn


def thumb_problem() -> tuple[Problem, Callable[[float, float], Grasp]]:
    """A third finger above the block, and grasps with it lifted by an angle from the top."""
    length = 0.061
    thumb = replace(finger('thumb', (0.0, 0.1), tip(length), limits=(-3.0, 0.0)), base_angle=0.0)
    down = -math.asin((0.1 - 0.04) / length)
    problem = pushed_block()
    hand = Hand(problem.hand.palm, (*problem.hand.fingers, thumb))

    def at_top(x: float, lifted: float) -> Grasp:
        return at(x, (*pushed_angles(x), down + lifted))

    return replace(problem, hand=hand), at_top


def test_one_finger_pushes_a_rod_up_a_wall() -> None:
    """The rod's foot slides on the palm and its other end up the wall at x = 0.

    The finger hangs above the foot and pushes the corner there: three contacts, a curve.
    """
    length, thickness = 0.06, 0.004
    base = np.array([-0.05, 0.05])
    wall = [(0.0, 0.0), (0.05, 0.0), (0.05, 0.1), (0.0, 0.1)]
    hanging = [(0.0, -0.004), (0.055, -0.004), (0.055, 0.0), (0.0, 0.0)]

    def leaning(phi: float) -> Grasp:
        c, s = math.cos(phi), math.sin(phi)
        x, y = -length * c - thickness * s - base[0], thickness * c - base[1]
        return Grasp((-length * c, 0.0, phi), (math.atan2(y, x),))

    rod = ManipulatedObject(
        [(0.0, 0.0), (length, 0.0), (length, thickness), (0.0, thickness)], 0.1
    )
    hand = Hand((TABLE, wall), (finger('only', (-0.05, 0.05), hanging, limits=(-3.0, 0.0)),))
    problem = Problem('rod', (0.0, -9.81), hand, rod, 0.0, leaning(0.8), Goal((0.0, 0.0, 0.0)))
    problem = between(problem, leaning(0.8), leaning(1.0))
    result = plan(problem)
    certify(problem, result)
    (segment,) = result.segments
    assert segment.contacts == (
        'object.v0|palm.0.e2',
        'object.v1|palm.1.e3',
        'object.v3|only.link.e2',
    )


def chain(name: str, base: tuple[float, float]) -> Finger:
    """Two joints; a link of 40 mm, then a pointed one of 30 mm."""
    outlines: list[Polygon] = [
        [(0.0, -0.002), (0.04, -0.002), (0.04, 0.002), (0.0, 0.002)],
        tip(0.03),
    ]
    return Finger(
        name,
        base,
        0.0,
        tuple(Joint(f'{name}_{k}', -3.1, 3.1, 1.0, 5.0) for k in range(2)),
        tuple(
            Link(link, outline[1][0], outline)
            for link, outline in zip(('first', 'link'), outlines, strict=True)
        ),
    )


def reach(x: float, y: float, elbow: float) -> tuple[float, float]:
    """Joint angles of a chain whose tip is at (x, y) from its base; elbow is 1 or -1."""
    bend = elbow * math.acos((x**2 + y**2 - 0.04**2 - 0.03**2) / (2.0 * 0.04 * 0.03))
    first = math.atan2(y, x) - math.atan2(0.03 * math.sin(bend), 0.04 + 0.03 * math.cos(bend))
    return math.remainder(first, 2.0 * math.pi), bend


@pytest.mark.parametrize(
    ('start', 'goal'),
    [
        ((0.0, 0.02, 0.025), (0.003, 0.03, 0.015)),
        ((-0.004, 0.03, 0.025), (0.004, 0.02, 0.03)),
        ((0.01, 0.02, 0.03), (-0.01, 0.035, 0.03)),
    ],
)
def test_fingers_of_two_joints_slide_the_block_and_along_it(
    start: tuple[float, float, float], goal: tuple[float, float, float]
) -> None:
    """From and to given places and heights of the left and the right tip: dimension three."""

    def holding(x: float, left: float, right: float) -> Grasp:
        at_left = reach(x - HALF + 0.07, left - 0.02, -1.0)
        return at(x, (*at_left, *reach(x + HALF - 0.07, right - 0.02, 1.0)))

    hand = Hand((TABLE,), (chain('left', (-0.07, 0.02)), chain('right', (0.07, 0.02))))
    problem = between(replace(pushed_block(), hand=hand), holding(*start), holding(*goal))
    certify(problem, plan(problem, PlanOptions(time_budget=20.0)))


def test_finger_of_two_joints_works_with_one_of_one() -> None:
    def holding(x: float, height: float) -> Grasp:
        return at(x, (*reach(x - HALF + 0.07, height - 0.02, -1.0), pushed_angles(x)[1]))

    right = pushed_block().hand.fingers[1]
    hand = Hand((TABLE,), (chain('left', (-0.07, 0.02)), right))
    problem = between(
        replace(pushed_block(), hand=hand), holding(-0.003, 0.02), holding(0.004, 0.03)
    )
    certify(problem, plan(problem, PlanOptions(time_budget=20.0)))
