from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from planning.scenes import (
    BARRIER,
    FEET,
    TIPS,
    Polygon,
    at,
    masted_block,
    pushed_angles,
    pushed_block,
    squeezed_angles,
    squeezed_trapezoid,
    x_of,
)
from random_problems import distant_goal, explore, random_problem

from cfplan_core.contact.detection import touching
from cfplan_core.contact.gaps import gaps
from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import Stability
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.model import Goal, Problem
from cfplan_core.planning.goal_test import GoalTest
from cfplan_core.planning.roadmap import Roadmap
from cfplan_core.planning.search import Leg, Search

# Its corner, vertex 2, stops the block's left side at x = -0.003.
WALL = [(-0.03, 0.004), (-0.025, 0.004), (-0.023, 0.007), (-0.025, 0.01), (-0.03, 0.01)]
WALLED = pushed_block(palms=[WALL])
WALL_CONTACT = 'object.e3|palm.1.v2'
# Without the left fingertip, the block held against the wall; at the wall the tip is 0.738 rad up.
HELD_BY_THE_WALL = (1.2, pushed_angles(-0.003)[1])


def search(problem: Problem, start: FloatArray, goal: FloatArray | GoalTest) -> Search:
    system = ContactSystem(problem)
    return Search(Roadmap(system, FrictionlessModel(system.load)), start, goal)


def from_the_middle_to_the_wall() -> Search:
    """Slide to the wall with both tips, then take the left one away."""
    system = ContactSystem(WALLED)
    start = at(system, 0.0, pushed_angles(0.0))
    return search(WALLED, start, at(system, -0.003, HELD_BY_THE_WALL))


def distant(seed: int) -> tuple[Search, Problem]:
    problem = random_problem(seed)
    far = distant_goal(problem, explore(problem), seed)
    assert far is not None
    system = ContactSystem(far)
    grasp = far.goal.grasp(far.hand)
    assert grasp is not None
    start, goal = system.configuration(far.start), system.configuration(grasp)
    return search(far, start, goal), far


def contacts(problem: Problem, leg: Leg) -> tuple[str, ...]:
    return ContactSystem(problem).contact_names(leg.formation.pairs)


def test_block_is_slid_to_the_wall_and_let_go_on_the_left() -> None:
    found = from_the_middle_to_the_wall()
    assert found.run()
    assert [contacts(WALLED, leg) for leg in found.path()] == [
        (*FEET, *TIPS),
        (*FEET, WALL_CONTACT, TIPS[1]),
    ]


def test_path_begins_at_the_start_and_ends_at_the_goal() -> None:
    found = from_the_middle_to_the_wall()
    assert found.run()
    legs = found.path()
    np.testing.assert_array_equal(legs[0].points[0], found.trees[0].root)
    np.testing.assert_array_equal(legs[-1].points[-1], found.trees[1].root)


@pytest.mark.parametrize('seed', [6, 8, 13, 15, 22, 29, 31])
def test_legs_are_joined_and_keep_their_contacts(seed: int) -> None:
    found, problem = distant(seed)
    system = ContactSystem(problem)
    assert found.run()
    legs = found.path()
    assert len(legs) > 1
    for before, after in pairwise(legs):
        np.testing.assert_allclose(before.points[-1], after.points[0], atol=1e-9)
    for leg in legs:
        gap = gaps(system, system.place(leg.points[1:-1]), leg.formation.array).gap
        np.testing.assert_allclose(gap, 0.0, atol=1e-9)


@pytest.mark.parametrize('seed', [6, 8, 13, 15, 22, 29, 31])
def test_trees_are_joined_at_the_piece_that_both_hold(seed: int) -> None:
    found, _ = distant(seed)
    assert found.run()
    initial, goal = found.trees
    assert found.meeting in initial.index_of
    assert found.meeting in goal.index_of


@pytest.mark.parametrize('seed', [6, 8, 13, 15, 22, 29, 31])
def test_parents_come_before_children_and_hold_a_neighbour(seed: int) -> None:
    found, _ = distant(seed)
    assert found.run()
    for tree in found.trees:
        for index, node in enumerate(tree.nodes):
            assert tree.index_of[node.piece.index] == index
            if node.parent is None:
                assert (index, node.depth, node.entry) == (0, 0, None)
            else:
                assert node.parent < index
                parent = tree.nodes[node.parent]
                assert node.depth == parent.depth + 1
                neighbours = {p.index for _, p in found.roadmap.neighbours(parent.piece)}
                assert node.piece.index in neighbours


def test_start_and_goal_on_one_curve_are_joined_at_once() -> None:
    system = ContactSystem(WALLED)
    start, goal = (at(system, x, pushed_angles(x)) for x in (0.002, -0.002))
    found = search(WALLED, start, goal)
    assert found.run()
    (leg,) = found.path()
    places = [x_of(system, z) for z in leg.points]
    assert places == sorted(places, reverse=True)
    assert [len(tree.nodes) for tree in found.trees] == [1, 1]


def test_start_that_is_the_goal_gives_one_leg() -> None:
    system = ContactSystem(WALLED)
    start = at(system, 0.002, pushed_angles(0.002))
    found = search(WALLED, start, start.copy())
    assert found.run()
    (leg,) = found.path()
    np.testing.assert_array_equal(leg.points, np.tile(start, (len(leg.points), 1)))


def test_legs_are_split_where_the_class_changes() -> None:
    system = ContactSystem(squeezed_trapezoid())
    start, goal = (at(system, x, squeezed_angles(x)) for x in (-0.0045, 0.0095))
    found = search(squeezed_trapezoid(), start, goal)
    assert found.run()
    assert [leg.stability for leg in found.path()] == [
        Stability.FORCE_CLOSURE,
        Stability.FORM_CLOSURE,
        Stability.FORCE_CLOSURE,
    ]


@pytest.mark.parametrize(('palms', 'reached'), [((BARRIER,), False), ((), True)])
def test_goal_behind_a_barrier_is_not_reached(palms: tuple[Polygon, ...], reached: bool) -> None:
    problem = masted_block(palms)
    system = ContactSystem(problem)
    start, goal = (at(system, x, pushed_angles(x)) for x in (-0.003, 0.003))
    found = search(problem, start, goal)
    assert found.run() == reached
    assert (found.meeting is not None) == reached


def test_blocked_pieces_are_not_used() -> None:
    found = from_the_middle_to_the_wall()
    assert found.run()
    last = found.path()[-1].piece
    again = Search(
        found.roadmap, found.trees[0].root, found.trees[1].root, blocked=frozenset({last})
    )
    assert not again.run()


@pytest.mark.parametrize('seed', [15])
def test_way_around_a_blocked_piece_avoids_it(seed: int) -> None:
    found, _ = distant(seed)
    assert found.run()
    inner = [leg.piece for leg in found.path()[1:-1]]
    for piece in inner:
        start, goal = (tree.root for tree in found.trees)
        again = Search(found.roadmap, start, goal, blocked=frozenset({piece}))
        if again.run():
            assert piece not in {leg.piece for leg in again.path()}


def test_growth_is_told_node_by_node() -> None:
    told: list[tuple[int, int]] = []
    system = ContactSystem(WALLED)
    found = Search(
        Roadmap(system, FrictionlessModel(system.load)),
        at(system, 0.0, pushed_angles(0.0)),
        at(system, -0.003, HELD_BY_THE_WALL),
        grown=lambda initial, goal: told.append((initial, goal)),
    )
    assert found.run()
    assert told == sorted(told)
    assert told[-1] == (len(found.trees[0].nodes), len(found.trees[1].nodes))
    assert [sum(nodes) for nodes in told] == list(range(3, len(told) + 3))


def test_search_that_is_interrupted_passes_the_error_on() -> None:
    class StopError(Exception):
        pass

    def stop(initial: int, goal: int) -> None:
        raise StopError

    system = ContactSystem(WALLED)
    roadmap = Roadmap(system, FrictionlessModel(system.load))
    ends = at(system, 0.0, pushed_angles(0.0)), at(system, -0.003, HELD_BY_THE_WALL)
    with pytest.raises(StopError):
        Search(roadmap, *ends, grown=stop).run()


def test_goal_in_part_is_searched_from_the_start_alone() -> None:
    system = ContactSystem(WALLED)
    start = at(system, 0.0, pushed_angles(0.0))
    goal = GoalTest(system, Goal(contacts=(WALL_CONTACT, TIPS[1])))
    found = search(WALLED, start, goal)
    assert found.run()
    end = found.path()[-1].points[-1]
    np.testing.assert_array_equal(end, found.trees[1].root)
    names = system.contact_names(touching(system, end, 1e-7).tolist())
    assert {WALL_CONTACT, TIPS[1]} <= set(names)


def test_goal_in_part_that_the_start_fulfils_is_found_at_once() -> None:
    system = ContactSystem(WALLED)
    start = at(system, 0.0, pushed_angles(0.0))
    found = search(WALLED, start, GoalTest(system, Goal(contacts=TIPS)))
    assert found.run()
    assert len(found.trees[0].nodes) == 1
