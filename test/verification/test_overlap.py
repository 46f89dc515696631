from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cfplan_core.model import Finger, Goal, Grasp, Hand, Joint, Link, ManipulatedObject, Problem
from cfplan_core.verification.mechanism import mechanism_of
from cfplan_core.verification.overlap import link_pairs, overlap_depth

SQUARE = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
CUP = np.array(
    [
        (0.0, 0.0),
        (3.0, 0.0),
        (3.0, 2.0),
        (2.0, 2.0),
        (2.0, 1.0),
        (1.0, 1.0),
        (1.0, 2.0),
        (0.0, 2.0),
    ]
)


def turned(points: np.ndarray, angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    return points @ np.array([[c, s], [-s, c]])


def test_corner_is_as_deep_as_its_vertex() -> None:
    diamond = np.add(turned(SQUARE, math.pi / 4), (0.5, 0.99))
    assert overlap_depth(SQUARE, diamond) == pytest.approx(0.01)


@settings(max_examples=50)
@given(depth=st.floats(1e-9, 1e-2), angle=st.floats(0.0, 2.0 * math.pi))
def test_depth_does_not_depend_on_the_direction(depth: float, angle: float) -> None:
    diamond = np.add(turned(SQUARE, math.pi / 4), (0.5, 1.0 - depth))
    found = overlap_depth(turned(SQUARE, angle), turned(diamond, angle))
    assert found == pytest.approx(depth, abs=1e-12)


def test_order_does_not_matter() -> None:
    diamond = np.add(turned(SQUARE, math.pi / 4), (0.5, 0.99))
    assert overlap_depth(SQUARE, diamond) == overlap_depth(diamond, SQUARE)


def test_flush_edges_do_not_overlap() -> None:
    assert overlap_depth(SQUARE, np.add(SQUARE, (0.3, 1.0))) == 0.0


def test_distant_bodies_do_not_overlap() -> None:
    assert overlap_depth(SQUARE, np.add(SQUARE, (3.0, 0.0))) == 0.0


def test_sliver_between_flush_edges_is_as_deep_as_thick() -> None:
    assert overlap_depth(SQUARE, np.add(SQUARE, (0.0, 1.0 - 1e-7))) == pytest.approx(
        1e-7, rel=1e-3
    )


def test_crossing_bars_overlap_though_no_vertex_is_inside() -> None:
    bar = np.array([(-1.0, 0.4), (2.0, 0.4), (2.0, 0.6), (-1.0, 0.6)])
    upright = np.array([(0.4, -1.0), (0.6, -1.0), (0.6, 2.0), (0.4, 2.0)])
    assert overlap_depth(bar, upright) == pytest.approx(0.1)


def test_plug_in_a_cup_of_its_width_does_not_overlap() -> None:
    assert overlap_depth(CUP, np.add(SQUARE, (1.0, 1.0))) == 0.0


def test_sliver_along_three_sides_of_a_cup_stays_thin() -> None:
    plug = SQUARE * (1.0 + 2e-7, 1.0) + (1.0 - 1e-7, 1.0 - 1e-7)
    assert overlap_depth(CUP, plug) == pytest.approx(1e-7, rel=0.5)


def test_body_deep_inside_a_wall_of_a_cup_is_found() -> None:
    assert overlap_depth(CUP, 0.1 * SQUARE + (2.45, 1.45)) == pytest.approx(0.45)


def test_links_are_checked_against_those_that_are_not_their_neighbours() -> None:
    def finger(name: str, links: int) -> Finger:
        outline = [(0.0, 0.0), (0.1, 0.0), (0.0, 0.1)]
        return Finger(
            name,
            (0.0, 0.0),
            0.0,
            tuple(Joint(f'{name}{k}', -1.0, 1.0, 1.0, 1.0) for k in range(links)),
            tuple(Link(str(k), 0.1, outline) for k in range(links)),
        )

    hand = Hand((SQUARE, SQUARE), (finger('a', 3), finger('b', 1)))
    thing = ManipulatedObject(SQUARE, 1.0)
    grasp = Grasp((0.0, 0.0, 0.0), np.zeros(4))
    problem = Problem('pairs', (0.0, -9.81), hand, thing, 0.0, grasp, Goal())
    assert set(link_pairs(mechanism_of(problem))) == {
        ('palm.0', 'a.1'),
        ('palm.0', 'a.2'),
        ('palm.1', 'a.1'),
        ('palm.1', 'a.2'),
        ('a.0', 'a.2'),
        ('a.0', 'b.0'),
        ('a.1', 'b.0'),
        ('a.2', 'b.0'),
    }
