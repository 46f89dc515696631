"""``cfplan bag``: what a recorded run holds."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from datetime import datetime, timezone
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from rich.console import Console
from rich.table import Table

from cfplan_core.command_line.console import answers, complain, new_table
from cfplan_ros.command_line.runtime import needs_rclpy
from cfplan_ros.recording.wording import counted

if TYPE_CHECKING:
    from cfplan_core.model import Problem
    from cfplan_ros.recording.reading import RunSummary

INCOMPLETE = 1
_NAMES = 'Topic and type'
_NS_PER_S = 10**9


@click.command(short_help='Say what a recorded run holds.')
@click.argument('file', type=click.Path(path_type=Path))
def bag(file: Path) -> int:
    """Say what the recorded run FILE holds: problem, outcome, topics and the plan.

    Of a run that cfplan execute recorded it lists the topics.

    Exit status: 0 complete, 1 damaged, cut short or still being written (what can be read is
    printed), 2 FILE is no recording.
    """
    with needs_rclpy():
        from cfplan_ros.recording.reading import read_run

    run = read_run(file)
    console = answers()
    _print_heading(file, run, console)
    if run.topics:
        console.print(_topics(run, console))
    if run.response is not None:
        _print_outcome(run.response, run.metadata, console)
    elif run.request is not None and not run.unknown_types:
        console.print(_why_unanswered(run))
    for name in run.unknown_types:
        console.print(f'{name} differs from the type that is installed and is not shown')
    if run.complete:
        return 0
    complain(f'{file}: {_why_incomplete(run)}')
    return INCOMPLETE


def _why_unanswered(run: RunSummary) -> str:
    if run.in_use:
        return 'The planner has not answered yet'
    if run.damage or run.recovery.get('lost_messages', '0') != '0':
        return 'The answer is not among what can be read'
    return 'The run ended before the planner answered'


def _why_incomplete(run: RunSummary) -> str:
    if run.in_use:
        return 'a planner is still writing this file'
    if run.damage:
        count = f'{run.count} of {counted(run.written)} can be read'
        said = f'damaged: {", ".join(run.damage)}; {count}'
    else:
        said = 'not complete'
    if run.count == 0:
        return f'{said}; there is nothing to recover'
    return f'{said}; cfplan recover writes a complete file' + (' of these' if run.damage else '')


def _print_heading(file: Path, run: RunSummary, console: Console) -> None:
    first, last = run.span_ns
    console.print(
        f'{file}: {run.size} bytes, {counted(run.count)} in {(last - first) / _NS_PER_S:.3f} s',
        soft_wrap=True,
    )
    if run.recovery:
        kept, lost, added = (
            run.recovery.get(f'{what}_messages', '0') for what in ('kept', 'lost', 'added')
        )
        console.print(f'recovered: messages kept {kept}, lost {lost}, added {added}')
    if run.request is not None:
        name = run.request.problem_name
        console.print(f'problem {name or "without a name"}', soft_wrap=True)
    if not run.metadata:
        if run.complete:
            console.print('not a run of cfplan: it has no metadata of that name')
        else:
            console.print('no metadata of a run of cfplan can be read')
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


def _topics(run: RunSummary, console: Console) -> Table:
    start, _ = run.span_ns
    rows = []
    for topic in run.topics:
        first, last = ((time - start) / _NS_PER_S for time in (topic.first_ns, topic.last_ns))
        span = f'{first:.3f}' if first == last else f'{first:.3f}\nto {last:.3f}'
        rows.append((topic.qos, str(topic.count), span if topic.count else ''))
    rest = _table([('', *row) for row in rows])
    width = console.width - rest.__rich_measure__(console, console.options).maximum
    width += len(_NAMES)
    return _table(
        [
            (f'{_folded(topic.name, width)}\n{_folded(topic.type_name, width)}', *row)
            for topic, row in zip(run.topics, rows, strict=True)
        ]
    )


def _table(rows: Iterable[tuple[str, ...]]) -> Table:
    table = new_table('Topics', _NAMES, 'QoS, depth', 'Count', 'Time (s)')
    table.columns[0].overflow = 'fold'
    for row in rows:
        table.add_row(*row)
    return table


def _folded(name: str, width: int) -> str:
    """A name in lines that end with a slash where it is longer than a line."""
    lines = ['']
    for part in re.findall('[^/]*/|[^/]+', name):
        if lines[-1] and len(lines[-1] + part) > width:
            lines.append('')
        lines[-1] += part
    return '\n'.join(lines)


def _print_outcome(response: Any, metadata: dict[str, str], console: Console) -> None:
    from cfplan_core.report.tables import print_plan
    from cfplan_core.trajectory.plan_result import Status
    from cfplan_ros.conversions.plans import plan_result
    from cfplan_ros.planning_service import OUTCOMES

    code = response.error_code
    if code != response.NONE:
        outcome = OUTCOMES.get(code, 'UNKNOWN').lower().replace('_', ' ')
        console.print(f'{outcome} (error code {code}): {response.error_msg}', soft_wrap=True)
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
