from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.least_squares import constrained_minimum


def best_of_all_active_sets(
    h_matrix: FloatArray, f: FloatArray, rows: FloatArray, bounds: FloatArray
) -> FloatArray | None:
    """The feasible minimum among those of every choice of rows that hold with equality."""
    found = []
    for size in range(min(len(f), len(rows)) + 1):
        for active in map(list, combinations(range(len(rows)), size)):
            kkt = np.block([[h_matrix, -rows[active].T], [rows[active], np.zeros((size, size))]])
            a = np.linalg.lstsq(kkt, np.concatenate([f, bounds[active]]), rcond=None)[0][: len(f)]
            if (rows @ a >= bounds - 1e-7).all():
                found.append((0.5 * a @ h_matrix @ a - f @ a, a))
    return min(found, key=lambda item: item[0])[1] if found else None


@pytest.mark.parametrize('seed', range(30))
def test_minimum_is_the_best_of_all_active_sets(seed: int) -> None:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(4, 4))
    h_matrix, f = root.T @ root + 0.1 * np.eye(4), rng.normal(size=4)
    rows, bounds = rng.normal(size=(5, 4)), rng.normal(size=5) - 0.5
    expected = best_of_all_active_sets(h_matrix, f, rows, bounds)
    found = constrained_minimum(h_matrix, f, rows, bounds)
    assert expected is not None
    assert found is not None
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_contradicting_rows_have_no_minimum() -> None:
    rows, bounds = np.array([[1.0, 0.0], [-1.0, 0.0]]), np.array([1.0, 1.0])
    assert constrained_minimum(np.eye(2), np.zeros(2), rows, bounds) is None


def test_rows_that_hold_anyway_change_nothing() -> None:
    found = constrained_minimum(2.0 * np.eye(2), np.ones(2), np.eye(2), np.zeros(2))
    np.testing.assert_allclose(found, [0.5, 0.5])
