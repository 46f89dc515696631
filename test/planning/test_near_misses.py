"""Near misses of a square above a table, moved through given heights."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cfplan_core import load_problem
from cfplan_core.contact.system import ContactSystem
from cfplan_core.planning.near_misses import FAR, distances, near_misses

PROBLEM = load_problem(
    Path(__file__).parents[2] / 'config' / 'problems' / 'existence' / 'link_long_enough.yaml'
)
SYSTEM = ContactSystem(PROBLEM)
START = SYSTEM.configuration(PROBLEM.start)


def lifted(*heights: float) -> np.ndarray:
    """The start with the block so far above the table, in sizes, where fingers are far away."""
    z = np.tile(START, (len(heights), 1))
    z[:, 1] += heights
    z[:, 3:] = np.pi / 2.0
    return z


def misses(*heights: float) -> np.ndarray:
    palm = [
        pair for pair in range(SYSTEM.contact_count) if '|palm' in SYSTEM.contact_names((pair,))[0]
    ]
    z = lifted(*heights)
    assert distances(SYSTEM, z)[0][:, palm].min() == pytest.approx(min(heights), abs=1e-9)
    return near_misses(SYSTEM, z, 0.1)


def test_a_block_that_comes_near_and_leaves_misses_by_the_smallest_height() -> None:
    found = misses(0.3, 0.08, 0.02, 0.06, 0.3)
    assert found.min() == pytest.approx(0.02)
    assert found[0] == FAR


def test_a_block_that_touches_before_it_leaves_misses_nothing() -> None:
    assert (misses(0.3, 0.08, 0.02, 0.0, 0.02, 0.05, 0.3) == FAR).all()


def test_what_is_near_once_more_after_it_was_left_is_a_miss() -> None:
    assert misses(0.0, 0.05, 0.2, 0.04, 0.2).min() == pytest.approx(0.04)


@pytest.mark.parametrize('heights', [(0.02, 0.05, 0.3), (0.3, 0.05, 0.02), (0.02, 0.02)])
def test_what_is_nearest_at_the_start_or_at_the_goal_is_no_miss(heights: tuple[float]) -> None:
    assert (misses(*heights) == FAR).all()


def test_what_comes_nearer_than_at_the_start_is_a_miss() -> None:
    assert misses(0.05, 0.02, 0.3).min() == pytest.approx(0.02)


def test_the_misses_are_the_same_backwards() -> None:
    heights = (0.3, 0.08, 0.02, 0.06, 0.3, 0.05, 0.2)
    assert misses(*heights).min() == misses(*heights[::-1]).min()


def test_the_lower_side_of_the_table_is_out_of_reach() -> None:
    names = SYSTEM.contact_names(range(SYSTEM.contact_count))
    distance, _ = distances(SYSTEM, lifted(0.0))
    assert distance[0, names.index('object.v0|palm.0.e2')] == pytest.approx(0.0, abs=1e-9)
    assert distance[0, names.index('object.v0|palm.0.e0')] == FAR
