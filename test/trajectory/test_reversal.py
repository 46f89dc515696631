from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from cfplan_core import (
    CfplanError,
    Goal,
    Grasp,
    PlanOptions,
    PlanResult,
    Problem,
    load_problem,
    plan,
    read_plan,
    verify_plan,
    write_plan,
)
from cfplan_core.contact.elements import parse_contact
from cfplan_core.contact.gaps import gap_gradients
from cfplan_core.contact.system import ContactSystem
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.trajectory.timing import fastest, joint_velocities, rest_frames

PROBLEMS = Path(__file__).parents[2] / 'config' / 'problems'
NAMES = sorted(path.stem for path in PROBLEMS.glob('h*.yaml') if len(path.stem) < 6)


@cache
def planned(name: str) -> tuple[Problem, PlanResult]:
    problem = load_problem(PROBLEMS / f'{name}.yaml')
    return problem, plan(problem)


def turned(problem: Problem, result: PlanResult) -> Problem:
    """The problem whose start is where the plan ends and whose goal is where it starts."""
    start = Grasp(result.object_poses[-1], result.joints[-1])
    joints = dict(zip(problem.hand.joint_names, problem.start.joints.tolist(), strict=True))
    return replace(problem, start=start, goal=Goal(problem.start.object_pose, joints))


@pytest.mark.parametrize('name', [*NAMES, 'trinkle_hunter_1991'])
def test_a_reversed_plan_solves_the_reversed_problem(name: str) -> None:
    problem, result = planned(name)
    assert verify_plan(turned(problem, result), result.reversed()).failures == ()


@pytest.mark.parametrize('name', ['h013', 'trinkle_hunter_1991'])
def test_a_shared_frame_carries_the_torque_limits_of_the_earlier_segment(name: str) -> None:
    problem, result = planned(name)
    system = ContactSystem(problem)
    model = FrictionlessModel(system.load)
    back = result.reversed()
    for segment in back.segments:
        first = segment.first_frame + (segment.first_frame > 0)
        rows = slice(first, segment.last_frame + 1)
        frames = zip(back.object_poses[rows], back.joints[rows], strict=True)
        z = np.array([system.configuration(Grasp(pose, joints)) for pose, joints in frames])
        pairs = np.array([system.pair(parse_contact(contact)) for contact in segment.contacts])
        limits = model.torque_limits(gap_gradients(system, system.place(z), pairs))
        unit = system.force_unit * system.size
        for claimed, limit in zip((back.torque_lower, back.torque_upper), limits, strict=True):
            np.testing.assert_allclose(claimed[rows], limit * unit, rtol=1e-6, atol=1e-9)
    there = np.nan_to_num(result.torque_upper[::-1], posinf=9.0)
    jumps = np.abs(np.nan_to_num(back.torque_upper, posinf=9.0) - there).max()
    assert jumps > 1e-3, 'no limit jumps at a shared frame: this shows nothing'


def test_reversing_twice_gives_the_plan_back() -> None:
    _, result = planned('trinkle_hunter_1991')
    again = result.reversed().reversed()
    for name in ('joints', 'object_poses', 'torque_lower', 'torque_upper', 'entry_lower', 'times'):
        np.testing.assert_array_equal(getattr(again, name), getattr(result, name))
    assert (again.segments, again.trees, again.problem) == (
        result.segments,
        result.trees,
        result.problem,
    )
    assert again.statistics == result.statistics


def test_a_reversed_plan_keeps_velocity_limits_and_whole_nanoseconds() -> None:
    problem, result = planned('trinkle_hunter_1991')
    back = result.reversed()
    rests = rest_frames(back.joints, back.segments)
    speeds = fastest(back.times, back.joints, joint_velocities(back.times, back.joints, rests))
    limits = [joint.velocity_limit for joint in problem.hand.joints]
    assert (speeds <= np.array(limits) * (1.0 + 1e-9)).all()
    assert back.times[0] == 0.0
    assert back.times[-1] == result.times[-1]
    assert back.times * 1e9 == pytest.approx(np.rint(back.times * 1e9), abs=1e-4)


def test_a_plan_without_an_answer_cannot_be_reversed() -> None:
    problem, _ = planned('h013')
    stopped = plan(problem, PlanOptions(max_nodes=2))
    with pytest.raises(CfplanError, match="'budget_exhausted', expected a plan that is solved"):
        stopped.reversed()


def test_a_plan_of_an_irreversible_model_is_refused() -> None:
    _, result = planned('h013')
    with pytest.raises(CfplanError, match='reversible contact model'):
        replace(result, reversible=False).reversed()


def test_a_plan_from_a_file_is_not_known_to_be_reversible(tmp_path: Path) -> None:
    _, result = planned('h013')
    write_plan(result, tmp_path / 'plan.json')
    with pytest.raises(CfplanError, match='read from a file'):
        read_plan(tmp_path / 'plan.json').reversed()
