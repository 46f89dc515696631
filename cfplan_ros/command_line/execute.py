"""``cfplan execute``: run a plan in a physics engine."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from cfplan_core.command_line.console import answers
from cfplan_core.command_line.inputs import problem_of_plan
from cfplan_core.command_line.outputs import PICTURES, check_outputs, check_suffix
from cfplan_core.command_line.progress import progress_bar
from cfplan_core.errors import CfplanError
from cfplan_ros.command_line.runtime import needs_rclpy

if TYPE_CHECKING:
    from rich.progress import Progress as Bar

    from cfplan_core.execution.execute import Execution, Executor
    from cfplan_core.execution.trials import Trials
    from cfplan_core.model import Problem
    from cfplan_core.trajectory.plan_result import PlanResult

MISSED = 1


@click.command(short_help='Run a plan in a physics engine.')
@click.argument('plan_path', metavar='PLAN', type=click.Path(path_type=Path))
@click.option(
    '--problem',
    'problem_path',
    type=click.Path(path_type=Path),
    metavar='FILE',
    help='The problem; without it NAME.yaml beside the plan or among the example problems.',
)
@click.option(
    '--engine',
    type=click.Choice(['mujoco']),
    default='mujoco',
    show_default=True,
    help='The physics engine.',
)
@click.option(
    '--friction',
    type=click.FloatRange(0.0, 10.0),
    default=0.0,
    metavar='MU',
    help='Coulomb coefficient of every contact; the plan does not know of it.',
)
@click.option(
    '--mass-error',
    type=click.FloatRange(0.0, 0.99),
    default=0.0,
    metavar='PART',
    help="Draw the object's mass within this part of it, e.g. 0.2.",
)
@click.option(
    '--geometry-error',
    type=click.FloatRange(0.0, 0.2),
    default=0.0,
    metavar='PART',
    help='Shift every vertex of object and links by up to this part of the size of the object.',
)
@click.option(
    '--joint-noise',
    type=click.FloatRange(0.0, 57.0),
    default=0.0,
    metavar='DEGREES',
    help="Shift each joint's zero by up to so many degrees.",
)
@click.option(
    '--gain',
    type=click.FloatRange(0.0, min_open=True),
    metavar='K',
    help='Stiffness of joints held in position, N·m/rad; without it one that fits the '
    "object's weight and size.",
)
@click.option(
    '--roles/--no-roles',
    default=True,
    show_default=True,
    help='Control joints in position or in torque as the plan says, or hold all of them in '
    "position; the plan's torques are fed forward either way.",
)
@click.option(
    '--trials',
    type=click.IntRange(min=1),
    metavar='N',
    help='Run the plan N times, each time with other errors, and say how often it succeeds.',
)
@click.option(
    '--seed',
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    metavar='S',
    help='Of the errors that are drawn.',
)
@click.option(
    '--figure',
    'figure_path',
    type=click.Path(dir_okay=False, path_type=Path),
    metavar='OUT',
    help='Draw what was planned and what happened, as .png, .pdf or .svg.',
)
@click.option(
    '--animation',
    'animation_path',
    type=click.Path(dir_okay=False, path_type=Path),
    metavar='OUT',
    help='Draw what happened as a .gif or .mp4.',
)
@click.option(
    '--record',
    'record_path',
    type=click.Path(dir_okay=False, path_type=Path),
    metavar='OUT',
    help='Record what happened as .mcap, with the topics of a planning run; needs rclpy.',
)
def execute(
    plan_path: Path,
    problem_path: Path | None,
    engine: str,
    friction: float,
    mass_error: float,
    geometry_error: float,
    joint_noise: float,
    gain: float | None,
    roles: bool,
    trials: int | None,
    seed: int,
    figure_path: Path | None,
    animation_path: Path | None,
    record_path: Path | None,
) -> int:
    """Run the file PLAN in a physics engine that knows nothing of the planner's mechanics.

    The drives follow the plan in its own time. Says whether the object ends in the goal grasp,
    how far it strayed on the way, which contacts were kept, and which torques it took. With
    --trials what is drawn or recorded is the first trial.

    Exit status: 0 the object ends in the goal grasp, in all trials, 1 it does not, 2 invalid
    input or usage.
    """
    from cfplan_core.execution.execute import ExecutionOptions, Executor
    from cfplan_core.execution.perturbation import Uncertainty
    from cfplan_core.execution.scene import import_mujoco
    from cfplan_core.report.execution_tables import execution_table, trials_table
    from cfplan_core.trajectory.plan_file import read_plan

    check_suffix('--figure', figure_path, PICTURES)
    check_suffix('--animation', animation_path, ('.gif', '.mp4'))
    check_suffix('--record', record_path, ('.mcap',))
    check_outputs(
        {'--figure': figure_path, '--animation': animation_path, '--record': record_path},
        [plan_path, problem_path],
    )
    if record_path is not None:
        with needs_rclpy():
            import cfplan_ros.recording.execution_file  # noqa: F401 - it may be missing
    result = read_plan(plan_path)
    if not result.solved:
        raise CfplanError(
            f'{plan_path}: has no frames to execute, its status is {result.status.value}'
        )
    problem = problem_of_plan(result, plan_path, problem_path)
    import_mujoco()
    uncertainty = Uncertainty(friction, mass_error, geometry_error, math.radians(joint_noise))
    options = ExecutionOptions(uncertainty, seed, gain, roles)
    executor = Executor(problem, result, options)
    began = time.time_ns()
    execution = executor.run(0)
    if trials is None:
        answers().print(execution_table(problem, result, execution))
        succeeded = execution.outcome.in_goal
    else:
        outcomes = _run_trials(executor, trials)
        answers().print(trials_table(problem, result, outcomes))
        succeeded = outcomes.success.successes == trials
    _write(problem, result, execution, began, figure_path, animation_path, record_path)
    return 0 if succeeded else MISSED


def _run_trials(executor: Executor, count: int) -> Trials:
    from cfplan_core.execution.trials import run_trials

    with progress_bar() as bar:
        return run_trials(executor, count, None if bar is None else _shown_on(bar, count))


def _shown_on(bar: Bar, count: int) -> Callable[[int, int], None]:
    """Make the function that takes the numbers of trials and of successes to the bar."""
    task = bar.add_task('executing', total=count)

    def show(done: int, successes: int) -> None:
        bar.update(task, completed=done, description=f'{successes} of {done} in the goal')

    return show


def _write(
    problem: Problem,
    result: PlanResult,
    execution: Execution,
    began: int,
    figure_path: Path | None,
    animation_path: Path | None,
    record_path: Path | None,
) -> None:
    """Write the files that were asked for, and say which."""
    if figure_path is not None:
        from cfplan_core.report.figures.execution import execution_figure
        from cfplan_core.report.figures.saving import save_figure

        save_figure(execution_figure(problem, result, execution), figure_path)
        answers().print(f'Figure: {figure_path}', soft_wrap=True)
    if animation_path is not None:
        from cfplan_core.execution.executed import executed_motion
        from cfplan_core.report.animation import write_animation

        motion = executed_motion(result, execution)
        write_animation(execution.world.problem, motion, animation_path)
        answers().print(f'Animation: {animation_path}', soft_wrap=True)
    if record_path is not None:
        with needs_rclpy():
            from cfplan_ros.recording.execution_file import write_execution

        write_execution(record_path, result, execution, began)
        answers().print(f'Recording: {record_path}', soft_wrap=True)
