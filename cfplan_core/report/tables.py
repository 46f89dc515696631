"""Results as tables for a terminal, also one of 80 columns or one that knows only ASCII."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from rich import box
from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.model import Problem
from cfplan_core.trajectory.plan_result import PlanResult, Segment
from cfplan_core.trajectory.segment_ends import SegmentEnd, segment_ends

MOST_FAILURES = 10


def plan_table(result: PlanResult, problem: Problem | None = None) -> Group:
    """Describe a result.

    A plan is described by its segments, its joint angles and its torque limits; a search without
    one by its message, by what was explored, and by the most frequent failures.

    Args:
        result: Of any status.
        problem: If given, joint angles are shown with the joints' limits.
    """
    if result.solved:
        return Group(
            _headline(result),
            *(() if result.margin is None else (Text(), _choice_table(result))),
            Text(),
            _titled('Segments', _segment_table(result)),
            _titled('Joint angles (rad)', _joint_table(result, problem)),
            _titled('Torque limits (N·m)', _torque_table(result)),
        )
    parts: list[RenderableType] = [_headline(result), Text(), _search_table(result)]
    if result.statistics.failures:
        title = 'Why transitions failed, most frequent first'
        parts += [Text(), _titled(title, _failure_table(result))]
    return Group(*parts)


def print_plan(result: PlanResult, console: Console, problem: Problem | None = None) -> None:
    """Print what `plan_table` gives."""
    console.print(plan_table(result, problem))


def _headline(result: PlanResult) -> Text:
    words = result.status.value.replace('_', ' ')
    text = Text.assemble((f'{result.problem}: ', 'bold'), (words, 'bold'))
    if result.message:
        text.append(f'\n{result.message}')
    if result.solved:
        text.append(
            f'\n{_count(len(result.segments), "segment")}, '
            f'{_count(len(result.times), "frame")}, '
            f'{result.times[-1] - result.times[0]:.2f} s of motion; '
            f'planned in {result.statistics.planning_time:.3g} s'
        )
    return text


def _count(number: int, thing: str) -> str:
    return f'{number} {thing}{"" if number == 1 else "s"}'


def _new_table() -> Table:
    return Table(box=box.SIMPLE_HEAD, pad_edge=False)


def _titled(title: str, table: Table) -> Group:
    return Group(Text(title, 'bold'), table)


def _segment_table(result: PlanResult) -> Table:
    table = _new_table()
    table.add_column('No.', justify='right')
    table.add_column('Contacts; at the end\n- broken and + made', overflow='fold')
    planned = any(segment.control is not None for segment in result.segments)
    heading = 'Stability,\nneeded force' + (',\nby torque' if planned else '')
    table.add_column(heading, overflow='fold')
    table.add_column('Frames', justify='right')
    table.add_column('Time (s)', justify='right')
    for k, (segment, ending) in enumerate(
        zip(result.segments, segment_ends(result.segments), strict=True)
    ):
        start, end = result.times[segment.first_frame], result.times[segment.last_frame]
        table.add_row(
            str(k + 1),
            Text('\n'.join(_contacts(segment, ending))),
            segment.stability.replace('_', ' ')
            + _needed(segment.needed_force)
            + _torque_controlled(segment.control),
            f'{segment.first_frame} to {segment.last_frame}',
            f'{start:.2f} to {end:.2f}\n({end - start:.2f})',
            end_section=True,
        )
    return table


def _choice_table(result: PlanResult) -> Table:
    """The plan and its alternatives with what they cost."""
    table = _new_table()
    table.add_column('Plan')
    for name in ('Segments', 'Length (rad)', 'Needed force', 'Margin', 'Fewest, most contacts'):
        table.add_column(name, justify='right')
    for number, plan in enumerate((result, *result.alternatives), 1):
        contacts = [len(segment.contacts) for segment in plan.segments]
        table.add_row(
            str(number) if number > 1 else '1, below',
            str(len(plan.segments)),
            f'{plan.length:.3f}',
            '' if plan.needed_force is None else f'{plan.needed_force:.2f}',
            '' if plan.margin is None else f'{plan.margin:.3g}',
            f'{min(contacts)}, {max(contacts)}',
        )
    return table


def _needed(force: float | None) -> str:
    return '' if force is None else f'\n{force:.2f} weights'


def _contacts(segment: Segment, end: SegmentEnd) -> list[str]:
    """Contacts of a segment, then those that break and those that are made at its end."""
    broken = [f'- {name}' for name in end.broken]
    return [*segment.contacts, *broken, *[f'+ {name}' for name in end.made]]


def _torque_controlled(control: Mapping[str, str] | None) -> str:
    if control is None:
        return ''
    names = [name for name, role in control.items() if role == 'effort']
    return '\n' + (', '.join(names) or 'none')


def _joint_table(result: PlanResult, problem: Problem | None) -> Table:
    table = _new_table()
    table.add_column('Joint', overflow='fold')
    for name in ('Start', 'Goal', 'Smallest', 'Largest'):
        table.add_column(name, justify='right')
    if problem is not None:
        table.add_column('Limits', justify='right')
    for k, name in enumerate(result.joint_names):
        angles = result.joints[:, k]
        row = [f'{a:.3f}' for a in (angles[0], angles[-1], angles.min(), angles.max())]
        if problem is not None:
            joint = problem.hand.joints[k]
            row.append(f'{joint.lower:.3f} to {joint.upper:.3f}')
        table.add_row(Text(name), *row)
    return table


def _torque_table(result: PlanResult) -> Table:
    table = _new_table()
    table.add_column('Joint', overflow='fold')
    nominal = len(result.torque_nominal) > 0
    columns = ['Range of lower limit', 'Range of upper limit', 'Narrowest interval']
    for name in columns + ['Range of nominal torque'] * nominal:
        table.add_column(name, justify='right')
    for k, name in enumerate(result.joint_names):
        lower, upper = result.torque_lower[:, k], result.torque_upper[:, k]
        narrowest = int(np.argmin(upper - lower))
        table.add_row(
            Text(name),
            _range(lower),
            _range(upper),
            f'{_torque(lower[narrowest])} to {_torque(upper[narrowest])}\nin frame {narrowest}',
            *([_range(result.torque_nominal[:, k])] if nominal else []),
        )
    return table


def _range(values: FloatArray) -> str:
    least, greatest = _torque(values.min()), _torque(values.max())
    return least if least == greatest else f'{least} to {greatest}'


def _torque(value: float) -> str:
    """Three significant digits, 0 for what is rounding, words for infinity."""
    if not np.isfinite(value):
        return 'unbounded'
    return '0' if abs(value) < 1e-9 else f'{value:.3g}'


def _search_table(result: PlanResult) -> Table:
    statistics = result.statistics
    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column('what')
    table.add_column('how many', justify='right')
    table.add_row('planning time', f'{statistics.planning_time:.3g} s')
    table.add_row('nodes of the initial tree', str(statistics.initial_tree_nodes))
    table.add_row('nodes of the goal tree', str(statistics.goal_tree_nodes))
    table.add_row('contact formations met', str(statistics.formations))
    table.add_row('transitions tried', str(statistics.transitions))
    return table


def _failure_table(result: PlanResult) -> Table:
    failures = sorted(result.statistics.failures.items(), key=lambda item: -item[1])
    table = _new_table()
    table.add_column('Times', justify='right')
    table.add_column('Reason', overflow='fold')
    for reason, times in failures[:MOST_FAILURES]:
        table.add_row(str(times), Text(reason))
    rest = failures[MOST_FAILURES:]
    if rest:
        table.add_row(str(sum(times for _, times in rest)), _count(len(rest), 'other reason'))
    return table
