"""How success goes with each parameter of a study."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cfplan_core.execution.trials import SuccessRate
from cfplan_core.study.parameters import PARAMETERS, Value
from cfplan_core.study.record import Record, Verdict

PROBLEM = 'problem'
# Values up to so many are shown one by one; more of them, as ranges give, in so many bins.
_MOST_VALUES = 12
_BINS = 5


@dataclass(frozen=True)
class Level:
    """The runs with one value of a parameter, or with values in a bin.

    Attributes:
        label: The value, or the bin's ends.
        position: Of the value or the bin's middle on an axis; None for what is no number.
        success: How many of the runs ended in the goal grasp.
    """

    label: str
    position: float | None
    success: SuccessRate


@dataclass(frozen=True)
class Dependence:
    """Success against one parameter.

    Attributes:
        name: Of the parameter, or ``problem``.
        levels: In the order of the values.
    """

    name: str
    levels: tuple[Level, ...]


def success_of(records: Sequence[Record]) -> SuccessRate:
    """Count the runs that ended in the goal grasp among all, those without a plan included."""
    return SuccessRate(sum(r.verdict is Verdict.IN_GOAL for r in records), len(records))


def dependences(records: Sequence[Record]) -> tuple[Dependence, ...]:
    """Success against the problem and each parameter that takes more than one value.

    Args:
        records: Of a study.
    """
    varied = [name for name in (PROBLEM, *PARAMETERS) if len({r.value(name) for r in records}) > 1]
    return tuple(Dependence(name, _levels(name, records)) for name in varied)


def _levels(name: str, records: Sequence[Record]) -> tuple[Level, ...]:
    values = sorted({r.value(name) for r in records}, key=_order)
    numbers = [float(v) for v in values if isinstance(v, int | float)]
    if len(values) <= _MOST_VALUES or len(numbers) < len(values):
        return tuple(
            Level(
                'none' if value is None else f'{value}',
                float(value) if isinstance(value, int | float) else None,
                success_of([r for r in records if r.value(name) == value]),
            )
            for value in values
        )
    edges = np.linspace(numbers[0], numbers[-1], _BINS + 1)
    at = np.array([float(r.value(name) or 0.0) for r in records])
    bins = np.clip(np.searchsorted(edges, at, side='right') - 1, 0, _BINS - 1)
    levels = []
    for k in range(_BINS):
        inside = [r for r, b in zip(records, bins, strict=True) if b == k]
        if inside:
            label = f'{edges[k]:.3g} to {edges[k + 1]:.3g}'
            levels.append(Level(label, float(edges[k : k + 2].mean()), success_of(inside)))
    return tuple(levels)


def _order(value: Value) -> tuple[int, float, str]:
    if value is None:
        return 0, 0.0, ''
    return (1, float(value), '') if isinstance(value, int | float) else (2, 0.0, value)
