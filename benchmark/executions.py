"""Print the tables of docs/execution.md: the example problems' plans run in MuJoCo.

python benchmark/executions.py             how each plan ends, strays and which torques it takes
python benchmark/executions.py trials [N]  how often it succeeds with errors, of N = 100 trials
python benchmark/executions.py controls    what position and torque control make of the first plans
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from cfplan_core import PlanOptions, PlanResult, Preference, Problem, load_problem, plan
from cfplan_core.contact.system import ContactSystem
from cfplan_core.execution.execute import ExecutionOptions, Executor, execute_plan
from cfplan_core.execution.feedforward import least_torques, planned_torques, segment_gradients
from cfplan_core.execution.perturbation import Uncertainty
from cfplan_core.execution.trials import run_trials
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.central_forces import central_forces

PROBLEMS = Path(__file__).parents[1] / 'config' / 'problems'
# The problems of one joint for each of two fingers.
NAMES = [
    *('h013', 'h020', 'h045', 'h1004', 'h1181', 'h120', 'h122', 'h205', 'h447'),
    'trinkle_hunter_1991',
]
FRICTIONS = (0.0, 0.05, 0.1)
SLOWNESS = 3.0
ERRORS = Uncertainty(mass_error=0.2, geometry_error=0.01, joint_noise=math.radians(0.5))


def plans() -> Iterator[tuple[Problem, str, PlanResult]]:
    for name in NAMES:
        problem = load_problem(PROBLEMS / f'{name}.yaml')
        for preference in (Preference.FIRST, Preference.ROBUST):
            yield problem, preference.value, plan(problem, PlanOptions(prefer=preference))


def print_executions(problem: Problem, preference: str, result: PlanResult) -> None:
    cells, last = [], None
    for friction in FRICTIONS:
        options = ExecutionOptions(Uncertainty(friction=friction))
        outcome = execute_plan(problem, result, options).outcome
        cells.append(
            f'{1e3 * outcome.final_position_error:.2f}, {outcome.final_angle_error:.3f} | '
            f'{outcome.largest_position_deviation / problem.object.size:.1%}, '
            f'{outcome.largest_angle_deviation:.3f}'
        )
        if not outcome.in_goal and outcome.lost:
            last = f'{outcome.lost[0].contact} at {outcome.lost[0].time:.2f} s'
    slow = replace(result, times=SLOWNESS * result.times)
    excess = execute_plan(problem, slow).outcome.torque_excess.max()
    print(
        f'| {problem.name} | {preference} | {result.times[-1]:.1f} | {" | ".join(cells)} '
        f'| {excess:.1%} | {"`" + last + "`" if last else ""} |',
        flush=True,
    )


def print_trials(problem: Problem, preference: str, result: PlanResult, count: int) -> None:
    trials = run_trials(Executor(problem, result, ExecutionOptions(ERRORS)), count)
    low, high = trials.success.interval
    losses = trials.first_losses().most_common(1)
    lost = f'`{losses[0][0][1]}` in segment {losses[0][0][0] + 1}' if losses else ''
    print(
        f'| {problem.name} | {preference} | {trials.success.successes} of {count} '
        f'| {low:.0%} to {high:.0%} | {lost} |',
        flush=True,
    )


def middle_torques(system: ContactSystem, result: PlanResult) -> tuple[FloatArray, ...]:
    """Torques in the middle of all equilibria, with forces of at most five weights."""
    torques = []
    for segment in result.segments:
        z, gradients = segment_gradients(system, result, segment)
        arms = -gradients[..., 3:]
        wide = np.full((len(z), arms.shape[2]), np.inf)
        forces = central_forces(gradients[..., :3], arms, system.load, (-wide, wide), 5.0)
        pushed = np.einsum('sk,skn->sn', forces, arms) + system.link_weight_torques(z)
        torques.append(pushed * system.force_unit * system.size)
    return tuple(torques)


def no_torques(_: ContactSystem, result: PlanResult) -> tuple[FloatArray, ...]:
    """Nothing fed forward."""
    return tuple(
        np.zeros((segment.last_frame - segment.first_frame + 1, len(result.joint_names)))
        for segment in result.segments
    )


CONTROLS = {
    'position alone': (no_torques, False),
    'position, torques of the smallest forces that hold the object': (least_torques, False),
    'position, torques in the middle of the limits': (middle_torques, False),
    'roles, torques in the middle of the limits': (middle_torques, True),
    'position, nominal torques': (planned_torques, False),
    'roles, nominal torques': (planned_torques, True),
}


def print_controls() -> None:
    plans = {name: load_problem(PROBLEMS / f'{name}.yaml') for name in NAMES}
    results = {name: plan(problem) for name, problem in plans.items()}
    for label, (torques, roles) in CONTROLS.items():
        cells = []
        for errors, count in [*((Uncertainty(friction=mu), 1) for mu in FRICTIONS), (ERRORS, 20)]:
            arrived = 0
            for name, problem in plans.items():
                executor = Executor(
                    problem, results[name], ExecutionOptions(errors, roles=roles), torques
                )
                arrived += sum(executor.run(k).outcome.in_goal for k in range(count))
            cells.append(str(arrived))
        print(f'| {label} | {" | ".join(cells)} |', flush=True)


if __name__ == '__main__':
    wanted = sys.argv[1] if len(sys.argv) > 1 else 'executions'
    if wanted == 'controls':
        print_controls()
    else:
        for each in plans():
            if wanted == 'trials':
                print_trials(*each, int(sys.argv[2]) if len(sys.argv) > 2 else 100)
            else:
                print_executions(*each)
