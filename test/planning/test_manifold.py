from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from planning.scenes import (
    BASE,
    FEET,
    HALF,
    LEFT,
    TIPS,
    at,
    formation,
    pushed_angles,
    pushed_block,
)

from cfplan_core.contact.gaps import gap_gradients, gaps
from cfplan_core.contact.system import ContactSystem, IntArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.manifold import (
    Chart,
    independent_rows,
    project,
    settle,
    tangent_basis,
)

SYSTEM = ContactSystem(pushed_block())
START = at(SYSTEM, 0.0, pushed_angles(0.0))
# Along x, in sizes: a basis need not be tangent.
SIDEWAYS = np.eye(5)[:1]


def rows(*names: str) -> IntArray:
    return formation(SYSTEM, *names).array


def largest_gap(z: FloatArray, pairs: IntArray) -> float:
    return float(np.abs(gaps(SYSTEM, SYSTEM.place(z[None]), pairs).gap).max())


# Small integers make dependent rows likely and ranks unambiguous.
matrices = arrays(
    np.int64, st.tuples(st.integers(1, 6), st.integers(3, 6)), elements=st.integers(-2, 2)
).map(lambda matrix: matrix.astype(float))


@given(matrix=matrices)
def test_independent_rows_are_as_many_as_the_rank(matrix: FloatArray) -> None:
    chosen = list(independent_rows(matrix))
    rank = np.linalg.matrix_rank(matrix)
    assert len(chosen) == rank
    assert rank == 0 or np.linalg.matrix_rank(matrix[chosen]) == rank


@given(matrix=matrices)
def test_row_is_left_out_only_if_earlier_rows_give_it(matrix: FloatArray) -> None:
    chosen = set(independent_rows(matrix))
    ranks = [0, *(np.linalg.matrix_rank(matrix[: k + 1]) for k in range(len(matrix)))]
    assert chosen == {k for k in range(len(matrix)) if ranks[k + 1] > ranks[k]}


def test_rows_that_differ_by_rounding_are_dependent() -> None:
    row = np.array([0.3, -0.7, 0.1])
    assert independent_rows(np.stack([row, row * (1.0 + 1e-12), [0.0, 0.0, 1.0]])) == (0, 2)


@given(matrix=matrices)
def test_tangent_basis_is_orthonormal_and_orthogonal_to_the_rows(matrix: FloatArray) -> None:
    independent = matrix[list(independent_rows(matrix))]
    basis = tangent_basis(independent)
    assert len(basis) == matrix.shape[1] - len(independent)
    np.testing.assert_allclose(basis @ basis.T, np.eye(len(basis)), atol=1e-12)
    np.testing.assert_allclose(independent @ basis.T, 0.0, atol=1e-12)


def test_projected_points_lie_where_the_fingertips_touch_the_block() -> None:
    """At x the tips' angles follow from the triangles of base, tip and side."""
    places = np.linspace(-0.004, 0.002, 7)
    guesses = START + (places / SYSTEM.size)[:, None] * SIDEWAYS
    found = project(SYSTEM, rows(*FEET, *TIPS), START, SIDEWAYS, guesses)
    assert found.converged.all()
    expected = [at(SYSTEM, x, pushed_angles(x)) for x in places]
    np.testing.assert_allclose(found.points, expected, atol=1e-12)


def test_points_of_a_fingertip_are_found_on_its_circle() -> None:
    """With the joint given, the block's side lies at the tip: x + BASE - HALF = LEFT cos θ."""
    system = SYSTEM
    turned = np.zeros((2, 5))
    turned[0, 3] = turned[1, 4] = 1.0
    angles = np.linspace(0.4, 0.9, 6)
    guesses = START + (angles - START[3])[:, None] * turned[0]
    found = project(system, rows(*FEET, TIPS[0]), START, turned, guesses)
    assert found.converged.all()
    x = system.object_poses(found.points)[:, 0]
    np.testing.assert_allclose(x + BASE - HALF, LEFT * np.cos(angles), atol=1e-14)


def test_point_out_of_reach_is_told_apart_from_its_neighbours() -> None:
    """The left finger is 0.05 m long, so the block cannot be further right than 0.01 m."""
    places = np.array([0.001, 0.03, 0.002])
    guesses = START + (places / SYSTEM.size)[:, None] * SIDEWAYS
    found = project(SYSTEM, rows(*FEET, *TIPS), START, SIDEWAYS, guesses)
    assert found.converged.tolist() == [True, False, True]


def test_gradients_that_come_with_projected_points_are_the_points_gradients() -> None:
    pairs = rows(*FEET, *TIPS)
    guesses = START + np.linspace(-0.05, 0.03, 5)[:, None] * SIDEWAYS
    found = project(SYSTEM, pairs, START, SIDEWAYS, guesses)
    expected = gap_gradients(SYSTEM, SYSTEM.place(found.points), pairs)
    np.testing.assert_allclose(found.gradients, expected, atol=1e-6)


@settings(max_examples=25)
@given(shift=arrays(float, 5, elements=st.floats(-1e-3, 1e-3)))
def test_projection_keeps_coordinates_along_the_tangent(shift: FloatArray) -> None:
    pairs = rows(*FEET, *TIPS)
    basis = tangent_basis(gap_gradients(SYSTEM, SYSTEM.place(START[None]), pairs)[0])
    found = project(SYSTEM, pairs, START, basis, (START + shift)[None])
    assert found.converged.all()
    np.testing.assert_allclose(basis @ (found.points[0] - START), basis @ shift, atol=1e-12)
    assert largest_gap(found.points[0], pairs) < 1e-14


def test_chart_gives_points_of_the_manifold_between_two_others() -> None:
    """Their coordinates along the tangent divide those of the ends."""
    pairs = rows(*FEET, *TIPS)
    basis = tangent_basis(gap_gradients(SYSTEM, SYSTEM.place(START[None]), pairs)[0])
    chart = Chart(SYSTEM, pairs, START, basis, np.empty((0, SYSTEM.dof)))
    before, after = (at(SYSTEM, x, pushed_angles(x)) for x in (-0.001, 0.002))
    fractions = np.array([0.0, 0.3, 1.0])
    points = chart.between(before, after, fractions)
    np.testing.assert_allclose(points[[0, 2]], [before, after], atol=1e-14)
    assert largest_gap(points[1], pairs) < 1e-14
    along = (points - before) @ basis[0]
    np.testing.assert_allclose(along, fractions * along[2], atol=1e-14)


def test_settling_lowers_a_block_onto_the_palm() -> None:
    """Straight down is the least way to both feet."""
    z = START + np.array([0.0, 1e-3, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(settle(SYSTEM, z, rows(*FEET)), START, atol=1e-14)


@settings(max_examples=25)
@given(shift=arrays(float, 5, elements=st.floats(-1e-4, 1e-4)))
def test_settled_grasp_touches_and_has_moved_across_its_contacts_only(shift: FloatArray) -> None:
    """Least motion is along the gradients, up to the square of the motion."""
    pairs = rows(*FEET, *TIPS)
    z = settle(SYSTEM, START + shift, pairs)
    assert largest_gap(z, pairs) < 1e-15
    (tangent,) = tangent_basis(gap_gradients(SYSTEM, SYSTEM.place(z[None]), pairs)[0])
    assert abs(tangent @ (z - START - shift)) < 20.0 * float(shift @ shift) + 1e-14


def test_redundant_contacts_settle_like_the_others() -> None:
    """A second palm, flush with the first, begins below the block."""
    step = [(0.01, -0.1), (0.5, -0.1), (0.5, 0.0), (0.01, 0.0)]
    system = ContactSystem(pushed_block(palms=[step]))
    names = (*FEET, *TIPS, 'object.v1|palm.1.e2', 'object.e0|palm.1.v3')
    pairs = formation(system, *names).array
    start = at(system, 0.0, pushed_angles(0.0))
    z = settle(system, start + 1e-4, pairs)
    assert np.abs(gaps(system, system.place(z[None]), pairs).gap).max() < 1e-15


@pytest.mark.parametrize('lift', [1e-9, -1e-6])
def test_settling_does_not_move_what_is_not_in_contact(lift: float) -> None:
    z = START + np.array([0.0, lift, 0.0, 0.1, -0.1])
    settled = settle(SYSTEM, z, rows(*FEET))
    np.testing.assert_array_equal(settled[3:], z[3:])
    assert math.isclose(settled[1], START[1], abs_tol=1e-14)
