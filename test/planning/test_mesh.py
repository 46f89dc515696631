"""Best ways through everything that can be reached, against other searches over the same graph."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from cfplan_core import load_problem
from cfplan_core.contact.detection import touching
from cfplan_core.contact.system import ContactSystem
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.options import Preference
from cfplan_core.planning.budget import BudgetExhaustedError
from cfplan_core.planning.constraints import UNCONSTRAINED
from cfplan_core.planning.grasp_check import examine_problem
from cfplan_core.planning.mesh import Mesh, Motion, build_mesh, reachable
from cfplan_core.planning.mesh_margins import Marks, MeshMargins
from cfplan_core.planning.mesh_search import MeshSearch
from cfplan_core.planning.near_misses import near_misses
from cfplan_core.planning.roadmap import Roadmap
from cfplan_core.planning.robustness import COMFORTABLE_CLEARANCE, Robustness
from cfplan_core.planning.straightening import legs_of, straightened
from cfplan_core.planning.ways import joint_length

PROBLEM = load_problem(Path(__file__).parents[2] / 'config' / 'problems' / 'h1181.yaml')
SYSTEM = ContactSystem(PROBLEM)
MODEL = FrictionlessModel(SYSTEM.load, False)
ROBUSTNESS = Robustness(SYSTEM, MODEL)


@cache
def meshed() -> tuple[Roadmap, Mesh, int, int]:
    """Everything that can be reached, and the nodes of start and goal."""
    examined = examine_problem(SYSTEM, MODEL)
    assert examined.goal is not None
    roadmap = Roadmap(SYSTEM, MODEL)
    root = roadmap.root(examined.start.z)
    pieces, crossings = reachable(roadmap, root)
    ends = [(root, examined.start.z), (roadmap.root(examined.goal.z), examined.goal.z)]
    mesh, (start, goal) = build_mesh(pieces, crossings, ends)
    return roadmap, mesh, start, goal


@cache
def margins() -> MeshMargins:
    return MeshMargins(meshed()[1], ROBUSTNESS, lambda z: z)


def search() -> MeshSearch:
    _, mesh, start, goal = meshed()
    return MeshSearch(mesh, start, [goal], UNCONSTRAINED)


def graph(motions: list[Motion], floor: float = -np.inf) -> csr_array:
    """Lengths of the motions that are at least as wide, each way."""
    best: dict[tuple[int, int], float] = {}
    widths = margins().widths.T if floor > -np.inf else np.zeros((len(motions), 2))
    for motion, (back, ahead) in zip(motions, widths, strict=True):
        first, second = motion.first, motion.second
        for edge, width in (((first, second), ahead), ((second, first), back)):
            if width >= floor:
                best[edge] = min(best.get(edge, np.inf), max(motion.length, 1e-12))
    rows, columns = np.array(list(best)).T
    count = len(meshed()[1].z)
    return csr_array((list(best.values()), (rows, columns)), shape=(count, count))


def test_motions_lead_from_node_to_node_and_keep_their_contacts() -> None:
    _, mesh, _, _ = meshed()
    for motion in mesh.motions[::97]:
        ends = np.array([mesh.z[motion.first], mesh.z[motion.second]])
        np.testing.assert_allclose(motion.points[[0, -1]], ends, atol=2e-6)
        if motion.piece is not None and motion.piece.dimension == 2:
            for z in motion.points:
                kept = set(motion.piece.formation.pairs)
                assert kept <= set(touching(SYSTEM, z, 1e-7).tolist())


def test_the_shortest_way_is_that_of_another_search() -> None:
    _, mesh, start, goal = meshed()
    way = search().shortest()
    assert way is not None
    assert (way.nodes[0], way.nodes[-1]) == (start, goal)
    length = sum(motion.length for motion in way.motions)
    other = dijkstra(graph(mesh.motions), indices=start)[goal]
    assert length == pytest.approx(other, abs=1e-6)


def test_search_and_meshing_end_when_they_have_to() -> None:
    def stop() -> None:
        raise BudgetExhaustedError('enough')

    roadmap, mesh, start, goal = meshed()
    with pytest.raises(BudgetExhaustedError):
        MeshSearch(mesh, start, [goal], UNCONSTRAINED, stop).shortest()
    pieces, crossings = reachable(roadmap, mesh.pieces[start])
    with pytest.raises(BudgetExhaustedError):
        build_mesh(pieces, crossings, [], stop)


def test_fewest_segments_are_no_more_than_those_of_the_shortest_way() -> None:
    _, mesh, _, _ = meshed()
    shortest, fewest = search().shortest(), search().shortest(Preference.FEWEST_SEGMENTS)
    assert shortest is not None
    assert fewest is not None
    assert len(legs_of(mesh, fewest)) <= len(legs_of(mesh, shortest))


def test_without_the_clearance_the_widest_margin_is_where_start_and_goal_are_just_connected() -> (
    None
):
    _, mesh, start, goal = meshed()
    widest = search()._widest_steady(margins())

    def connected(floor: float) -> bool:
        lengths = dijkstra(graph(mesh.motions, floor), indices=start)
        return bool(np.isfinite(lengths[goal]))

    assert connected(widest)
    assert not connected(widest * (1.0 + 1e-9))


def test_the_widest_way_keeps_its_margin_and_none_keeps_more() -> None:
    _, mesh, _, _ = meshed()
    floor, bound = search().widest(margins(), 0.0, 0.01)
    way = search().shortest(floor=floor, margins=margins())
    assert way is not None
    legs = legs_of(mesh, way)
    assert ROBUSTNESS.margin([(leg.formation, leg.points) for leg in legs]) >= 0.99 * floor
    assert bound <= 1.01 * floor
    assert search().shortest(floor=1.001 * bound, margins=margins()) is None


def test_straightened_ways_are_shorter_and_begin_and_end_as_before() -> None:
    roadmap, mesh, _, _ = meshed()
    way = search().shortest()
    assert way is not None
    legs = legs_of(mesh, way)
    straight = straightened(roadmap, legs)
    for before, after in zip(legs, straight, strict=True):
        np.testing.assert_array_equal(before.points[[0, -1]], after.points[[0, -1]])
        assert joint_length(after.points) <= joint_length(before.points) + 1e-9


def test_a_banned_motion_is_not_taken() -> None:
    first = search().shortest()
    assert first is not None
    other = search()
    other.banned.update(motion for motion in first.motions if motion.piece is not None)
    way = other.shortest()
    assert way is None or not other.banned.intersection(way.motions)


def motion_between(first: int, second: int) -> Motion:
    return Motion(first, second, None, np.zeros((1, 5)), 0.0)


def test_what_is_near_and_left_without_touching_bars_the_way() -> None:
    there = motion_between(0, 1)
    marks = Marks([0b1, 0b0], ({}, {there: (0b1, 0b0)}))
    assert marks.follow(0, 1, there, 0b0) is None
    assert marks.follow(0, 1, there, 0b1) == 0


def test_what_touches_on_the_way_may_be_left() -> None:
    there = motion_between(0, 1)
    assert Marks([0b0, 0b0], ({}, {there: (0b1, 0b1)})).follow(0, 1, there, 0b0) == 0
    assert Marks([0b0, 0b0], ({}, {there: (0b1, 0b0)})).follow(0, 1, there, 0b0) is None


def test_a_motion_that_is_wide_enough_one_way_is_not_followed_the_other_way() -> None:
    there = motion_between(0, 1)
    marks = Marks([0b0, 0b0], ({}, {there: (0b0, 0b0)}))
    assert marks.follow(0, 1, there, 0b0) == 0
    assert marks.follow(1, 0, there, 0b0) is None


def test_what_is_still_near_is_remembered() -> None:
    there = motion_between(0, 1)
    assert Marks([0b11, 0b11], ({}, {there: (0b11, 0b10)})).follow(0, 1, there, 0b0) == 0b10


def test_a_way_over_the_mesh_has_no_nearer_miss_than_its_margin_allows() -> None:
    _, mesh, _, _ = meshed()
    for floor in (0.1, 0.2):
        way = search().shortest(floor=floor, margins=margins())
        assert way is not None
        points = np.concatenate([leg.points for leg in legs_of(mesh, way)])
        nearest = near_misses(SYSTEM, points, COMFORTABLE_CLEARANCE).min()
        assert nearest >= 0.99 * floor * COMFORTABLE_CLEARANCE
