"""What the planner says of itself on /diagnostics (REP-107)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

OK = DiagnosticStatus.OK
WARN = DiagnosticStatus.WARN


@dataclass(frozen=True)
class LastPlan:
    """The last request that was answered.

    Attributes:
        problem: Its name.
        outcome: ``SOLVED``, or the name of the error code.
        planning_time: s.
    """

    problem: str
    outcome: str
    planning_time: float


@dataclass(frozen=True)
class RecorderState:
    """What became of the runs.

    Attributes:
        directory: Where they are written; empty if they are not.
        last_file: Name of the last complete one; empty if there is none.
        last_failure: Why the last run was not recorded; empty if it was.
        free_space: Bytes left in the directory; None if unknown.
        space_warning: Bytes below which to warn.
    """

    directory: str
    last_file: str
    last_failure: str
    free_space: int | None
    space_warning: float


@dataclass(frozen=True)
class PlannerState:
    """What the planner is doing.

    Attributes:
        hand: Where its hand comes from; empty without one.
        planning: True while a plan is computed.
        waiting: Requests that wait.
        last_plan: None before the first answer.
    """

    hand: str
    planning: bool
    waiting: int
    last_plan: LastPlan | None


def diagnostic_array(
    node_name: str, stamp: Time, planner: PlannerState, recorder: RecorderState
) -> DiagnosticArray:
    """Make the message: one status for the planner, one for the recorder."""
    array = DiagnosticArray(
        status=[
            _status(f'{node_name}: planner', *_planner(planner)),
            _status(f'{node_name}: recorder', *_recorder(recorder)),
        ]
    )
    array.header.stamp = stamp
    return array


def _planner(state: PlannerState) -> tuple[bytes, str, dict[str, str]]:
    doing = 'planning' if state.planning else 'idle'
    values = {'state': doing, 'waiting requests': str(state.waiting), 'hand': state.hand}
    if state.last_plan is not None:
        values['last problem'] = state.last_plan.problem
        values['last outcome'] = state.last_plan.outcome
        values['last planning time [s]'] = f'{state.last_plan.planning_time:.3f}'
    if not state.hand:
        return WARN, 'no hand: set the parameter hand_file', values
    waiting = f', {state.waiting} waiting' if state.waiting else ''
    return OK, doing + waiting, values


def _recorder(state: RecorderState) -> tuple[bytes, str, dict[str, str]]:
    if not state.directory:
        return OK, 'recording is off', {}
    free = 'unknown' if state.free_space is None else f'{state.free_space / 1e6:.0f}'
    values = {
        'directory': state.directory,
        'last file': state.last_file,
        'last failure': state.last_failure,
        'free space [MB]': free,
    }
    if state.last_failure:
        return WARN, f'the last run was not recorded: {state.last_failure}', values
    if state.free_space is not None and state.free_space < state.space_warning:
        return WARN, f'{free} MB left, less than {state.space_warning / 1e6:.0f} MB', values
    return OK, 'recording', values


def _status(name: str, level: bytes, message: str, values: Mapping[str, str]) -> DiagnosticStatus:
    pairs = [KeyValue(key=key, value=value) for key, value in values.items()]
    return DiagnosticStatus(level=level, name=name, message=message, values=pairs)
