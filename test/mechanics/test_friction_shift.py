"""Shifts by friction of drives with a finite stiffness, against closed forms and minimisation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize

from cfplan_core import load_problem
from cfplan_core.contact.curvature import gap_hessians
from cfplan_core.contact.elements import parse_contact
from cfplan_core.contact.gaps import gap_gradients, gaps, offset_gradients
from cfplan_core.contact.system import ContactSystem
from cfplan_core.mechanics.contact_forces import least_forces
from cfplan_core.mechanics.friction_shift import friction_shifts
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.planning.grasp_check import examine_problem

PROBLEM = load_problem(Path(__file__).parents[2] / 'config' / 'problems' / 'h1181.yaml')
SYSTEM = ContactSystem(PROBLEM)
EXAMINED = examine_problem(SYSTEM, FrictionlessModel(SYSTEM.load)).goal
assert EXAMINED is not None
GOAL = EXAMINED.z
# Three of the goal's contacts hold the object alone.
PAIRS = np.array(
    [
        SYSTEM.pair(parse_contact(name))
        for name in (
            'object.v1|palm.0.e2',
            'object.v0|left.link_1.e0',
            'object.v2|right.link_2.e2',
        )
    ]
)


def sliding_bead(kappa: float, bend: float) -> float:
    """One coordinate x with a joint θ = x / 3, two others fixed, a force of 2 along its edge x."""
    gradients = np.array([[[1.0, 0.0, 0.0, -3.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]])
    slides = np.zeros((1, 3, 4))
    slides[0, 1, 0] = 1.0
    hessians = np.zeros((1, 3, 4, 4))
    hessians[0, 1, 0, 0] = bend
    forces = np.array([[0.0, 2.0, 0.0]])
    return float(friction_shifts(gradients, slides, hessians, forces, kappa)[0])


def test_a_shift_is_force_over_stiffness_seen_through_the_transmission() -> None:
    assert sliding_bead(100.0, 0.0) == pytest.approx(2.0 * 9.0 / 100.0)


def test_a_force_that_turns_against_the_motion_stiffens_and_one_with_it_softens() -> None:
    assert sliding_bead(100.0, -1.0) == pytest.approx(2.0 / (100.0 / 9.0 + 2.0))
    assert sliding_bead(100.0, 1.0) == pytest.approx(2.0 / (100.0 / 9.0 - 2.0))


def test_drives_that_are_too_soft_do_not_keep_the_object() -> None:
    assert np.isinf(sliding_bead(17.9, 1.0))
    assert np.isfinite(sliding_bead(18.1, 1.0))


def test_contacts_that_leave_no_motion_leave_no_shift() -> None:
    gradients = np.eye(4)[None]
    found = friction_shifts(
        gradients, np.ones((1, 4, 4)), np.zeros((1, 4, 4, 4)), np.ones((1, 4)), 1.0
    )
    assert found == [0.0]


@pytest.mark.parametrize('kappa', [40.0, 330.0])
def test_a_small_friction_shifts_the_minimum_of_the_energy_as_far(kappa: float) -> None:
    """Minimise the energy of load and drives with all contacts closed, by SciPy."""
    placed = SYSTEM.place(GOAL[None])
    gradients = gap_gradients(SYSTEM, placed, PAIRS)
    slides = offset_gradients(SYSTEM, placed, PAIRS)
    forces = least_forces(gradients[..., :3], SYSTEM.load)
    torques = -forces[0] @ gradients[0, :, 3:]
    tiny = 3e-5 * kappa
    bound = 0.0
    for contact in range(len(PAIRS)):

        def energy(z: np.ndarray, contact: int = contact) -> float:
            lag = z[3:] - GOAL[3:]
            work = SYSTEM.load @ z[:3] + torques @ z[3:]
            friction = tiny * forces[0, contact] * slides[0, contact] @ (z - GOAL)
            return float(0.5 * kappa * lag @ lag - work - friction)

        def closed(z: np.ndarray) -> np.ndarray:
            return gaps(SYSTEM, SYSTEM.place(z[None]), PAIRS).gap[0]

        found = minimize(
            energy,
            GOAL,
            method='SLSQP',
            constraints={'type': 'eq', 'fun': closed},
            options={'ftol': 1e-15, 'maxiter': 200},
        )
        bound += float(np.linalg.norm(found.x[:3] - GOAL[:3])) / tiny
    shift = friction_shifts(gradients, slides, gap_hessians(SYSTEM, placed, PAIRS), forces, kappa)[
        0
    ]
    assert shift == pytest.approx(bound, rel=5e-3)
