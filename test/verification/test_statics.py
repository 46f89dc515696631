from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from cfplan_core.model import Finger, Goal, Grasp, Hand, Joint, Link, ManipulatedObject, Problem
from cfplan_core.verification.mechanism import Mechanism, mechanism_of
from cfplan_core.verification.statics import (
    Balance,
    balance_of,
    best_equilibrium,
    closure_margin,
    internal_force,
    least_effort,
    smallest_singular_value,
    torque_limits,
)
from cfplan_core.verification.touching import Pair, locate

FloatArray = NDArray[np.float64]
DOWN = np.array([0.0, -1.0, 0.0])
CONTACTS = st.lists(
    st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(0.0, 2.0 * math.pi)),
    min_size=4,
    max_size=6,
)


def wrench(x: float, y: float, angle: float) -> tuple[float, float, float]:
    n_x, n_y = math.cos(angle), math.sin(angle)
    return n_x, n_y, x * n_y - y * n_x


def balance(wrenches: FloatArray, arms: FloatArray | None = None) -> Balance:
    if arms is None:
        arms = np.zeros((wrenches.shape[1], 1))
    return Balance(wrenches, DOWN, arms, np.zeros(arms.shape[1]), 1.0)


def table(x: float) -> tuple[float, float, float]:
    return wrench(x, 0.0, math.pi / 2)


def test_table_carries_the_weight_in_proportion() -> None:
    held = balance(np.array([table(-1.0), table(3.0)]).T)
    least, forces = best_equilibrium(held)
    assert least == pytest.approx(0.25)
    np.testing.assert_allclose(forces, [0.75, 0.25])


def test_support_beside_the_weight_would_have_to_pull() -> None:
    least, forces = best_equilibrium(balance(np.array([table(1.0), table(3.0)]).T))
    assert least == pytest.approx(-0.5)
    np.testing.assert_allclose(forces, [1.5, -0.5])


def test_single_support_beside_the_weight_has_no_equilibrium() -> None:
    least, forces = best_equilibrium(balance(np.array([table(1.0)]).T))
    assert least == -math.inf
    assert np.isnan(forces).all()


def test_table_alone_does_not_span_wrench_space() -> None:
    held = balance(np.array([table(-1.0), table(0.0), table(1.0)]).T)
    assert smallest_singular_value(held) == pytest.approx(0.0, abs=1e-12)


def test_triangle_of_contacts_around_the_centre_is_not_form_closure() -> None:
    angles = np.array([0.0, 2.0, 4.0]) * math.pi / 3 + 0.3
    held = balance(np.array([wrench(-math.cos(a), -math.sin(a), a) for a in angles]).T)
    assert smallest_singular_value(held) == pytest.approx(0.0, abs=1e-12)
    assert internal_force(held) == pytest.approx(1.0)


def two_pairs(couple: float) -> Balance:
    """An upright pair with the couple 0.4 and a level pair with another, per unit of force."""
    return balance(
        np.array(
            [
                wrench(0.2, -1.0, math.pi / 2),
                wrench(-0.2, 1.0, -math.pi / 2),
                wrench(1.0, couple / 2, math.pi),
                wrench(-1.0, -couple / 2, 0.0),
            ]
        ).T
    )


def test_pairs_that_turn_against_each_other_are_form_closure() -> None:
    assert closure_margin(two_pairs(-0.4)) == pytest.approx(1.0)


def test_pairs_are_as_far_in_form_closure_as_their_couples_are_alike() -> None:
    assert closure_margin(two_pairs(-1.6)) == pytest.approx(0.25)


def test_pairs_that_turn_the_same_way_are_not_form_closure() -> None:
    assert closure_margin(two_pairs(0.4)) == pytest.approx(0.0, abs=1e-9)


@settings(max_examples=40, deadline=None)
@given(contacts=CONTACTS)
def test_form_closure_is_found_where_all_triples_say_so(
    contacts: list[tuple[float, float, float]],
) -> None:
    """W positively spans if no plane through two wrenches has all others on one side."""
    wrenches = np.array([wrench(*contact) for contact in contacts]).T
    held = balance(wrenches)
    assume(smallest_singular_value(held) > 1e-3)
    margins = []
    for i, j in combinations(range(len(contacts)), 2):
        normal = np.cross(wrenches[:, i], wrenches[:, j])
        if np.linalg.norm(normal) > 1e-3:
            sides = normal @ wrenches / np.linalg.norm(normal)
            margins.append(min(sides.max(), -sides.min()))
    assume(margins)
    assume(all(abs(margin) < 1e-9 or margin > 1e-3 for margin in margins))
    spans = min(margins) > 1e-3
    assert (closure_margin(held) > 1e-9) == spans


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.filter_too_much])
@given(contacts=CONTACTS, arms=st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6))
def test_torque_limits_are_those_of_the_corners_of_the_force_polytope(
    contacts: list[tuple[float, float, float]], arms: list[float]
) -> None:
    wrenches = np.array([wrench(*contact) for contact in contacts]).T
    column = np.array(arms[: len(contacts)])
    assume(np.abs(column).max() > 1e-3)
    corners = []
    for triple in combinations(range(len(contacts)), 3):
        basis = wrenches[:, triple]
        assume(abs(np.linalg.det(basis)) > 1e-3)
        forces = np.linalg.solve(basis, -DOWN)
        assume(abs(forces.min()) > 1e-6)
        if forces.min() > 0.0:
            corners.append(float(forces @ column[list(triple)]))
    held = balance(wrenches, column[:, None])
    lower, upper = torque_limits(held, 0.0)
    if not corners:
        assert np.isnan([lower, upper]).all()
        return
    for limit, corner in ((lower[0], min(corners)), (upper[0], max(corners))):
        if np.isfinite(limit):
            assert limit == pytest.approx(corner, rel=1e-6, abs=1e-9)
        else:
            assert closure_margin(held) > 0.0 or internal_force(held) > 0.5


def test_squeeze_between_opposite_contacts_is_unbounded_on_one_side() -> None:
    wrenches = np.array(
        [table(-1.0), table(1.0), wrench(-1.0, 0.5, 0.0), wrench(1.0, 0.5, math.pi)]
    ).T
    lower, upper = torque_limits(balance(wrenches, np.array([[0.0, 0.0, 0.3, 0.0]]).T), 0.0)
    assert (lower[0], upper[0]) == (0.0, math.inf)


def test_limit_of_form_closure_still_squeezes() -> None:
    wrenches = np.array(
        [table(-1.0), table(1.0), wrench(-1.0, 0.5, 0.0), wrench(1.0, 0.5, math.pi)]
    ).T
    assert closure_margin(balance(wrenches)) == pytest.approx(0.0, abs=1e-9)
    assert internal_force(balance(wrenches)) == pytest.approx(1.0, abs=1e-5)


def test_contacts_from_below_do_not_squeeze() -> None:
    wrenches = np.array([table(-1.0), table(0.5), wrench(0.0, -1.0, 1.2), wrench(0.0, -1.0, 2.0)])
    assert internal_force(balance(wrenches.T)) < 1e-4


def arm(
    angles: FloatArray, contacts: Sequence[Pair] = ()
) -> tuple[Mechanism, FloatArray, Balance]:
    """A heavy arm of two links and an object near its end.

    Returns:
        The mechanism, the gaps of the contacts in m, and their balance.
    """
    outline = [(0.0, -0.01), (0.2, -0.01), (0.2, 0.01), (0.0, 0.01)]
    joints = tuple(
        Joint(name, -3.0, 3.0, 1.0, effort) for name, effort in (('a', 4.0), ('b', 1.0))
    )
    links = (Link('upper', 0.2, outline, 0.5), Link('lower', 0.2, outline, 0.25))
    hand = Hand((), (Finger('arm', (0.1, 0.0), 0.0, joints, links),))
    thing = ManipulatedObject([(0.0, 0.0), (0.03, 0.0), (0.0, 0.04)], 0.1)
    grasp = Grasp((0.45, 0.02, 0.3), angles)
    problem = Problem('arm', (0.0, -9.81), hand, thing, 0.0, grasp, Goal())
    mechanism = mechanism_of(problem)
    scene = mechanism.scene(grasp.object_pose, angles)
    placed = [(pair, locate(pair, scene)) for pair in contacts]
    gaps = np.array([touch.gap for _, touch in placed])
    return mechanism, gaps, balance_of(mechanism, scene, placed)


def test_level_arm_needs_positive_torque_to_carry_itself() -> None:
    _, _, held = arm(np.zeros(2))
    g = 9.81
    expected = [0.5 * g * 0.1 + 0.25 * g * 0.3, 0.25 * g * 0.1]
    np.testing.assert_allclose(held.link_torques, expected, rtol=1e-12)


def test_link_torques_are_the_slope_of_the_potential_energy() -> None:
    angles = np.array([0.7, -1.9])

    def energy(a: FloatArray) -> float:
        first = 0.1 * math.sin(a[0])
        second = 0.2 * math.sin(a[0]) + 0.1 * math.sin(a[0] + a[1])
        return 9.81 * (0.5 * first + 0.25 * second)

    steps = 1e-6 * np.eye(2)
    slope = [(energy(angles + s) - energy(angles - s)) / 2e-6 for s in steps]
    np.testing.assert_allclose(arm(angles)[2].link_torques, slope, rtol=1e-8)


@pytest.mark.parametrize(
    'pair',
    [Pair('', 'arm.lower', True, 0, 2), Pair('', 'arm.lower', False, 2, 1)],
    ids=['object vertex on link edge', 'link vertex on object edge'],
)
def test_lever_arms_are_the_slopes_of_the_gap(pair: Pair) -> None:
    angles = np.array([0.3, -0.2])
    _, _, held = arm(angles, [pair])
    for joint in range(2):
        step = np.zeros(2)
        step[joint] = 1e-6
        slope = (arm(angles + step, [pair])[1] - arm(angles - step, [pair])[1]) / 2e-6
        # -J has the length unit of the object's size, 0.05.
        assert -held.lever_arms[0, joint] * 0.05 == pytest.approx(slope[0], rel=1e-6)


def test_effort_of_an_idle_arm_is_what_its_links_need() -> None:
    mechanism, _, idle = arm(np.zeros(2))
    carried = replace(
        idle, wrenches=np.array([table(-1.0), table(1.0)]).T, lever_arms=np.zeros((2, 2))
    )
    expected = max(idle.link_torques / [4.0, 1.0])
    assert least_effort(mechanism, carried, 0.0) == pytest.approx(expected)


def test_least_effort_chooses_the_forces() -> None:
    """A squeeze s relieves joint a and loads joint b: |4 - s| / 4 and s / 1 meet at s = 0.8."""
    mechanism, _, idle = arm(np.zeros(2))
    wrenches = np.array(
        [table(-1.0), table(1.0), wrench(-1.0, 0.5, 0.0), wrench(1.0, 0.5, math.pi)]
    ).T
    arms = np.zeros((4, 2))
    arms[2] = -1.0, 1.0
    squeezed = replace(
        idle,
        wrenches=wrenches,
        lever_arms=arms,
        link_torques=np.array([4.0, 0.0]),
        torque_unit=1.0,
    )
    assert least_effort(mechanism, squeezed, 0.0) == pytest.approx(0.8)
