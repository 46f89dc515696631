from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from random_problems import random_problem

from cfplan_core import load_problem
from cfplan_core.contact.curvature import gap_hessians, wrench_rates
from cfplan_core.contact.gaps import gap_gradients
from cfplan_core.contact.held import HeldSystem
from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray

PROBLEMS = Path(__file__).parents[2] / 'config' / 'problems'
STEP = 1e-6


def wrenches(system: ContactSystem, z: FloatArray) -> FloatArray:
    pairs = np.arange(system.contact_count)
    return gap_gradients(system, system.place(z[None]), pairs)[0, :, :3]


def differences(system: ContactSystem, z: FloatArray) -> FloatArray:
    return np.stack(
        [
            (wrenches(system, z + e) - wrenches(system, z - e)) / (2.0 * STEP)
            for e in STEP * np.eye(system.dof)
        ],
        axis=-1,
    )


@pytest.mark.parametrize('seed', [1, 2, 3])
def test_rates_of_all_wrenches_are_those_of_finite_differences(seed: int) -> None:
    problem = random_problem(seed)
    system = ContactSystem(problem)
    z = system.configuration(problem.start) + 0.05 * np.random.default_rng(seed).normal(
        size=system.dof
    )
    rates = wrench_rates(system, system.place(z[None]), np.arange(system.contact_count))[0]
    np.testing.assert_allclose(rates, differences(system, z), atol=1e-8)


def test_second_derivatives_by_the_pose_are_symmetric() -> None:
    problem = random_problem(1)
    system = ContactSystem(problem)
    placed = system.place(system.configuration(problem.start)[None])
    hessians = wrench_rates(system, placed, np.arange(system.contact_count))[0, :, :, :3]
    np.testing.assert_allclose(hessians, hessians.transpose(0, 2, 1), atol=1e-12)


def test_held_joints_have_no_rates() -> None:
    problem = random_problem(1)
    whole = ContactSystem(problem)
    z = whole.configuration(problem.start)
    held = HeldSystem(whole, whole.joint_names[:1], z)
    pairs = np.arange(whole.contact_count)
    all_rates = wrench_rates(whole, whole.place(z[None]), pairs)
    rates = wrench_rates(held, held.place(held.reduced(z)[None]), pairs)
    np.testing.assert_allclose(rates, np.delete(all_rates, 3, axis=-1), atol=1e-12)


@pytest.mark.parametrize(
    'name', ['trinkle_hunter_1991', 'many_joints/two_fingers_three_joints', 'h205']
)
def test_hessians_of_all_gaps_are_those_of_finite_differences(name: str) -> None:
    problem = load_problem(PROBLEMS / f'{name}.yaml')
    system = ContactSystem(problem)
    z = system.configuration(problem.start) + 0.05 * np.random.default_rng(1).normal(
        size=system.dof
    )
    pairs = np.arange(system.contact_count)

    def gradients(at: FloatArray) -> FloatArray:
        return gap_gradients(system, system.place(at[None]), pairs)[0]

    expected = np.stack(
        [(gradients(z + e) - gradients(z - e)) / (2.0 * STEP) for e in STEP * np.eye(system.dof)],
        axis=-1,
    )
    found = gap_hessians(system, system.place(z[None]), pairs)[0]
    np.testing.assert_allclose(found, expected, atol=1e-8)
    np.testing.assert_allclose(found, found.swapaxes(-1, -2), atol=1e-12)
