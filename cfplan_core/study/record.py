"""What became of one run of a study, as a row of text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

from cfplan_core.errors import CfplanError
from cfplan_core.study.design import StudyRun
from cfplan_core.study.parameters import PARAMETERS, Value


class Verdict(str, Enum):
    """What became of a run."""

    IN_GOAL = 'in goal'
    MISSED = 'missed'
    NO_PLAN = 'no plan'
    FAILED = 'failed'


MEASURES = (
    'position_error',
    'angle_error',
    'position_deviation',
    'angle_deviation',
    'torque_excess',
    'plan_duration',
    'lost_at',
)
"""Numbers in a record, in the order of the columns; of what was not executed they are None."""

COLUMNS = (
    'key',
    'problem',
    *PARAMETERS,
    'seed',
    'sample',
    'verdict',
    *MEASURES,
    'lost',
    'reason',
)


@dataclass(frozen=True)
class Record:
    """What became of a run.

    Attributes:
        key: Of the run.
        problem: Name of the problem.
        values: Of all parameters, in the order of `PARAMETERS`.
        seed: Of the study.
        sample: Number of the run in its combination.
        verdict: What became of it.
        measures: In the order of `MEASURES`: errors at the end and largest deviations on the way
            (m, rad), largest torque beyond the planned limits (weights times sizes), the plan's
            duration (s), and when a planned contact was first lost (s from its start).
        lost: Name of that contact.
        reason: Why there is no plan, or why the run failed.
    """

    key: str
    problem: str
    values: tuple[Value, ...]
    seed: int
    sample: int
    verdict: Verdict
    measures: tuple[float | None, ...] = (None,) * len(MEASURES)
    lost: str = ''
    reason: str = ''

    @property
    def order(self) -> tuple[object, ...]:
        """What records are sorted by: problem, parameters, seed, sample."""
        values = tuple((value is not None, value) for value in self.values)
        return (self.problem, *values, self.seed, self.sample, self.key)

    def value(self, name: str) -> Value:
        """Value of a parameter, or the problem's name for ``problem``."""
        return self.problem if name == 'problem' else self.values[list(PARAMETERS).index(name)]


def record_of(
    run: StudyRun,
    verdict: Verdict,
    measures: Mapping[str, float | None] | None = None,
    lost: str = '',
    reason: str = '',
) -> Record:
    """Record what became of a run; numbers keep six digits, reasons become one line."""
    found = measures or {}
    rounded = (found.get(name) for name in MEASURES)
    return Record(
        run.key,
        run.problem.name,
        tuple(run.values[name] for name in PARAMETERS),
        run.seed,
        run.sample,
        verdict,
        tuple(None if value is None else float(f'{value:.6g}') for value in rounded),
        lost,
        ' '.join(reason.split()),
    )


def cells_of(record: Record) -> list[str]:
    """Write a record as the texts of its columns."""
    values = (record.key, record.problem, *record.values, record.seed, record.sample)
    end = (record.verdict.value, *record.measures, record.lost, record.reason)
    return ['' if value is None else str(value) for value in (*values, *end)]


def record_from(cells: Sequence[str]) -> Record:
    """Read a record from the texts of its columns.

    Raises:
        CfplanError: They are not a record's.
    """
    if len(cells) != len(COLUMNS):
        raise CfplanError(f'got {len(cells)} columns, expected {len(COLUMNS)}')
    by_name = dict(zip(COLUMNS, cells, strict=True))
    try:
        return Record(
            by_name['key'],
            by_name['problem'],
            tuple(p.value(by_name[n]) if by_name[n] else None for n, p in PARAMETERS.items()),
            int(by_name['seed']),
            int(by_name['sample']),
            Verdict(by_name['verdict']),
            tuple(float(by_name[name]) if by_name[name] else None for name in MEASURES),
            by_name['lost'],
            by_name['reason'],
        )
    except ValueError as error:
        raise CfplanError(str(error)) from None
