"""Plans chosen among all: fewest segments, shortest, most robust, and alternatives."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from random_problems import distant_goal, explore, random_problem
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from cfplan_core import (
    CfplanError,
    PlanOptions,
    PlanResult,
    Preference,
    Problem,
    Status,
    load_problem,
    plan,
    plan_margin,
    verify_plan,
)
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.system import ContactSystem
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.model import Goal
from cfplan_core.planning.best_first import BestFirst
from cfplan_core.planning.best_on_mesh import Best
from cfplan_core.planning.grasp_check import examine_problem
from cfplan_core.planning.pieces import Piece, Region
from cfplan_core.planning.region_motion import straight_motion
from cfplan_core.planning.roadmap import Roadmap
from cfplan_core.planning.robustness import Robustness
from cfplan_core.planning.ways import joint_length
from cfplan_core.verdicts import best_of_all

PROBLEMS = Path(__file__).parents[1] / 'config' / 'problems'
CHOICES = ['fewest-segments', 'shortest', 'robust']


@cache
def planned(name: str, options: PlanOptions) -> tuple[Problem, PlanResult]:
    problem = load_problem(PROBLEMS / f'{name}.yaml')
    return problem, plan(problem, options)


def certified(name: str, **options: object) -> PlanResult:
    problem, result = planned(name, PlanOptions(**options))  # type: ignore[arg-type]
    assert result.status is Status.SOLVED, result.message
    for each in (result, *result.alternatives):
        assert verify_plan(problem, each).failures == ()
    return result


class Explored:
    """The motions of a roadmap between configurations, found breadth first."""

    def __init__(self, name: str) -> None:
        self.problem = load_problem(PROBLEMS / f'{name}.yaml')
        self.system = ContactSystem(self.problem)
        model = FrictionlessModel(self.system.load)
        self.robustness = Robustness(self.system, model)
        examined = examine_problem(self.system, model)
        assert examined.goal is not None
        self.start, self.goal = examined.start.z, examined.goal.z
        self.margins: dict[tuple[Formation, bytes], float] = {}
        self.roadmap = Roadmap(self.system, model)
        last = self.roadmap.root(self.goal)
        states: list[tuple[Piece, np.ndarray]] = [(self.roadmap.root(self.start), self.start)]
        self.motions: list[tuple[int, int, Formation, np.ndarray]] = []
        self.arrival = -1
        for number, (piece, entry) in enumerate(states):
            ways = [*self.roadmap.neighbours(piece), *self.roadmap.regions.beside(piece)]
            for z, after in ways:
                self._add(number, piece, entry, z, self._state(states, after, z))
            if piece is last:
                self._add(number, piece, entry, self.goal, self.arrival)
        self.count = len(states)

    def _add(self, number: int, piece: Piece, entry: np.ndarray, z: np.ndarray, to: int) -> None:
        found = [piece.path(entry, z)]
        if isinstance(piece, Region):
            straight = straight_motion(self.roadmap, piece, entry, z)
            found += [] if straight is None else [straight]
        self.motions += [(number, to, piece.formation, points) for points in found]

    @staticmethod
    def _state(states: list[tuple[Piece, np.ndarray]], piece: Piece, z: np.ndarray) -> int:
        for number, (other, entry) in enumerate(states):
            if other is piece and np.abs(entry - z).max() < 1e-5:
                return number
        states.append((piece, z))
        return len(states) - 1

    def margin(self, formation: Formation, z: np.ndarray) -> float:
        key = formation, z.tobytes()
        if key not in self.margins:
            self.margins[key] = self.robustness.ratios(formation, z).worst
        return self.margins[key]

    def shortest(self, floor: float = -np.inf) -> float:
        """Length of the shortest path without motions of a smaller margin; by SciPy."""
        best: dict[tuple[int, int], float] = {}
        for first, to, formation, points in self.motions:
            still = not np.abs(points - points[0]).max() > 0.0
            if still or floor == -np.inf or self.margin(formation, points) >= floor:
                edge = (first, self.count if to < 0 else to)
                length = max(joint_length(points), 1e-12)
                best[edge] = min(best.get(edge, np.inf), length)
        rows, columns = np.array(list(best)).T
        shape = (self.count + 1, self.count + 1)
        graph = csr_array((list(best.values()), (rows, columns)), shape=shape)
        return float(dijkstra(graph, indices=0)[self.count])

    def search(self, prefer: Preference) -> BestFirst:
        return BestFirst(self.roadmap, self.start, self.goal, prefer, self.margin)


@cache
def explored(name: str) -> Explored:
    return Explored(name)


@pytest.mark.parametrize('name', ['h1181'])
def test_the_shortest_path_is_that_of_another_search_over_the_same_motions(name: str) -> None:
    graph = explored(name)
    search = graph.search(Preference.SHORTEST)
    legs, _ = next(search.ways(1)).path()
    length = sum(joint_length(leg.points) for leg in legs)
    assert length == pytest.approx(graph.shortest(), abs=1e-9)


@pytest.mark.parametrize('name', ['h1181'])
def test_no_path_is_wider_than_the_most_robust_and_none_as_wide_is_shorter(name: str) -> None:
    graph = explored(name)
    search = graph.search(Preference.ROBUST)
    legs, _ = next(search.ways(1)).path()
    margin = search.margin(legs)
    length = sum(joint_length(leg.points) for leg in legs)
    assert length == pytest.approx(graph.shortest(margin), abs=1e-9)
    assert graph.shortest(margin * (1.0 + 1e-9)) == np.inf


@pytest.mark.parametrize('name', ['h1181'])
def test_each_preference_is_at_least_as_good_as_the_first_plan(name: str) -> None:
    first = certified(name)
    shortest = certified(name, prefer='shortest')
    fewest = certified(name, prefer='fewest-segments')
    robust = certified(name, prefer='robust')
    assert shortest.length <= first.length + 1e-9
    assert len(fewest.segments) <= len(first.segments)
    assert robust.margin is not None
    for other in (shortest, fewest):
        assert other.margin is not None
        assert robust.margin >= other.margin - 1e-9


@pytest.mark.parametrize('name', ['h020'])
def test_robust_plans_at_least_double_the_margin_of_the_first(name: str) -> None:
    problem, first = planned(name, PlanOptions())
    robust = certified(name, prefer='robust')
    assert robust.margin is not None
    assert robust.margin >= 2.0 * plan_margin(problem, first)


@pytest.mark.parametrize('name', ['h1181', 'h122'])
def test_the_margin_of_a_plan_can_be_measured_on_its_frames(name: str) -> None:
    problem, result = planned(name, PlanOptions(prefer=Preference.ROBUST))
    assert plan_margin(problem, result) == pytest.approx(result.margin, abs=0.01)


def test_three_contacts_are_used_where_they_shorten_the_way() -> None:
    first, shortest = certified('h1181'), certified('h1181', prefer='shortest')
    assert {len(segment.contacts) for segment in first.segments} == {4}
    assert {len(segment.contacts) for segment in shortest.segments} == {3, 4}
    assert shortest.length < 0.6 * first.length


def test_alternatives_differ_in_their_contact_formations_and_come_best_first() -> None:
    best = certified('h1181', prefer='shortest', alternatives=3)
    plans = (best, *best.alternatives)
    assert len(plans) == 3
    sequences = {tuple(segment.contacts for segment in each.segments) for each in plans}
    assert len(sequences) == 3
    lengths = [each.length for each in plans]
    assert lengths == sorted(lengths)
    # Alternatives are looked for along rays, the shortest way alone everywhere.
    assert certified('h1181', prefer='shortest').length <= 1.01 * best.length


def test_the_answer_says_that_no_better_plan_exists() -> None:
    result = certified('h1181', prefer='shortest')
    assert result.message.startswith(
        'shortest: none exists that is shorter by more than 8 %; everything that can be'
    )
    assert 'grid of joint angles of 0.05 rad' in result.message


def test_the_answer_says_which_budget_ended_the_search_for_better_plans() -> None:
    first = certified('h1181')
    stopped = certified('h1181', prefer='shortest', max_nodes=8)
    assert stopped.message == 'shortest: the best found so far; budget of 8 nodes exhausted'
    assert stopped.length <= first.length + 1e-9


@pytest.mark.parametrize('prefer', CHOICES)
def test_the_same_input_gives_the_same_plan(prefer: str) -> None:
    problem, result = planned('h122', PlanOptions(prefer=prefer))  # type: ignore[arg-type]
    again = plan(problem, PlanOptions(prefer=prefer))  # type: ignore[arg-type]
    np.testing.assert_array_equal(result.joints, again.joints)


@pytest.mark.parametrize('prefer', CHOICES)
def test_a_goal_of_a_pose_alone_is_reached_in_the_best_way(prefer: str) -> None:
    problem, first = planned('h1181', PlanOptions())
    pose = type(problem.goal)(problem.goal.object_pose)
    partial = type(problem)(
        problem.name, problem.gravity, problem.hand, problem.object, 0.0, problem.start, pose
    )
    result = plan(partial, PlanOptions(prefer=prefer))  # type: ignore[arg-type]
    assert verify_plan(partial, result).failures == ()
    if prefer == 'shortest':
        assert result.length <= first.length


def test_the_chosen_path_is_marked_in_the_trees() -> None:
    result = certified('h1181', prefer='shortest')
    initial, _ = result.trees
    chosen = [node.contacts for node in initial if node.on_path]
    for segment in result.segments:
        assert segment.contacts in chosen


def test_an_unknown_preference_is_refused() -> None:
    with pytest.raises(CfplanError, match="prefer: got 'fastest', expected one of first, fewest"):
        PlanOptions(prefer='fastest')  # type: ignore[arg-type]


def test_no_alternatives_at_all_are_refused() -> None:
    with pytest.raises(CfplanError, match='alternatives: got 0'):
        PlanOptions(alternatives=0)


@pytest.mark.parametrize('seed', [1, 8])
def test_the_shortest_plan_of_a_random_problem_is_no_longer_than_the_first(seed: int) -> None:
    start = random_problem(seed)
    problem = distant_goal(start, explore(start, 60), seed)
    assert problem is not None
    first = plan(problem)
    shortest = plan(problem, PlanOptions(prefer=Preference.SHORTEST, second_order=False))
    assert verify_plan(problem, shortest).failures == ()
    assert shortest.length <= first.length + 1e-9


def test_no_alternatives_are_a_proof_only_where_regions_were_filled() -> None:
    problem = load_problem(PROBLEMS / 'existence' / 'barrier_too_low.yaml')
    result = plan(problem, PlanOptions(alternatives=2))
    assert result.status is Status.INFEASIBLE
    assert 'over a grid of joint angles' in result.message


def test_a_plan_without_motion_has_no_larger_bound_than_its_margin() -> None:
    problem = load_problem(PROBLEMS / 'h045.yaml')
    touching = replace(problem, goal=Goal(contacts=('object.v0|palm.0.e2',)))
    result = plan(touching, PlanOptions(prefer=Preference.ROBUST, held_joints=('left_joint',)))
    assert result.solved
    assert len(result.joints) == 1
    assert result.margin_bound == result.margin


def test_none_better_is_said_only_where_the_bound_is_the_margin() -> None:
    options, roadmap = PlanOptions(prefer=Preference.ROBUST), explored('h1181').roadmap
    said = best_of_all(options, roadmap, '', 0.2, Best([], None, 0.3))
    assert said.startswith('robust: the best found; its margin is 0.200')
    exact = certified('existence/one_joint_goes_on', prefer='robust')
    assert exact.margin_bound == exact.margin
    assert exact.message.startswith('robust: none better exists')


def test_a_way_whose_margin_is_less_than_its_floor_is_not_the_end() -> None:
    """Something is near at the start and comes nearer: the mesh takes that for the start's."""
    result = certified('existence/limit_out_of_the_way', prefer='robust')
    assert result.margin is not None
    assert result.margin_bound is not None
    assert result.margin >= 0.98 * result.margin_bound


def test_the_shortest_way_over_a_coarse_grid_is_certified() -> None:
    result = certified('h1181', prefer='shortest', resolution=0.2)
    assert result.message.startswith('shortest: none exists that is shorter by more than 8 %')
