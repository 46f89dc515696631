"""``cfplan animate``: draw a plan as a moving picture."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from cfplan_core.command_line.console import answers
from cfplan_core.command_line.inputs import problem_of_plan
from cfplan_core.command_line.outputs import check_outputs
from cfplan_core.command_line.progress import progress_bar
from cfplan_core.errors import CfplanError

if TYPE_CHECKING:
    from rich.progress import Progress as Bar


@click.command(short_help='Draw a plan as a GIF or MP4.')
@click.argument('plan_path', metavar='PLAN', type=click.Path(path_type=Path))
@click.option(
    '--problem',
    'problem_path',
    type=click.Path(path_type=Path),
    metavar='FILE',
    help='The problem; without it NAME.yaml beside the plan or among the example problems.',
)
@click.option(
    '-o',
    '--output',
    type=click.Path(dir_okay=False, path_type=Path),
    metavar='OUT',
    help='A .gif or .mp4 file, without it the plan with the suffix .gif; missing directories '
    'are created.',
)
def animate(plan_path: Path, problem_path: Path | None, output: Path | None) -> int:
    """Draw the file PLAN as a GIF or MP4.

    Exit status: 0 drawn, 2 invalid input or usage.
    """
    from cfplan_core.report.animation import write_animation
    from cfplan_core.trajectory.plan_file import read_plan

    result = read_plan(plan_path)
    if not result.solved:
        raise CfplanError(
            f'{plan_path}: has no frames to draw, its status is {result.status.value}'
        )
    problem = problem_of_plan(result, plan_path, problem_path)
    output = output if output is not None else plan_path.with_suffix('.gif')
    check_outputs({'--output': output}, [plan_path, problem_path])
    with progress_bar() as bar:
        progress = None if bar is None else _shown_on(bar)
        write_animation(problem, result, output, progress=progress)
    answers().print(f'Animation: {output}', soft_wrap=True)
    return 0


def _shown_on(bar: Bar) -> Callable[[int, int], None]:
    """Make the function that takes the number of images drawn to the bar."""
    task = bar.add_task('drawing', total=None)
    return lambda done, total: bar.update(task, completed=done, total=total)
