from __future__ import annotations

import math

import numpy as np
import pytest

from cfplan_core.model import Finger, Goal, Grasp, Hand, Joint, Link, ManipulatedObject, Problem
from cfplan_core.trajectory.plan_result import PlanResult
from cfplan_core.verification.halfway import halfway
from cfplan_core.verification.mechanism import mechanism_of
from cfplan_core.verification.touching import Pair, parse_pair


def test_half_way_lies_on_the_curve_of_the_closed_form(
    sliding: tuple[Problem, PlanResult],
) -> None:
    problem, result = sliding
    mechanism = mechanism_of(problem)
    before, after = (mechanism.scene(result.object_poses[k], result.joints[k]) for k in (3, 4))
    contacts = [parse_pair(name, mechanism) for name in result.segments[0].contacts]
    middle = halfway(mechanism, before, after, contacts)
    assert middle.reached
    x, y, turn = middle.scene.pose
    expected = [math.acos((x + 0.04) / 0.05), math.acos((x - 0.021) / 0.029)]
    np.testing.assert_allclose(middle.scene.joints, expected, rtol=1e-9)
    np.testing.assert_allclose([y, turn], [0.02, 0.0], atol=1e-9)


def test_gap_half_way_is_of_second_order(sliding: tuple[Problem, PlanResult]) -> None:
    problem, result = sliding
    mechanism = mechanism_of(problem)
    before, after = (mechanism.scene(result.object_poses[k], result.joints[k]) for k in (3, 4))
    contacts = [parse_pair(name, mechanism) for name in result.segments[0].contacts]
    # A chord of the tip's circle of radius 0.029 falls short by r (1 - cos(step / 2)).
    step, angle = np.diff(result.joints[3:5, 1])[0], result.joints[3:5, 1].mean()
    sagitta = 0.029 * (1.0 - math.cos(step / 2)) * abs(math.cos(angle))
    assert halfway(mechanism, before, after, contacts).gap == pytest.approx(sagitta, rel=1e-2)


def test_leap_to_a_mirrored_branch_does_not_come_back_to_the_contacts() -> None:
    """A fingertip under an overhang that is held: it can lean either way, but not in between."""
    lean, height = 0.02, 0.03
    length = height / math.cos(lean)
    joint = Joint('j', 0.0, math.pi, 1.0, 5.0)
    outline = [(0.0, -0.001), (length, 0.0), (0.0, 0.001)]
    finger = Finger('f', (-0.025, 0.0), 0.0, (joint,), (Link('l', length, outline),))
    table = [(-0.5, -0.1), (0.5, -0.1), (0.5, 0.0), (-0.5, 0.0)]
    tee = [
        (-0.01, 0.0),
        (0.01, 0.0),
        (0.01, height),
        (0.04, height),
        (0.04, 0.04),
        (-0.04, 0.04),
        (-0.04, height),
        (-0.01, height),
    ]
    grasp = Grasp((0.0, 0.0, 0.0), (math.pi / 2 - lean,))
    thing = ManipulatedObject(tee, 0.1)
    problem = Problem('tee', (0.0, -9.81), Hand((table,), (finger,)), thing, 0.0, grasp, Goal())
    mechanism = mechanism_of(problem)
    contacts = [
        Pair('', 'palm.0', True, 0, 2),
        Pair('', 'palm.0', True, 1, 2),
        Pair('', 'f.l', False, 1, 6),
    ]
    before, after = (
        mechanism.scene(grasp.object_pose, np.array([math.pi / 2 + side * lean]))
        for side in (-1.0, 1.0)
    )
    middle = halfway(mechanism, before, after, contacts)
    assert not middle.reached or middle.detour > 0.25


@pytest.mark.parametrize('balanced', [True, False])
def test_half_way_of_two_contacts_balances_the_object_if_that_is_asked(balanced: bool) -> None:
    """A square on two pegs is in balance upright: half-way between two slanted poses."""
    width, half = 0.016, 0.02
    pegs = [[(x - 1e-4, -0.05), (x + 1e-4, -0.05), (x, 0.0)] for x in (-width / 2, width / 2)]
    thing = ManipulatedObject([(half, 0.0), (0.0, half), (-half, 0.0), (0.0, -half)], 0.1)

    def pose(turn: float) -> tuple[float, float, float]:
        corner = width / 2 * np.array([math.sin(2.0 * turn), -math.cos(2.0 * turn)])
        return corner[0] - half * math.sin(turn), corner[1] + half * math.cos(turn), turn

    joint = Joint('far_joint', -3.0, 3.0, 1.0, 5.0)
    far = Finger('far', (0.3, 0.0), 0.0, (joint,), (Link('l', 0.03, pegs[0]),))
    grasp = Grasp(pose(0.0), (1.0,))
    hand = Hand(tuple(pegs), (far,))
    problem = Problem('seat', (0.0, -9.81), hand, thing, 0.0, grasp, Goal(pose(0.0)))
    mechanism = mechanism_of(problem)
    contacts = [
        parse_pair(name, mechanism) for name in ('object.e2|palm.0.v2', 'object.e3|palm.1.v2')
    ]
    before, after = (
        mechanism.scene(np.array(pose(turn)), np.array([1.0])) for turn in (-0.01, 0.03)
    )
    middle = halfway(mechanism, before, after, contacts, balanced)
    assert middle.reached
    assert middle.scene.pose[2] == pytest.approx(0.0 if balanced else 0.01, abs=1e-6)
