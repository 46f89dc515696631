from __future__ import annotations

import math

import numpy as np
import pytest
from planning.scenes import (
    BASE,
    FEET,
    HALF,
    LEFT,
    RIGHT,
    TIPS,
    at,
    formation,
    pushed_angles,
    pushed_block,
    x_of,
)

from cfplan_core.contact.elements import parse_contact
from cfplan_core.contact.gaps import gap_gradients, gaps
from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.events import Candidate, EventKind
from cfplan_core.planning.locating import locate
from cfplan_core.planning.manifold import Chart, tangent_basis

# Its corner, vertex 2, stops the block's left side at x = -0.003.
WALL = [(-0.03, 0.004), (-0.025, 0.004), (-0.023, 0.007), (-0.025, 0.01), (-0.03, 0.01)]
SYSTEM = ContactSystem(pushed_block(height=0.035, limits=(0.01, 2.9), palms=[WALL]))


def find(kind: EventKind, index: int, target: float, first: float, last: float) -> float | None:
    """Where an event happens between two places of the block; None if it does not."""
    before, after = (at(SYSTEM, x, pushed_angles(x)) for x in (first, last))
    rows = formation(SYSTEM, *FEET, *TIPS).array
    basis = tangent_basis(gap_gradients(SYSTEM, SYSTEM.place(before[None]), rows)[0])
    chart = Chart(SYSTEM, rows, before, basis, np.empty((0, SYSTEM.dof)))
    candidate = Candidate(kind, index, target, 0.5)
    z = locate(chart, candidate, before, after, after - before)
    if z is None:
        return None
    assert largest_gap(z) < 1e-12
    return x_of(SYSTEM, z)


def largest_gap(z: FloatArray) -> float:
    rows = formation(SYSTEM, *FEET, *TIPS).array
    return float(np.abs(gaps(SYSTEM, SYSTEM.place(z[None]), rows).gap).max())


def pair(name: str) -> int:
    return SYSTEM.pair(parse_contact(name))


@pytest.mark.parametrize(('first', 'last'), [(0.0, -0.0034), (-0.0029, -0.0031), (-0.0035, 0.0)])
def test_gap_is_located_where_it_closes(first: float, last: float) -> None:
    found = find(EventKind.CONTACT, pair('object.e3|palm.1.v2'), 0.0, first, last)
    assert found == pytest.approx(-0.003, abs=1e-12)


def test_joint_limit_is_located_at_its_angle() -> None:
    x = BASE - HALF + RIGHT * math.cos(2.9)
    assert find(EventKind.JOINT_LIMIT, 1, 2.9, 0.0, -0.0041) == pytest.approx(x, abs=1e-12)


def test_end_of_an_edge_is_located_where_the_fingertip_reaches_it() -> None:
    """The left tip at the upper end of the block's left side, the beginning of that edge."""
    x = HALF - BASE + math.sqrt(LEFT**2 - 0.035**2)
    found = find(EventKind.EDGE_END, pair(TIPS[0]), 0.0, -0.002, -0.0046)
    assert found == pytest.approx(x, abs=1e-12)


@pytest.mark.parametrize(('first', 'last'), [(0.0, -0.0025), (-0.0031, -0.004)])
def test_gap_that_closes_elsewhere_is_not_located(first: float, last: float) -> None:
    assert find(EventKind.CONTACT, pair('object.e3|palm.1.v2'), 0.0, first, last) is None


def test_gap_that_closes_beyond_the_edge_is_not_located() -> None:
    """Of vertices that meet the line of an edge, but farther along than the edge reaches."""
    pairs = np.arange(SYSTEM.contact_count)
    ends = np.array([at(SYSTEM, x, pushed_angles(x)) for x in (0.0, -0.0041)])
    gap, offset = gaps(SYSTEM, SYSTEM.place(ends), pairs)
    closes = (gap[0] > 1e-6) & (gap[1] < -1e-6)
    apart = ((offset < -0.1) | (offset > SYSTEM.pair_length[pairs] + 0.1)).all(axis=0)
    beyond = np.flatnonzero(closes & apart)
    assert len(beyond) > 0
    for index in beyond:
        assert find(EventKind.CONTACT, int(index), 0.0, 0.0, -0.0041) is None
