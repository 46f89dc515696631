"""Refusals of values that an option cannot have, by type and range."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from numbers import Integral, Real
from typing import TypeGuard

from cfplan_core.errors import CfplanError


def require(condition: bool, field: str, value: object, expected: str) -> None:
    """Refuse a value unless a condition holds.

    Args:
        condition: What the value must meet.
        field: Name of the option.
        value: What came.
        expected: What should have come.

    Raises:
        CfplanError: The condition does not hold.
    """
    if not condition:
        shown = f'{value}' if is_number(value) else f'{value!r}'
        raise CfplanError(f'{field}: got {shown}, expected {expected}')


def is_number(value: object) -> TypeGuard[float]:
    """Tell whether a value is a real number, of Python or NumPy; True and False are none."""
    return isinstance(value, Real) and not isinstance(value, bool)


def is_whole(value: object) -> TypeGuard[int]:
    """Tell whether a value is a whole number by its type, of Python or NumPy."""
    return isinstance(value, Integral) and not isinstance(value, bool)


def is_finite(value: object) -> TypeGuard[float]:
    """Tell whether a value is a finite number."""
    return is_number(value) and math.isfinite(value)


def is_above_zero(value: object) -> bool:
    """Tell whether a value is a finite number above zero."""
    return is_finite(value) and value > 0.0


def is_names(value: object) -> bool:
    """Tell whether a value is a sequence of names."""
    return _is_sequence(value) and all(isinstance(name, str) and name for name in value)


def is_pair(value: object) -> bool:
    """Tell whether a value is a sequence of two finite numbers."""
    return _is_sequence(value) and len(value) == 2 and all(is_finite(part) for part in value)


def is_sequence_of(each: Callable[[object], bool], value: object) -> bool:
    """Tell whether a value is a sequence whose elements all pass a test."""
    return _is_sequence(value) and all(each(element) for element in value)


def _is_sequence(value: object) -> TypeGuard[Sequence[object]]:
    return isinstance(value, Sequence) and not isinstance(value, str | bytes)
