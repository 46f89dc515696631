"""What came of a study, as tables for a terminal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from rich import box
from rich.console import Group
from rich.table import Table
from rich.text import Text

from cfplan_core.execution.trials import SuccessRate
from cfplan_core.study.record import Record, Verdict
from cfplan_core.study.success import dependences, success_of

_MOST_REASONS = 5


def study_tables(records: Sequence[Record]) -> Group:
    """Say how many runs ended in the goal grasp, against each parameter, and why others failed.

    Args:
        records: Of a study, at least one.
    """
    total = success_of(records)
    counts = Counter(record.verdict for record in records)
    others = ', '.join(
        f'{counts[verdict]} {verdict.value}'
        for verdict in Verdict
        if counts[verdict] and verdict is not Verdict.IN_GOAL
    )
    headline = (
        f'In the goal grasp {total.successes} of {total.trials} times, {_rate(total)} '
        f'({_interval(total)} with a confidence of 95 %)'
    )
    parts: list[Table | Text] = [Text(headline + (f'; {others}' if others else ''), 'bold')]
    for dependence in dependences(records):
        table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
        table.add_column(Text(dependence.name))
        for heading in ('In the goal', 'of', 'Rate', '95 % confidence'):
            table.add_column(heading, justify='right')
        for level in dependence.levels:
            success = level.success
            table.add_row(
                Text(level.label),
                str(success.successes),
                str(success.trials),
                _rate(success),
                _interval(success),
            )
        parts.append(table)
    reasons = Counter(record.reason for record in records if record.reason)
    if reasons:
        parts.append(Text('Why there was nothing to execute, or a run failed', 'bold'))
        lines = [f'{n:5} × {reason}' for reason, n in reasons.most_common(_MOST_REASONS)]
        parts.append(Text('\n'.join(lines)))
    return Group(*parts)


def _rate(success: SuccessRate) -> str:
    return f'{success.successes / success.trials:.0%}'


def _interval(success: SuccessRate) -> str:
    low, high = success.interval
    return f'{low:.0%} to {high:.0%}'
