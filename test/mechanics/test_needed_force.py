from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog

from cfplan_core.mechanics.needed_force import needed_forces

DOWN = np.array([0.0, -1.0, 0.0])


def by_linear_program(wrenches: np.ndarray, load: np.ndarray) -> float:
    """Minimise F over W c = −f, 0 ≤ c ≤ F with HiGHS; inf if there is no equilibrium."""
    count = len(wrenches)
    found = linprog(
        np.append(np.zeros(count), 1.0),
        A_ub=np.hstack([np.eye(count), -np.ones((count, 1))]),
        b_ub=np.zeros(count),
        A_eq=np.hstack([wrenches.T, np.zeros((3, 1))]),
        b_eq=-load,
    )
    return float(found.fun) if found.status == 0 else np.inf


@pytest.mark.parametrize('apart', [0.1, 0.3, 0.45])
def test_two_feet_beside_the_centre_carry_half_the_weight(apart: float) -> None:
    feet = np.array([[0.0, 1.0, -apart], [0.0, 1.0, apart], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    assert needed_forces(feet[None], DOWN) == pytest.approx([0.5])


@pytest.mark.parametrize('angle', [0.2, 0.7, 1.2])
def test_a_wedge_needs_more_the_steeper_its_sides(angle: float) -> None:
    normal = np.array([np.sin(angle), np.cos(angle)])
    sides = np.array([[normal[0], normal[1], 0.0], [-normal[0], normal[1], 0.0], [0.0, -1.0, 0.3]])
    assert needed_forces(sides[None], DOWN) == pytest.approx([0.5 / np.cos(angle)])


def test_contacts_that_only_push_down_hold_nothing() -> None:
    above = np.array([[0.0, -1.0, 0.2], [0.0, -1.0, -0.2], [1.0, 0.0, 0.0]])
    assert needed_forces(above[None], DOWN)[0] == np.inf


def test_no_weight_needs_no_force() -> None:
    assert needed_forces(np.ones((2, 4, 3)), np.zeros(3)).tolist() == [0.0, 0.0]


def test_contacts_of_low_rank_count_too() -> None:
    one_below = np.array([[[0.0, 1.0, 0.0]]])
    assert needed_forces(one_below, DOWN) == pytest.approx([1.0])
    in_one_plane = np.array([[[0.0, 1.0, 0.2], [0.0, 1.0, -0.2], [0.0, 1.0, 0.1]]])
    assert needed_forces(in_one_plane, DOWN)[0] == pytest.approx(
        by_linear_program(in_one_plane[0], DOWN)
    )


@given(st.integers(3, 7), st.integers(0, 10_000))
def test_random_contacts_need_what_a_linear_program_says(count: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    angles = random.uniform(0.0, 2.0 * np.pi, count)
    wrenches = np.column_stack([np.cos(angles), np.sin(angles), random.uniform(-0.5, 0.5, count)])
    wanted = by_linear_program(wrenches, DOWN)
    if wanted < 1e3 or np.isinf(wanted):
        assert needed_forces(wrenches[None], DOWN)[0] == pytest.approx(wanted, rel=1e-6)
