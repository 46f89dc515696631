"""Print the tables of docs/execution.md: the example problems' plans run in MuJoCo.

    python benchmark/executions.py [TRIALS]

With a number of trials also how often each plan succeeds with errors of mass, geometry and joints.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from cfplan_core import PlanOptions, PlanResult, Preference, Problem, load_problem, plan
from cfplan_core.execution.execute import ExecutionOptions, Executor, execute_plan
from cfplan_core.execution.perturbation import Uncertainty
from cfplan_core.execution.trials import run_trials

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


if __name__ == '__main__':
    trials = int(sys.argv[1]) if len(sys.argv) > 1 else 0
    for each in plans():
        if trials:
            print_trials(*each, trials)
        else:
            print_executions(*each)
