from __future__ import annotations

import numpy as np
import pytest
from random_problems import random_problem

from cfplan_core.contact.curvature import wrench_rates
from cfplan_core.contact.gaps import gap_gradients
from cfplan_core.contact.held import HeldSystem
from cfplan_core.contact.hessians import gap_hessians
from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray

STEP = 1e-6


def gradients(system: ContactSystem, z: FloatArray) -> FloatArray:
    return gap_gradients(system, system.place(z[None]), np.arange(len(system.pair_edge)))[0]


def hessians(system: ContactSystem, z: FloatArray) -> FloatArray:
    return gap_hessians(system, system.place(z[None]), np.arange(len(system.pair_edge)))[0]


@pytest.mark.parametrize('seed', [1, 2, 3])
def test_second_derivatives_of_all_gaps_are_those_of_finite_differences(seed: int) -> None:
    problem = random_problem(seed)
    system = ContactSystem(problem)
    random = np.random.default_rng(seed)
    z = system.configuration(problem.start) + 0.05 * random.normal(size=system.dof)
    differences = np.stack(
        [
            (gradients(system, z + e) - gradients(system, z - e)) / (2.0 * STEP)
            for e in STEP * np.eye(system.dof)
        ],
        axis=-1,
    )
    np.testing.assert_allclose(hessians(system, z), differences, atol=1e-8)
    np.testing.assert_allclose(differences, differences.transpose(0, 2, 1), atol=1e-7)


def test_rows_of_the_pose_are_the_rates_of_the_wrenches() -> None:
    problem = random_problem(2)
    system = ContactSystem(problem)
    z = system.configuration(problem.start)
    pairs = np.arange(system.contact_count)
    rates = wrench_rates(system, system.place(z[None]), pairs)[0]
    np.testing.assert_allclose(hessians(system, z)[: len(pairs), :3], rates, atol=1e-12)


def test_held_joints_have_no_derivatives() -> None:
    problem = random_problem(1)
    whole = ContactSystem(problem)
    z = whole.configuration(problem.start)
    held = HeldSystem(whole, whole.joint_names[:1], z)
    expected = np.delete(np.delete(hessians(whole, z), 3, axis=-1), 3, axis=-2)
    np.testing.assert_allclose(hessians(held, held.reduced(z)), expected, atol=1e-12)
