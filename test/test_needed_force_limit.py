"""Plans whose contacts may not need more than a given force."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from cfplan_core import (
    CfplanError,
    PlanOptions,
    PlanResult,
    Problem,
    Status,
    load_problem,
    plan,
    read_plan,
    verify_plan,
    write_plan,
)
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.system import ContactSystem
from cfplan_core.mechanics.contact_forces import Stretch, contact_forces
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.planning.bounds import NEEDED_FORCE, NeededForceBound
from cfplan_core.planning.constraints import Constraints
from cfplan_core.planning.roadmap import Roadmap

PROBLEMS = Path(__file__).parents[1] / 'config' / 'problems'
STORY = load_problem(PROBLEMS / 'trinkle_hunter_1991.yaml')


@cache
def planned(name: str, largest: float | None = None) -> tuple[Problem, PlanResult]:
    problem = load_problem(PROBLEMS / f'{name}.yaml')
    return problem, plan(problem, PlanOptions(max_needed_force=largest))


def forces(problem: Problem, result: PlanResult) -> list[np.ndarray]:
    """Largest contact force of each frame of each segment, in weights, by `contact_forces`."""
    system = ContactSystem(problem)
    stretches = [
        Stretch(s.contacts, result.object_poses[s.first_frame : s.last_frame + 1],
                result.joints[s.first_frame : s.last_frame + 1])
        for s in result.segments
    ]  # fmt: skip
    return [
        stretch.forces.max(axis=1) / system.force_unit
        for stretch in contact_forces(system, stretches)
    ]


@pytest.mark.parametrize('name', ['h013', 'h205', 'trinkle_hunter_1991'])
def test_a_segment_tells_the_largest_needed_force_of_its_frames(name: str) -> None:
    problem, result = planned(name)
    wanted = [frames.max() for frames in forces(problem, result)]
    assert [s.needed_force for s in result.segments] == pytest.approx(wanted, rel=1e-5)
    assert result.needed_force == pytest.approx(max(wanted), rel=1e-5)


def test_a_plan_file_keeps_needed_forces(tmp_path: Path) -> None:
    _, result = planned('h013')
    write_plan(result, tmp_path / 'plan.json')
    again = read_plan(tmp_path / 'plan.json')
    assert again.segments == result.segments
    assert again.needed_force == result.needed_force


@pytest.mark.parametrize(
    ('name', 'largest'),
    [('h013', 1.5), ('trinkle_hunter_1991', 2.0), ('trinkle_hunter_1991', 1.5)],
)
def test_a_bounded_plan_needs_no_more_force_than_allowed(name: str, largest: float) -> None:
    _, free = planned(name)
    problem, bounded = planned(name, largest)
    assert free.needed_force is not None
    assert free.needed_force > largest
    assert bounded.status is Status.SOLVED, bounded.message
    assert verify_plan(problem, bounded).failures == ()
    assert max(frames.max() for frames in forces(problem, bounded)) <= largest


def test_a_bound_that_the_plan_keeps_anyway_changes_nothing() -> None:
    _, free = planned('h045')
    _, bounded = planned('h045', 0.7)
    np.testing.assert_array_equal(free.joints, bounded.joints)


def test_an_impossible_bound_is_told_with_how_often_it_was_the_reason() -> None:
    _, result = planned('h1181', 1.35)
    assert result.status is Status.INFEASIBLE
    counted = sum(n for why, n in result.statistics.failures.items() if why.endswith(NEEDED_FORCE))
    assert counted > 0
    assert f'as {NEEDED_FORCE}: {counted} ways' in result.message


def test_a_start_that_needs_more_is_refused_with_both_numbers() -> None:
    result = plan(STORY, PlanOptions(max_needed_force=0.5))
    assert result.status is Status.INVALID
    assert 'needed force of 0.5' in result.message
    assert 'less than 0.5' in result.message


@pytest.mark.parametrize('force', [0.0, -1.0, math.inf, math.nan])
def test_a_limit_that_is_no_force_is_refused(force: float) -> None:
    with pytest.raises(CfplanError, match='max_needed_force'):
        PlanOptions(max_needed_force=force)


@pytest.mark.parametrize(('name', 'largest'), [('h020', 1.2), ('h013', 1.5), ('h1181', 1.35)])
def test_a_curve_ends_exactly_where_the_largest_force_is_reached(
    name: str, largest: float
) -> None:
    problem = load_problem(PROBLEMS / f'{name}.yaml')
    system = ContactSystem(problem)
    model = FrictionlessModel(system.load)
    constraints = Constraints((NeededForceBound(model, largest),))
    roadmap = Roadmap(system, model, constraints=constraints)
    goal = problem.goal.grasp(problem.hand)
    assert goal is not None
    pieces = [roadmap.root(system.configuration(grasp)) for grasp in (problem.start, goal)]
    for piece in pieces:
        pieces += [after for _, after in roadmap.neighbours(piece) if after not in pieces]
    curves = [piece for piece in pieces if piece.dimension == 1]
    for piece in curves:
        assert needed(roadmap, piece.formation, piece.points).max() <= largest
    ends = [
        needed(roadmap, piece.formation, piece.points[[0, -1]])[side]
        for piece in curves
        for side in (0, 1)
        if piece.ends[side] is None
    ]
    reached = [force for force in ends if abs(force - largest) < 1e-5 * largest]
    assert len(reached) == roadmap.failures[NEEDED_FORCE]
    assert reached


def needed(roadmap: Roadmap, formation: Formation, z: np.ndarray) -> np.ndarray:
    return roadmap.model.needed_forces(roadmap.tracer.gradients(z, formation.array))
