"""``cfplan plan``: search for a plan, print it, write it."""

from __future__ import annotations

import math
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any

import click

from cfplan_core.command_line import INTERRUPTED
from cfplan_core.command_line.console import (
    INVALID_INPUT,
    answers,
    complain,
    complaints,
    print_findings,
)
from cfplan_core.command_line.inputs import Examined, examine
from cfplan_core.command_line.outputs import check_outputs
from cfplan_core.command_line.plan_options import wanted_plan
from cfplan_core.command_line.progress import progress_bar
from cfplan_core.command_line.trajectory_options import timed_plan, trajectory_options
from cfplan_core.errors import CfplanError, InvalidProblemError
from cfplan_core.model import Problem
from cfplan_core.trajectory.plan_result import PlanResult, Status

if TYPE_CHECKING:
    from rich.progress import Progress as Bar

    from cfplan_core.planner import PlanOptions, Progress

EXIT_STATUS = {
    Status.SOLVED: 0,
    Status.INFEASIBLE: 1,
    Status.INVALID: INVALID_INPUT,
    Status.BUDGET_EXHAUSTED: 3,
}


def finite_seconds(
    ctx: click.Context, param: click.Parameter, value: float | None
) -> float | None:
    """Accept an option's number of seconds if a search or a wait can last that long."""
    if value is not None and not (math.isfinite(value) and value > 0.0):
        raise click.BadParameter(f'{value} is not a finite number of seconds above zero.')
    return value


@click.command(short_help='Search for a plan.')
@click.argument('file', type=click.Path(path_type=Path))
@click.option(
    '--json',
    'json_path',
    type=click.Path(dir_okay=False, path_type=Path),
    metavar='OUT',
    help='Write the result here as JSON, whatever the outcome; missing directories are created. '
    'Alternatives go beside it, as OUT with .2, .3 and so on before its suffix.',
)
@click.option(
    '--figures',
    'figure_directory',
    type=click.Path(file_okay=False, path_type=Path),
    metavar='DIR',
    help='Draw the figures into this directory; it is created if missing.',
)
@click.option(
    '--time-budget',
    type=float,
    callback=finite_seconds,
    metavar='S',
    help='Give up after S seconds.',
)
@click.option(
    '--max-nodes',
    type=click.IntRange(min=1),
    metavar='N',
    help='Give up once the two trees have N nodes or more together.',
)
@wanted_plan
@timed_plan
def plan(
    file: Path,
    json_path: Path | None,
    figure_directory: Path | None,
    time_budget: float | None,
    max_nodes: int | None,
    **wanted: Any,
) -> int:
    """Search for a plan that solves the problem FILE, and print it as tables.

    Exit status: 0 solved, 1 infeasible (searched to the end), 2 invalid input or usage, 3 budget
    exhausted, 130 interrupted.
    """
    from cfplan_core.planner import PlanOptions

    if figure_directory is not None:
        figure_directory.mkdir(parents=True, exist_ok=True)
    check_outputs({'--json': json_path}, [file])

    try:
        trajectory = trajectory_options(wanted)
        options = PlanOptions(
            time_budget=time_budget, max_nodes=max_nodes, trajectory=trajectory, **wanted
        )
    except CfplanError as error:
        complain(str(error))
        return INVALID_INPUT
    examined = examine(file)
    try:
        problem = examined.valid_problem()
        result, interrupted = _search(problem, options)
    except InvalidProblemError as error:
        print_findings(error.findings, complaints())
        if json_path is not None:
            write_result(_invalid(examined, file, error), json_path)
        return INVALID_INPUT
    if interrupted:
        complain('interrupted; nothing is written')
        return INTERRUPTED
    if result.status is Status.INVALID:
        named = result.message.replace('<problem>: ', f'{file}: ')
        result = replace(result, message=named)

    # Files first: they must be there even if the reader of the tables leaves early.
    if json_path is not None:
        write_result(result, json_path)
    figures: list[Path] = []
    if figure_directory is not None and result.status is not Status.INVALID:
        from cfplan_core.report.figures import write_figures

        figures = write_figures(problem, result, figure_directory)
    print_result(problem, result, figures)
    return EXIT_STATUS[result.status]


def _search(problem: Problem, options: PlanOptions) -> tuple[PlanResult, bool]:
    """Plan with progress shown; return the result and whether Ctrl-C ended the search."""
    from cfplan_core.planner import plan as search

    with progress_bar() as bar, _interrupt() as cancel:
        progress = None if bar is None else _shown_on(bar, options)
        result = search(problem, options, progress=progress, cancel=cancel)
        interrupted = cancel.is_set()
    return result, interrupted


@contextmanager
def _interrupt() -> Iterator[threading.Event]:
    """Let Ctrl-C set an event; a second one interrupts at once."""
    cancel = threading.Event()

    def stop(number: int, frame: FrameType | None) -> None:
        if cancel.is_set():
            raise KeyboardInterrupt
        cancel.set()

    before = signal.signal(signal.SIGINT, stop)
    try:
        yield cancel
    finally:
        signal.signal(signal.SIGINT, before)


def _shown_on(bar: Bar, options: PlanOptions) -> Callable[[Progress], None]:
    """Make the function that takes the planner's progress to the bar."""
    task = bar.add_task('planning', total=None)

    def show(progress: Progress) -> None:
        initial, goal = progress.nodes
        shares = []
        if options.time_budget:
            shares.append(progress.elapsed / options.time_budget)
        if options.max_nodes:
            shares.append((initial + goal) / options.max_nodes)
        bar.update(
            task,
            description=f'{initial} + {goal} nodes, {progress.formations} formations',
            total=1.0 if shares else None,
            completed=min(1.0, max(shares, default=0.0)),
        )

    return show


def _invalid(examined: Examined, file: Path, error: InvalidProblemError) -> PlanResult:
    problem = examined.problem
    return PlanResult(
        problem=problem.name if problem is not None else file.stem,
        status=Status.INVALID,
        joint_names=problem.hand.joint_names if problem is not None else (),
        message=str(error),
    )


def write_result(result: PlanResult, path: Path) -> None:
    """Write a result of any status as JSON, and its alternatives beside it."""
    from cfplan_core.trajectory.plan_file import write_plan

    write_plan(result, path)
    for number, other in enumerate(result.alternatives, 2):
        write_plan(other, path.with_name(f'{path.stem}.{number}{path.suffix}'))


def print_result(problem: Problem, result: PlanResult, figures: list[Path]) -> None:
    """Print a result as tables, and where its figures are."""
    from cfplan_core.report.tables import print_plan

    if result.status is Status.INVALID:
        complain(result.message)
        return
    console = answers()
    print_plan(result, console, problem)
    for figure in figures:
        console.print(f'Figure: {figure}', soft_wrap=True)
    if figures and not result.solved:
        console.print('Figures 4, 6 and 7 show a plan; there is none.')
