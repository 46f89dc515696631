"""``cfplan verify``: certify a plan by a second method."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import click
from rich.table import Table

from cfplan_core.command_line.console import answers, new_table

if TYPE_CHECKING:
    from cfplan_core.verification import Check

REFUTED = 1


@click.command(short_help='Certify a plan by a second method.')
@click.argument('problem_path', metavar='PROBLEM', type=click.Path(path_type=Path))
@click.argument('plan_path', metavar='PLAN', type=click.Path(path_type=Path))
@click.option(
    '--inertia',
    type=float,
    metavar='SHARE',
    help='Inertial forces may be up to this share of the weight; 0.05 unless given.',
)
@click.option('-v', '--verbose', is_flag=True, help='List every check, also those that pass.')
def verify(problem_path: Path, plan_path: Path, inertia: float | None, verbose: bool) -> int:
    """Certify, frame by frame, that the file PLAN solves the file PROBLEM.

    Shares no code with the planner's mechanics. Lists the checks that fail, and what is wrong in
    the first frame that fails.

    Exit status: 0 certified, 1 not, 2 invalid input or usage.
    """
    from cfplan_core.model.loading import load_problem
    from cfplan_core.options import TrajectoryOptions
    from cfplan_core.trajectory.plan_file import read_plan
    from cfplan_core.verification import verify_plan

    options = TrajectoryOptions() if inertia is None else TrajectoryOptions(inertia=inertia)
    problem, plan = load_problem(problem_path), read_plan(plan_path)
    report = verify_plan(problem, plan, options.inertia)
    console = answers()
    shown = [check for check in report.checks if verbose or not check.ok]
    if shown:
        console.print(_table(f'Verification of {report.problem}', shown))
    first = report.first_failure
    if first is None:
        applied = sum(check.count > 0 for check in report.checks)
        frames = f'{report.frames} frame{"s pass" if report.frames != 1 else " passes"}'
        console.print(f'Certified: {frames} {applied} checks.')
        return 0
    where = 'the plan as a whole' if first.frame is None else f'frame {first.frame}'
    console.print(f'Not certified. First failure: {where}', soft_wrap=True)
    for failure in report.failures:
        if failure.frame == first.frame:
            console.print(f'  {failure.check}: {failure.message}', soft_wrap=True)
    return REFUTED


def _table(title: str, checks: Iterable[Check]) -> Table:
    table = new_table(title)
    table.add_column('Check')
    for heading in ('Failed', 'Worst', 'Frame', 'Limit'):
        table.add_column(heading, justify='right')
    for check in checks:
        worst, limit = _measure(check)
        table.add_row(
            check.description,
            f'{check.failed} of {check.count}',
            worst,
            '' if check.worst_frame is None or not worst else str(check.worst_frame),
            limit,
            style='' if check.ok else 'bold red',
        )
    return table


def _measure(check: Check) -> tuple[str, str]:
    """Worst value and limit as text; nothing for a check that only holds or does not."""
    only_yes_or_no = check.limit == 0.0 and not check.unit and not check.at_least
    if only_yes_or_no or check.count == 0:
        return '', ''
    bound = '≥' if check.at_least else '≤'
    return f'{check.worst:.2g}', f'{bound} {check.limit:.2g} {check.unit}'.rstrip()
