from __future__ import annotations

import math

import numpy as np
import pytest

from cfplan_core.model import Goal, Grasp, Hand, ManipulatedObject, Problem
from cfplan_core.verification.mechanism import Mechanism, Scene, mechanism_of
from cfplan_core.verification.touching import Pair, locate, parse_pair, touching_pairs

TABLE = [(-1.0, -0.5), (1.0, -0.5), (1.0, 0.0), (-1.0, 0.0)]
# A notch at vertex 2, a straight vertex at 4.
THING = [(0.0, 0.0), (0.4, 0.0), (0.2, 0.1), (0.4, 0.2), (0.2, 0.2), (0.0, 0.2)]


def placed(pose: tuple[float, float, float]) -> tuple[Mechanism, Scene]:
    thing = ManipulatedObject(THING, 0.1)
    grasp = Grasp(pose, np.zeros(0))
    problem = Problem('t', (0.0, -9.81), Hand((TABLE,), ()), thing, 0.0, grasp, Goal())
    mechanism = mechanism_of(problem)
    return mechanism, mechanism.scene(np.array(pose), np.zeros(0))


def test_flush_edge_touches_with_both_its_vertices() -> None:
    assert set(touching_pairs(*placed((0.0, 0.0, 0.0)))) == {
        'object.v0|palm.0.e2',
        'object.v1|palm.0.e2',
    }


def test_straight_vertex_is_part_of_its_edge() -> None:
    upside_down = (0.4, 0.2, math.pi)
    assert set(touching_pairs(*placed(upside_down))) == {
        'object.v3|palm.0.e2',
        'object.v5|palm.0.e2',
    }


def test_edge_touches_the_corner_of_the_other_body_where_that_ends() -> None:
    over_the_end = (0.8, 0.0, 0.0)
    assert set(touching_pairs(*placed(over_the_end))) == {
        'object.v0|palm.0.e2',
        'object.e0|palm.0.v2',
    }


def test_notch_does_not_touch() -> None:
    mechanism, scene = placed((0.0, -0.1, 0.0))
    touch = locate(Pair('', 'palm.0', True, 2, 2), scene)
    assert touch.distance == pytest.approx(0.0, abs=1e-12)
    assert not touch.salient
    assert 'object.v2|palm.0.e2' not in touching_pairs(mechanism, scene)


@pytest.mark.parametrize(('height', 'touches'), [(0.9e-6, True), (1.1e-6, False)])
def test_touch_ends_at_a_micrometre(height: float, touches: bool) -> None:
    assert bool(touching_pairs(*placed((0.0, height, 0.0)))) is touches


@pytest.mark.parametrize('height', [-1e-3, 0.0, 2e-3])
def test_gap_is_positive_above_the_table(height: float) -> None:
    _, scene = placed((0.0, height, 0.0))
    assert locate(Pair('', 'palm.0', True, 0, 2), scene).gap == pytest.approx(height)


def test_normals_point_from_hand_into_object() -> None:
    _, scene = placed((0.8, 0.0, 0.0))
    for pair in (Pair('', 'palm.0', True, 0, 2), Pair('', 'palm.0', False, 2, 0)):
        assert locate(pair, scene).normal == pytest.approx(1j)


def test_vertex_beside_the_edge_is_at_a_distance_though_on_its_line() -> None:
    _, scene = placed((1.3, 0.0, 0.0))
    touch = locate(Pair('', 'palm.0', True, 0, 2), scene)
    assert touch.gap == pytest.approx(0.0)
    assert touch.distance == pytest.approx(0.3)


def test_depth_is_that_of_the_edge_that_dives_in() -> None:
    _, scene = placed((0.0, 0.0, -0.1))
    touch = locate(Pair('', 'palm.0', True, 0, 2), scene)
    assert touch.depth == pytest.approx(0.4 * math.sin(0.1))


def test_name_is_read_as_it_is_written() -> None:
    mechanism, scene = placed((0.8, 0.0, 0.0))
    for name, (pair, _) in touching_pairs(mechanism, scene).items():
        assert parse_pair(name, mechanism) == pair


@pytest.mark.parametrize(
    'name', ['', 'object.v0', 'object.v0|palm.0', 'object.x0|palm.0.e0', 'object.v-1|palm.0.e0']
)
def test_name_of_another_form_is_refused(name: str) -> None:
    mechanism, _ = placed((0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match='expected object'):
        parse_pair(name, mechanism)
