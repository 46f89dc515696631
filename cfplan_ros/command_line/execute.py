"""``cfplan execute``: run a plan in a physics engine."""

from __future__ import annotations

import math
from pathlib import Path

import click

from cfplan_core.command_line.console import answers
from cfplan_core.command_line.inputs import problem_of_plan
from cfplan_core.errors import CfplanError

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
    '--seed',
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    metavar='S',
    help='Of the errors that are drawn.',
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
    seed: int,
) -> int:
    """Run the file PLAN in a physics engine that knows nothing of the planner's mechanics.

    The drives follow the plan in its own time. Says whether the object ends in the goal grasp,
    how far it strayed on the way, which contacts were kept, and which torques it took.

    Exit status: 0 the object ends in the goal grasp, 1 it does not, 2 invalid input or usage.
    """
    from cfplan_core.execution.execute import ExecutionOptions, execute_plan
    from cfplan_core.execution.perturbation import Uncertainty
    from cfplan_core.report.execution_tables import execution_table
    from cfplan_core.trajectory.plan_file import read_plan

    result = read_plan(plan_path)
    if not result.solved:
        raise CfplanError(
            f'{plan_path}: has no frames to execute, its status is {result.status.value}'
        )
    problem = problem_of_plan(result, plan_path, problem_path)
    uncertainty = Uncertainty(friction, mass_error, geometry_error, math.radians(joint_noise))
    execution = execute_plan(problem, result, ExecutionOptions(uncertainty, seed, gain))
    answers().print(execution_table(problem, result, execution))
    return 0 if execution.outcome.in_goal else MISSED
