"""What became of an executed plan, as tables for a terminal."""

from __future__ import annotations

from rich import box
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from cfplan_core.execution.execute import Execution
from cfplan_core.execution.outcome import Outcome
from cfplan_core.execution.trials import Trials
from cfplan_core.model import Problem
from cfplan_core.trajectory.plan_result import PlanResult

_MOST_LOSSES = 5


def execution_table(problem: Problem, result: PlanResult, execution: Execution) -> Group:
    """Describe an execution: where the object ended, its contacts by segment, the torques.

    Args:
        problem: What was planned.
        result: Its plan.
        execution: Of the plan.
    """
    outcome = execution.outcome
    return Group(
        Text(f'{result.problem}: {verdict(outcome)}', 'bold'),
        _deviation_table(problem, outcome),
        Text('Contacts, observed against planned', 'bold'),
        _contact_table(result, outcome),
        Text('Torques (N·m)', 'bold'),
        _torque_table(problem, outcome),
    )


def verdict(outcome: Outcome) -> str:
    """Say in words whether the object ended in the goal grasp, and if not what it lost first."""
    if outcome.in_goal:
        return 'the object ends in the goal grasp'
    first = outcome.lost[0] if outcome.lost else None
    why = (
        f'first lost {first.contact} at {first.time:.2f} s, in segment {first.segment + 1}'
        if first is not None
        else 'no planned contact was lost'
    )
    return f'the object does not end in the goal grasp; {why}'


def _new_table(*headings: str) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column(headings[0])
    for heading in headings[1:]:
        table.add_column(heading, justify='right')
    return table


def _deviation_table(problem: Problem, outcome: Outcome) -> Table:
    size, tolerance = problem.object.size, outcome.tolerance
    table = _new_table('Object', 'Position (mm)', 'of its size', 'Angle (rad)')
    for label, position, angle in (
        ('error at the end', outcome.final_position_error, outcome.final_angle_error),
        ('allowed at the end', tolerance.position, tolerance.angle),
        (
            'largest deviation on the way',
            outcome.largest_position_deviation,
            outcome.largest_angle_deviation,
        ),
    ):
        table.add_row(label, f'{1e3 * position:.2f}', f'{position / size:.1%}', f'{angle:.3f}')
    return table


def _contact_table(result: PlanResult, outcome: Outcome) -> Group:
    """Each segment with how long all its contacts touched, then what was lost and made."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column('No.', justify='right')
    table.add_column('Planned contacts', overflow='fold')
    table.add_column('Time (s)', justify='right')
    table.add_column('All kept', justify='right')
    start = result.times[0]
    for k, segment in enumerate(result.segments):
        first, last = (result.times[f] - start for f in (segment.first_frame, segment.last_frame))
        table.add_row(
            str(k + 1),
            Text('\n'.join(segment.contacts)),
            f'{first:.2f} to {last:.2f}',
            f'{outcome.kept[k]:.0%}',
            end_section=True,
        )
    events = [(event, 'lost') for event in outcome.lost]
    events += [(event, 'made, not planned:') for event in outcome.made]
    lines = [
        f'{event.time:7.2f} s, segment {event.segment + 1}: {what} {event.contact}'
        for event, what in sorted(events, key=lambda entry: entry[0].time)
    ]
    return Group(table, Text('\n'.join(lines)) if lines else Text('  as planned'), Text())


def _torque_table(problem: Problem, outcome: Outcome) -> RenderableType:
    table = _new_table('Joint', 'Largest', 'Effort limit', 'Beyond the planned limits')
    for k, joint in enumerate(problem.hand.joints):
        table.add_row(
            Text(joint.name),
            f'{outcome.effort[k]:.3g}',
            f'{joint.effort_limit:.3g}',
            f'{outcome.torque_excess[k]:.1%} of weight times size',
        )
    return table


def trials_table(problem: Problem, result: PlanResult, trials: Trials) -> Group:
    """Say how often a plan ended in its goal grasp, how far off it was, and what it lost first.

    Args:
        problem: What was planned.
        result: Its plan.
        trials: Of the plan.
    """
    success = trials.success
    low, high = success.interval
    table = _new_table('Object', 'Median', '90 % stay below', 'Worst')
    for label, unit, values in (
        ('position at the end (mm)', 1e3, lambda o: o.final_position_error),
        ('angle at the end (rad)', 1.0, lambda o: o.final_angle_error),
        ('position on the way (mm)', 1e3, lambda o: o.largest_position_deviation),
        ('angle on the way (rad)', 1.0, lambda o: o.largest_angle_deviation),
    ):
        quantiles = [unit * trials.quantile(values, part) for part in (0.5, 0.9, 1.0)]
        table.add_row(label, *(f'{value:.3f}' for value in quantiles))
    losses = sorted(trials.first_losses().items(), key=lambda entry: (-entry[1], entry[0]))
    lines = [
        f'{times:5} × {name}, in segment {k + 1}' for (k, name), times in losses[:_MOST_LOSSES]
    ]
    rest = sum(times for _, times in losses[_MOST_LOSSES:])
    kept = success.trials - success.successes - sum(times for _, times in losses)
    lines += [f'{rest:5} × other contacts'] if rest else []
    lines += [f'{kept:5} × none'] if kept else []
    lost = [Text('Lost first where the object missed the goal', 'bold'), Text('\n'.join(lines))]
    return Group(
        Text(
            f'{result.problem}: in the goal grasp {success.successes} of {success.trials} times, '
            f'{success.successes / success.trials:.0%} ({low:.0%} to {high:.0%} with a confidence '
            'of 95 %)',
            'bold',
        ),
        table,
        *(lost if lines else []),
    )
