from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import linprog

from cfplan_core.mechanics.closure import span_margin, span_margins

FloatArray = NDArray[np.float64]

UNDECIDABLE = 1e-6
"""Nearer to zero than this the sign of a margin is not asked for."""

ROUNDING = 1e-12

TETRAHEDRON = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])
AXES = np.concatenate([np.eye(3), -np.eye(3)])


@st.composite
def vectors(draw: st.DrawFn) -> FloatArray:
    """3 to 8 vectors: random, on a coarse grid (parallel, coplanar, redundant), or nearly so."""
    fine = st.integers(-1000, 1000).map(lambda k: k / 1000)
    coarse = st.sampled_from([-1.0, -0.5, 0.0, 0.5, 1.0])
    entry = draw(st.sampled_from([fine, coarse, coarse]))
    rows = draw(st.lists(st.tuples(entry, entry, entry), min_size=3, max_size=6))
    for index in draw(st.lists(st.integers(0, len(rows) - 1), max_size=2)):
        sign = draw(st.sampled_from([1.0, -1.0]))
        x, y, z = rows[index]
        rows.append((sign * x, sign * y, sign * z))
    noise = np.random.default_rng(draw(st.integers(0, 1000))).normal(size=(len(rows), 3))
    return np.array(rows) + draw(st.sampled_from([0.0, 0.0, 1e-5, 1e-3])) * noise


def margin(rows: FloatArray) -> float:
    return float(span_margin(rows[None])[0])


def least_reach(rows: FloatArray) -> float:
    """Smallest over all directions on the unit cube of the reach max v·u, by a program per face.

    Positive if and only if no closed half-space holds all vectors.
    """
    reaches = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            bounds = [(-1.0, 1.0)] * 3 + [(None, None)]
            bounds[axis] = (side, side)
            program = linprog(
                [0.0, 0.0, 0.0, 1.0],
                A_ub=np.column_stack([rows, -np.ones(len(rows))]),
                b_ub=np.zeros(len(rows)),
                bounds=bounds,
                options={
                    'primal_feasibility_tolerance': 1e-10,
                    'dual_feasibility_tolerance': 1e-10,
                },
            )
            assert program.status == 0
            reaches.append(program.fun)
    return min(reaches)


@given(rows=vectors())
def test_sign_is_that_of_linear_programs(rows: FloatArray) -> None:
    found = margin(rows)
    assume(abs(found) >= UNDECIDABLE or found == 0.0)
    assert (found > 0.0) == (least_reach(rows) > 1e-9)


def test_tetrahedron_spans_by_the_distance_of_its_other_corners() -> None:
    """The plane through two corners leaves the other two at a distance of √2 on either side."""
    assert margin(TETRAHEDRON) == pytest.approx(np.sqrt(2.0))


def test_axes_span_with_margin_one() -> None:
    assert margin(AXES) == pytest.approx(1.0)


def test_half_space_is_not_spanned() -> None:
    assert margin(AXES[:5]) <= 0.0


def test_plane_is_not_spanned() -> None:
    flat = np.array([[1.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0], [0.0, 1.0, 0.0]])
    assert margin(flat) == 0.0


def test_line_is_not_spanned() -> None:
    assert margin(np.outer([1.0, -1.0, 2.0, -2.0], [0.1, 0.2, 0.3])) < 0.0


def test_three_vectors_do_not_span() -> None:
    assert margin(TETRAHEDRON[:3]) < 0.0


def test_no_vectors_do_not_span() -> None:
    assert margin(np.empty((0, 3))) < 0.0


@given(rows=vectors(), index=st.integers(0, 2))
def test_repeated_vector_does_not_change_the_verdict(rows: FloatArray, index: int) -> None:
    found = margin(rows)
    assume(abs(found) >= UNDECIDABLE and len(rows) >= 4)
    again = margin(np.concatenate([rows, rows[index : index + 1]]))
    assert (again > ROUNDING) == (found > 0.0)


@given(rows=vectors(), seed=st.integers(0, 1000))
def test_disturbance_at_the_level_of_rounding_does_not_change_a_clear_verdict(
    rows: FloatArray, seed: int
) -> None:
    """Also where it turns a parallel pair of vectors, passed over, into one that is not."""
    found = margin(rows)
    assume(abs(found) > 0.01)
    noise = np.random.default_rng(seed).normal(size=rows.shape)
    for size in (1e-14, 1e-11, 1e-9, 1e-8):
        assert (margin(rows + size * noise) > 0.0) == (found > 0.0)


@given(rows=vectors(), turn=st.floats(-3.0, 3.0))
def test_margin_does_not_depend_on_the_frame(rows: FloatArray, turn: float) -> None:
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    crosses = [float(np.linalg.norm(np.cross(a, b))) for i, a in enumerate(rows) for b in rows[:i]]
    # Where vectors are all but parallel rounding decides which plane they span.
    assume(all(cross == 0.0 or cross > 1e-6 for cross in crosses))
    assume(min((cross for cross in crosses if cross > 0.0), default=0.0) > 0.0)
    assert margin(rows @ rotation.T) == pytest.approx(margin(rows), abs=1e-8)


@given(rows=vectors())
def test_order_does_not_matter(rows: FloatArray) -> None:
    assert margin(rows[::-1]) == pytest.approx(margin(rows), abs=1e-9)


def test_batch_is_judged_one_by_one() -> None:
    batch = np.random.default_rng(5).normal(size=(30, 5, 3))
    assert span_margin(batch).tolist() == [margin(rows) for rows in batch]


@given(rows=vectors())
def test_margins_are_those_of_all_vectors_and_of_all_but_the_last(rows: FloatArray) -> None:
    margins, rest, _ = span_margins(rows[None])
    assert margins.tolist() == [margin(rows)]
    assert rest.tolist() == [margin(rows[:-1])]


@pytest.mark.parametrize('count', [1, 2, 3])
def test_margins_of_few_vectors_say_that_they_do_not_span(count: int) -> None:
    margins, rest, _ = span_margins(np.eye(3)[None, :count])
    assert margins[0] < 0.0
    assert rest[0] < 0.0


def determinants(rows: FloatArray) -> list[float]:
    return [float(np.linalg.det(np.array(triple))) for triple in combinations(rows, 3)]


@given(rows=vectors(), index=st.integers(0, 2), share=st.floats(0.0, 2.0))
def test_signs_tell_where_a_determinant_changes_its_sign(
    rows: FloatArray, index: int, share: float
) -> None:
    """One vector moves towards the mirror image of its successor, through zero determinants."""
    moved = rows.copy()
    moved[index] -= share * rows[index + 1 if index + 1 < len(rows) else 0]
    before, after = determinants(rows), determinants(moved)
    assume(all(d == 0.0 or abs(d) > 1e-7 for d in np.abs([*before, *after])))
    signs = span_margins(np.array([rows, moved]))[2]
    changed = bool((np.sign(before) != np.sign(after)).any())
    assert bool((signs[0] != signs[1]).any()) == changed


@given(rows=vectors(), seed=st.integers(0, 1000), size=st.sampled_from([1e-4, 1e-2, 0.1]))
def test_verdict_is_the_same_where_all_signs_are(rows: FloatArray, seed: int, size: float) -> None:
    noise = size * np.random.default_rng(seed).normal(size=rows.shape)
    margins, rest, signs = span_margins(np.array([rows, rows + noise]))
    assume((signs[0] == signs[1]).all())
    for found in (margins, rest):
        if (np.abs(found) > UNDECIDABLE).all():
            assert (found[0] > 0.0) == (found[1] > 0.0)


def test_margin_is_continuous_across_zero() -> None:
    """A tetrahedron whose apex sinks through the opposite face: the margin is lost in between."""
    heights = np.linspace(-0.1, 0.1, 2001)
    base = np.array([[1.0, 0.0, -0.1], [-0.5, 0.8, -0.1], [-0.5, -0.8, -0.1]])
    batch = np.array([[*base, [0.0, 0.0, h]] for h in heights])
    found = span_margin(batch)
    assert np.abs(np.diff(found)).max() < 2e-4
    assert (found > 0.0).tolist() == (heights > 0.0).tolist()
