"""``cfplan map``: the joint space coloured by contact formation, and what can be reached of it."""

from __future__ import annotations

from pathlib import Path

import click

from cfplan_core.command_line.console import answers
from cfplan_core.command_line.inputs import examine
from cfplan_core.command_line.plan_options import resolution_option, second_order_option
from cfplan_core.errors import CfplanError


@click.command('map', short_help='Draw the joint space coloured by contact formation.')
@click.argument('file', metavar='PROBLEM', type=click.Path(path_type=Path))
@click.option(
    '-o',
    '--output',
    type=click.Path(dir_okay=False, path_type=Path),
    required=True,
    metavar='FILE',
    help='Picture to write: PNG, PDF or SVG, by its suffix.',
)
@resolution_option
@second_order_option
def map_command(file: Path, output: Path, resolution: float, second_order: bool) -> int:
    """Draw the joint space of a PROBLEM, coloured by contact formation.

    For hands of one or two joints. What can be reached from the start is strong, what can only be
    reached from the goal pale; start, goal and, if there is one, the plan are drawn over it.

    Exit status: 0 drawn, 2 invalid input or usage.
    """
    from cfplan_core.exploration import explore
    from cfplan_core.planner import PlanOptions, plan
    from cfplan_core.report.figures.joint_map import joint_map
    from cfplan_core.report.figures.saving import FORMATS, save_figure

    if output.suffix.removeprefix('.') not in FORMATS:
        raise CfplanError(
            f'{output}: expected a file name that ends in {", ".join(f".{f}" for f in FORMATS)}'
        )
    problem = examine(file).valid_problem()
    explored = explore(problem, resolution, second_order)
    options = PlanOptions(resolution=resolution, second_order=second_order)
    result = plan(problem, options)
    save_figure(joint_map(explored, result), output)
    console = answers()
    console.print(f'{explored.coverage[0].upper()}{explored.coverage[1:]}.')
    console.print(f'Figure: {output}', soft_wrap=True)
    return 0
