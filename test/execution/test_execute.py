"""Plans run in MuJoCo: what was planned comes about, and what did not is named."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from cfplan_core import CfplanError, Grasp, PlanResult, Problem, Status
from cfplan_core.contact.elements import parse_contact
from cfplan_core.contact.system import ContactSystem
from cfplan_core.execution.execute import Execution, ExecutionOptions, execute_plan
from cfplan_core.execution.executed import executed_motion
from cfplan_core.execution.perturbation import Uncertainty
from cfplan_core.report.scene import contact_marks

Run = Callable[..., Execution]


def test_object_ends_in_the_goal_grasp(execution: Execution) -> None:
    assert execution.outcome.in_goal
    assert execution.outcome.final_position_error < 1e-4
    assert execution.outcome.final_angle_error < 1e-3


def test_contacts_are_those_of_the_plan(execution: Execution) -> None:
    assert execution.outcome.lost == ()
    assert execution.outcome.made == ()
    assert execution.outcome.kept == (1.0,) * len(execution.outcome.kept)


def test_contact_forces_balance_the_weight_at_rest(
    problem: Problem, planned: PlanResult, execution: Execution
) -> None:
    system, run = ContactSystem(problem), execution.run
    names = planned.segments[-1].contacts
    pairs = [system.pair(parse_contact(name)) for name in names]
    vertices, bodies = system.pair_vertex[pairs], system.body_of[system.pair_edge[pairs]]
    marks = contact_marks(problem, Grasp(run.object_poses[-1], run.joints[-1]), names)
    pushed = sum(
        force * mark.normal
        for force, mark in zip(run.forces[-1][vertices, bodies], marks, strict=True)
    )
    assert pushed == pytest.approx([0.0, 0.1 * 9.81], abs=0.01)


def test_slow_torques_stay_within_the_planned_limits(
    problem: Problem, planned: PlanResult
) -> None:
    slow = replace(planned, times=3.0 * planned.times)
    assert (execute_plan(problem, slow).outcome.torque_excess <= 0.05).all()


def test_same_input_gives_the_same_run(execution: Execution, execute: Run) -> None:
    again = execute()
    assert np.array_equal(again.run.object_poses, execution.run.object_poses)
    assert np.array_equal(again.run.torques, execution.run.torques)


def test_seed_decides_the_errors(execute: Run) -> None:
    uncertainty = Uncertainty(mass_error=0.2, joint_noise=0.01)
    one, same, other = (execute(uncertainty=uncertainty, seed=seed) for seed in (1, 1, 2))
    assert np.array_equal(one.run.joints, same.run.joints)
    assert not np.array_equal(one.run.joints, other.run.joints)


def test_finger_that_was_moved_away_loses_the_contacts_that_it_had(
    problem: Problem, planned: PlanResult
) -> None:
    joints = planned.joints.copy()
    joints[:, 0] += np.linspace(0.0, 0.5, len(joints))
    outcome = execute_plan(problem, replace(planned, joints=joints)).outcome
    assert not outcome.in_goal
    assert 'left' in outcome.lost[0].contact or 'palm' in outcome.lost[0].contact
    times = [event.time for event in outcome.lost]
    assert times == sorted(times)
    ends = planned.times[[s.last_frame for s in planned.segments]]
    first = outcome.lost[0]
    assert planned.times[planned.segments[first.segment].first_frame] <= first.time
    assert first.time <= ends[first.segment] + 0.01


def test_stiffer_joints_follow_more_closely(execute: Run) -> None:
    friction = Uncertainty(friction=0.1)
    soft, stiff = (execute(uncertainty=friction, gain=gain) for gain in (5.0, 80.0))

    def error(run: Execution) -> float:
        return float(np.abs(run.run.joints - run.reference.joints[run.run.rows]).mean())

    assert error(stiff) < 0.5 * error(soft)


def test_joint_in_torque_is_given_its_torque_and_little_more(
    planned: PlanResult, execution: Execution
) -> None:
    """By its compliance, less than a thirtieth of 20 N·m/rad, whatever its error."""
    run, reference = execution.run, execution.reference
    stiff = reference.stiff[run.rows]
    assert stiff.any()
    assert not stiff.all()
    for joint in range(2):
        moves = np.abs(run.joint_velocities - reference.velocities[run.rows])[:, joint] > 1e-4
        still = ~stiff[:, joint] & ~moves
        assert still.sum() > 20
        supplied = run.torques[still, joint] - reference.torques[run.rows][still, joint]
        error = reference.joints[run.rows][still, joint] - run.joints[still, joint]
        assert (np.abs(supplied) <= 0.7 * np.abs(error) + 1e-4).all()


def test_without_roles_all_joints_are_held_in_position(execute: Run) -> None:
    assert execute(roles=False).reference.stiff.all()


def test_torque_fed_forward_makes_up_for_softness(problem: Problem, planned: PlanResult) -> None:
    without = replace(planned, torque_nominal=np.zeros_like(planned.torque_nominal))
    options = ExecutionOptions(gain=5.0)
    fed, unfed = (execute_plan(problem, plan, options).outcome for plan in (planned, without))
    assert fed.largest_position_deviation < 0.5 * unfed.largest_position_deviation


def test_execution_as_a_plan_has_its_measurements(
    planned: PlanResult, execution: Execution
) -> None:
    motion = executed_motion(planned, execution)
    assert np.array_equal(motion.object_poses, execution.run.object_poses)
    assert motion.segments[0].first_frame == 0
    assert motion.segments[-1].last_frame == len(motion.times) - 1
    for segment, before in zip(motion.segments[1:], motion.segments, strict=False):
        assert segment.first_frame == before.last_frame
    starts = motion.times[[s.first_frame for s in motion.segments]]
    assert starts == pytest.approx(
        planned.times[[s.first_frame for s in planned.segments]], abs=0.006
    )


def test_only_a_plan_can_be_executed(problem: Problem) -> None:
    nothing = PlanResult(problem.name, Status.INFEASIBLE, problem.hand.joint_names)
    with pytest.raises(CfplanError, match='only a solved plan can be executed, status is infeas'):
        execute_plan(problem, nothing)


def test_plan_of_another_problem_is_refused(problem: Problem, planned: PlanResult) -> None:
    with pytest.raises(CfplanError, match=r'problem other with joints .* is of trinkle_hunter'):
        execute_plan(replace(problem, name='other'), planned)


def test_roles_of_a_plan_without_are_refused(problem: Problem, planned: PlanResult) -> None:
    segments = tuple(replace(segment, control=None) for segment in planned.segments)
    with pytest.raises(CfplanError, match=r'does not say which joints .*; --no-roles'):
        execute_plan(problem, replace(planned, segments=segments))


def test_missing_engine_is_named_with_what_to_do(
    problem: Problem, planned: PlanResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, 'mujoco', None)
    with pytest.raises(CfplanError, match=r'needs the physics engine MuJoCo.*pip install'):
        execute_plan(problem, planned)


@pytest.mark.parametrize(
    ('options', 'message'),
    [
        ({'gain': 0.0}, 'gain: got 0.0, expected N·m/rad above zero'),
        ({'gain': float('nan')}, 'gain: got nan'),
        ({'time_step': 0.1}, 'time_step: got 0.1, expected'),
        ({'sampling': 1e-6}, 'sampling: got 1e-06, expected'),
        ({'seed': -1}, 'seed: got -1'),
    ],
)
def test_impossible_option_is_refused(options: dict[str, float], message: str) -> None:
    with pytest.raises(CfplanError, match=message):
        ExecutionOptions(**options)
