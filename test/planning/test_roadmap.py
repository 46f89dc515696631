from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np
import pytest
from planning.scenes import (
    FEET,
    TIPS,
    at,
    pushed_angles,
    pushed_block,
    squeezed_angles,
    squeezed_trapezoid,
    x_of,
)
from random_problems import Exploration, explore, goal_at, random_problem

from cfplan_core.contact.detection import touching
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.separation import penetration_depth
from cfplan_core.mechanics.contact_model import Stability
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.model import Goal, Grasp, Problem
from cfplan_core.planning import roadmap as roadmap_module
from cfplan_core.planning import tracing
from cfplan_core.planning.pieces import Piece
from cfplan_core.planning.roadmap import Roadmap
from cfplan_core.planning.tracing import STEP

SEEDS = range(40)
# Its corner, vertex 2, stops the block's left side at x = -0.003.
WALL = [(-0.03, 0.004), (-0.025, 0.004), (-0.023, 0.007), (-0.025, 0.01), (-0.03, 0.01)]


def roadmap_of(problem: Problem) -> tuple[ContactSystem, Roadmap]:
    system = ContactSystem(problem)
    return system, Roadmap(system, FrictionlessModel(system.load))


@pytest.fixture(scope='module')
def explorations() -> dict[int, Exploration]:
    return {seed: explore(random_problem(seed)) for seed in SEEDS}


def kinds(explored: Exploration) -> Counter[tuple[Formation, Stability, int]]:
    return Counter((p.formation, p.stability, p.dimension) for p in explored.pieces)


def lengths(explored: Exploration) -> list[float]:
    """Largest extent of every piece, ascending."""
    return sorted(float(np.ptp(piece.points, axis=0).max()) for piece in explored.pieces)


@pytest.mark.parametrize('seed', SEEDS)
def test_same_pieces_are_found_with_a_quarter_of_the_step(
    seed: int, explorations: dict[int, Exploration], monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (tracing, roadmap_module):
        monkeypatch.setattr(module, 'STEP', STEP / 4.0)
    fine, coarse = explore(random_problem(seed)), explorations[seed]
    assert kinds(fine) == kinds(coarse)
    np.testing.assert_allclose(lengths(fine), lengths(coarse), atol=1e-4)


@pytest.mark.parametrize('seed', SEEDS)
def test_inside_of_every_curve_touches_its_contacts_and_no_others(
    seed: int, explorations: dict[int, Exploration]
) -> None:
    explored = explorations[seed]
    for piece in explored.pieces:
        inside = piece.points if piece.dimension == 0 else piece.points[1:-1]
        for z in inside:
            assert tuple(touching(explored.system, z, 1e-7).tolist()) == piece.formation.pairs


@pytest.mark.parametrize('seed', SEEDS)
def test_ends_of_every_curve_touch_at_least_its_contacts(
    seed: int, explorations: dict[int, Exploration]
) -> None:
    explored = explorations[seed]
    for piece in explored.pieces:
        for z in (piece.points[0], piece.points[-1]):
            assert set(piece.formation.pairs) <= set(touching(explored.system, z, 1e-4).tolist())


@pytest.mark.parametrize('seed', SEEDS)
def test_nothing_overlaps_anywhere(seed: int, explorations: dict[int, Exploration]) -> None:
    explored = explorations[seed]
    problem = explored.system.problem
    for piece in explored.pieces:
        poses = explored.system.object_poses(piece.points)
        for z, pose in zip(piece.points, poses, strict=True):
            bodies = problem.hand.world_vertices(z[3:])
            thing = problem.object.world_vertices(pose)
            assert max(penetration_depth(thing, body) for body in bodies.values()) < 1e-9
            assert penetration_depth(bodies['left.link'], bodies['right.link']) < 1e-9


@pytest.mark.parametrize('seed', SEEDS)
def test_joints_stay_within_their_limits(seed: int, explorations: dict[int, Exploration]) -> None:
    system = explorations[seed].system
    for piece in explorations[seed].pieces:
        assert (piece.points[:, 3:] >= system.lower - 1e-9).all()
        assert (piece.points[:, 3:] <= system.upper + 1e-9).all()


@pytest.mark.parametrize('seed', SEEDS)
def test_every_piece_is_stable_and_of_its_class_inside(
    seed: int, explorations: dict[int, Exploration]
) -> None:
    explored = explorations[seed]
    for piece in explored.pieces:
        margins = explored.roadmap.tracer.margins(piece.formation, piece.points)
        inside = slice(None) if piece.dimension == 0 else slice(1, -1)
        assert (margins.stable > 0.0).all()
        closed = margins.form_closure[inside] > 0.0
        assert (closed == (piece.stability is Stability.FORM_CLOSURE)).all()


def pairs_of_neighbours(explored: Exploration) -> Iterator[tuple[Piece, Piece]]:
    for piece in explored.pieces:
        for _, neighbour in explored.roadmap.neighbours(piece):
            yield piece, neighbour


@pytest.mark.parametrize('seed', SEEDS)
def test_neighbours_are_neighbours_of_their_neighbours(
    seed: int, explorations: dict[int, Exploration]
) -> None:
    pairs = {(a.index, b.index) for a, b in pairs_of_neighbours(explorations[seed])}
    assert pairs == {(b, a) for a, b in pairs}


@pytest.mark.parametrize('seed', SEEDS)
def test_neighbours_meet_at_an_end_of_both(
    seed: int, explorations: dict[int, Exploration]
) -> None:
    explored = explorations[seed]
    for piece in explored.pieces:
        for z, neighbour in explored.roadmap.neighbours(piece):
            for one in (piece, neighbour):
                ends = one.points[[0, -1]]
                assert np.abs(ends - z).max(axis=1).min() < 1e-6


@pytest.mark.parametrize('seed', SEEDS[::4])
def test_exploration_from_any_piece_finds_the_same_pieces(
    seed: int, explorations: dict[int, Exploration]
) -> None:
    explored = explorations[seed]
    curves = [p for p in explored.pieces if p.dimension == 1 and len(p.points) > 4]
    points = curves[-1].points
    problem = goal_at(explored.system.problem, points[len(points) // 2])
    start = problem.goal.grasp(problem.hand)
    assert start is not None
    other = explore(
        Problem(
            problem.name, problem.gravity, problem.hand, problem.object, 0.0, start, problem.goal
        )
    )
    assert kinds(other) == kinds(explored)


@pytest.mark.parametrize('seed', SEEDS[::8])
def test_exploration_is_the_same_to_the_last_bit(
    seed: int, explorations: dict[int, Exploration]
) -> None:
    again, before = explore(random_problem(seed)), explorations[seed]
    assert [p.formation for p in again.roadmap.pieces] == [
        p.formation for p in before.roadmap.pieces
    ]
    for one, other in zip(again.roadmap.pieces, before.roadmap.pieces, strict=True):
        np.testing.assert_array_equal(one.points, other.points)


def test_all_points_of_a_curve_have_the_same_root() -> None:
    system, roadmap = roadmap_of(pushed_block(palms=[WALL]))
    curve = roadmap.root(at(system, 0.0, pushed_angles(0.0)))
    for x in (-0.0029, -0.002, 0.0013, 0.004):
        assert roadmap.root(at(system, x, pushed_angles(x))) is curve


def test_root_on_a_curve_with_several_classes_is_the_part_of_its_class() -> None:
    system, roadmap = roadmap_of(squeezed_trapezoid())
    for x, stability in ((0.009, Stability.FORCE_CLOSURE), (0.0, Stability.FORM_CLOSURE)):
        piece = roadmap.root(at(system, x, squeezed_angles(x)))
        assert piece.stability is stability
        assert min(x_of(system, z) for z in piece.points) <= x
        assert max(x_of(system, z) for z in piece.points) >= x


def test_classes_of_one_curve_are_neighbours() -> None:
    system, roadmap = roadmap_of(squeezed_trapezoid())
    held = roadmap.root(at(system, 0.0, squeezed_angles(0.0)))
    found = [piece.stability for _, piece in roadmap.neighbours(held)]
    assert found.count(Stability.FORCE_CLOSURE) == 2


def test_root_at_a_wall_is_a_point() -> None:
    """Five contacts leave five coordinates nothing."""
    system, roadmap = roadmap_of(pushed_block(palms=[WALL]))
    z = at(system, -0.003, pushed_angles(-0.003))
    point = roadmap.root(z)
    assert point.dimension == 0
    assert roadmap.root(z) is point
    assert system.contact_names(point.formation.pairs) == (*FEET, 'object.e3|palm.1.v2', *TIPS)


def test_curve_to_a_wall_leads_to_the_point_at_the_wall_and_through_it() -> None:
    system, roadmap = roadmap_of(pushed_block(palms=[WALL]))
    curve = roadmap.root(at(system, 0.0, pushed_angles(0.0)))
    walls = [p for _, p in roadmap.neighbours(curve) if p.dimension == 0]
    (point,) = walls
    assert x_of(system, point.points[0]) == pytest.approx(-0.003, abs=1e-12)
    # The left tip opens; the block stays or tips over one of its feet, and the way back.
    assert len([p for _, p in roadmap.neighbours(point) if p.dimension == 1]) == 4


def test_root_of_three_contacts_is_a_region() -> None:
    """The right finger is away from a block on the palm that leans on the left one."""
    problem = pushed_block()
    system, roadmap = roadmap_of(
        Problem(
            'leaning',
            (-3.0, -9.0),
            problem.hand,
            problem.object,
            0.0,
            Grasp((0.0, 0.0, 0.0), (pushed_angles(0.0)[0], 2.0)),
            Goal((0.0, 0.0, 0.0)),
        )
    )
    region = roadmap.root(at(system, 0.0, (pushed_angles(0.0)[0], 2.0)))
    assert region.dimension == 2
    assert system.contact_names(region.formation.pairs) == (*FEET, TIPS[0])


def test_attempts_and_failures_are_counted() -> None:
    system, roadmap = roadmap_of(pushed_block(limits=(0.01, 2.9)))
    roadmap.root(at(system, 0.0, pushed_angles(0.0)))
    assert roadmap.failures['a joint reaches its limit'] == 2
    assert roadmap.formations() == 1


def test_search_can_be_stopped_while_it_traces() -> None:
    class StopError(Exception):
        pass

    def checkpoint() -> None:
        raise StopError

    system = ContactSystem(pushed_block())
    roadmap = Roadmap(system, FrictionlessModel(system.load), checkpoint)
    with pytest.raises(StopError):
        roadmap.root(at(system, 0.0, pushed_angles(0.0)))
