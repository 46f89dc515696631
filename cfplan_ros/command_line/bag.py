"""``cfplan bag``: what a recorded run holds."""

from __future__ import annotations

import json
from datetime import datetime, timezone
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from rich.console import Console
from rich.table import Table

from cfplan_core.command_line.console import answers, complain, new_table
from cfplan_ros.command_line.runtime import needs_rclpy

if TYPE_CHECKING:
    from cfplan_core.model import Problem
    from cfplan_ros.recording.reading import RunSummary

INCOMPLETE = 1
_NS_PER_S = 10**9


@click.command(short_help='Say what a recorded run holds.')
@click.argument('file', type=click.Path(path_type=Path))
def bag(file: Path) -> int:
    """Say what the recorded run FILE holds: problem, outcome, topics and the plan.

    Exit status: 0 complete, 1 cut short or still being written (what can be read is printed),
    2 FILE is no recording.
    """
    with needs_rclpy():
        from cfplan_ros.recording.reading import read_run

    run = read_run(file)
    console = answers()
    _print_heading(file, run, console)
    console.print(_topics(run))
    if run.response is not None:
        _print_outcome(run.response, run.metadata, console)
    elif run.request is not None and not run.unknown_types:
        console.print('The run ended before the planner answered')
    for name in run.unknown_types:
        console.print(f'{name} differs from the type that is installed and is not shown')
    if run.complete:
        return 0
    complain(f'{file}: not complete; cfplan recover writes a complete file')
    return INCOMPLETE


def _print_heading(file: Path, run: RunSummary, console: Console) -> None:
    first, last = run.span_ns
    console.print(
        f'{file}: {run.size} bytes, {run.count} messages in {(last - first) / _NS_PER_S:.3f} s',
        soft_wrap=True,
    )
    if run.request is not None:
        name = run.request.problem_name
        console.print(f'problem {name or "without a name"}', soft_wrap=True)
    if not run.metadata:
        console.print('not a run of cfplan: it has no metadata of that name')
        return
    commit = run.metadata.get('git_commit', '')
    console.print(
        f'started {_utc(int(run.metadata.get("start_time_ns", first)))} '
        f'by {run.metadata.get("node", "")}, cfplan {run.metadata.get("version", "")}'
        + (f', commit {commit[:12]}' if commit else ''),
        soft_wrap=True,
    )


def _utc(time_ns: int) -> str:
    time = datetime.fromtimestamp(time_ns // _NS_PER_S, timezone.utc)
    return f'{time:%Y-%m-%d %H:%M:%S} UTC'


def _topics(run: RunSummary) -> Table:
    start, _ = run.span_ns
    table = new_table('Topics', 'Topic and type', 'QoS, depth', 'Count', 'Time (s)')
    table.columns[0].overflow = 'fold'
    for topic in run.topics:
        first, last = ((time - start) / _NS_PER_S for time in (topic.first_ns, topic.last_ns))
        span = f'{first:.3f}' if first == last else f'{first:.3f} to {last:.3f}'
        table.add_row(
            f'{topic.name}\n{topic.type_name}',
            topic.qos,
            str(topic.count),
            span if topic.count else '',
        )
    return table


def _print_outcome(response: Any, metadata: dict[str, str], console: Console) -> None:
    from cfplan_core.report.tables import print_plan
    from cfplan_core.trajectory.plan_result import Status
    from cfplan_ros.conversions.plans import plan_result

    if response.error_code != response.NONE:
        console.print(f'error code {response.error_code}: {response.error_msg}', soft_wrap=True)
    result = plan_result(response)
    if result is not None and result.status is not Status.INVALID:
        print_plan(result, console, _problem(metadata))


def _problem(metadata: dict[str, str]) -> Problem | None:
    """The problem that the run's metadata holds, if it does."""
    from cfplan_core.model.loading import problem_from_mapping

    try:
        return problem_from_mapping(json.loads(metadata['problem'])).problem
    except (KeyError, ValueError, TypeError):
        return None
