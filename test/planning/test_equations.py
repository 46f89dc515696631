from __future__ import annotations

import numpy as np
import pytest
from planning.pegs import (
    HALF,
    ON_PEG,
    ON_TIP,
    UPRIGHT,
    balanced,
    cradle,
    formation,
    lowest_nearby,
    two_fingers,
)
from scipy.optimize import minimize_scalar

from cfplan_core.contact.gaps import gaps
from cfplan_core.contact.system import ContactSystem
from cfplan_core.model import Grasp
from cfplan_core.planning.equations import (
    EQUILIBRIUM,
    equation_gradients,
    equations,
    formation_rows,
)
from cfplan_core.planning.manifold import formation_equations, project, settle

TIPS = ('object.e2|left.link.v1', 'object.e3|right.link.v1')


def test_two_contacts_have_their_equilibrium_as_third_equation() -> None:
    assert formation_rows(np.array([4, 7])).tolist() == [4, 7, EQUILIBRIUM]


@pytest.mark.parametrize('pairs', [[], [3], [1, 2, 5], [1, 2, 5, 8]])
def test_other_numbers_of_contacts_have_no_more_equations(pairs: list[int]) -> None:
    assert formation_rows(np.array(pairs, dtype=np.intp)).tolist() == pairs


def test_gradients_of_equations_are_those_of_finite_differences() -> None:
    problem = two_fingers()
    system = ContactSystem(problem)
    rows = formation_rows(formation(system, *TIPS).array)
    z = system.configuration(problem.start) + np.array([0.1, 0.02, 0.3, 0.05, -0.1])
    step = 1e-6 * np.eye(system.dof)
    expected = (
        equations(system, system.place(z + step), rows)[0]
        - equations(system, system.place(z - step), rows)[0]
    ) / 2e-6
    found = equation_gradients(system, z[None], rows)[0]
    np.testing.assert_allclose(found, expected.T, atol=1e-8)


@pytest.mark.parametrize('bend', [-0.1, -0.03, 0.02, 0.05])
def test_settled_object_is_at_the_least_height_on_its_contacts(bend: float) -> None:
    """The second method turns the square on both contacts and looks for the least height."""
    problem = cradle(())
    system = ContactSystem(problem)
    z, pairs = balanced(
        system, Grasp(problem.start.object_pose, (UPRIGHT + bend,)), ON_PEG, ON_TIP
    )
    assert np.abs(gaps(system, system.place(z[None]), pairs).gap).max() < 1e-12

    def height(angle: float) -> float:
        held = np.eye(system.dof)[[2, 3]]
        turned = project(system, pairs, z, held, (z + angle * np.eye(4)[2])[None])
        return float(turned.points[0, 1])

    found = minimize_scalar(height, bounds=(-0.15, 0.15), method='bounded')
    assert found.x == pytest.approx(0.0, abs=1e-4)
    assert lowest_nearby(system, z, pairs, 3e-3) > 0.0


def test_configurations_on_the_manifold_are_determined_by_the_joints() -> None:
    """Two joints, two contacts and their balance: a plane of dimension two."""
    problem = two_fingers()
    system = ContactSystem(problem)
    pairs = formation(system, *TIPS).array
    rows, gradients = formation_equations(system, pairs, system.configuration(problem.start))
    assert rows.tolist() == [*pairs.tolist(), EQUILIBRIUM]
    assert np.linalg.matrix_rank(gradients[:, :3]) == 3
    assert system.dof - len(rows) == 2


def test_settling_keeps_joints_at_their_limits_where_it_can() -> None:
    problem = cradle(())
    system = ContactSystem(problem)
    system.upper = np.array([UPRIGHT - 1e-9])
    start = system.configuration(problem.start)
    rows = formation_rows(formation(system, ON_PEG, ON_TIP).array)
    z = settle(system, start + np.array([1e-4, 1e-4, 1e-4, 0.0]), rows)
    assert z[3] <= system.upper[0]
    assert np.abs(equations(system, system.place(z[None]), rows)[0]).max() < 1e-10
    assert z[1] * system.size == pytest.approx(HALF - 0.008, abs=1e-6)
