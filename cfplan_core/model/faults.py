"""Faults of a document while it is checked, and which of its values can be used all the same."""

from __future__ import annotations

import math
import reprlib
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

from cfplan_core.errors import Finding

Path = tuple[str | int, ...]
"""Keys and indices from the top of a document to one of its fields."""


MOST_FAULTS = 1000


@dataclass(frozen=True)
class Fault:
    """One thing that is wrong with a document.

    Attributes:
        path: The field.
        value: What was found there, as text.
        expected: What would have been right, with its unit.
        usable: True if the field has a sound form, so that further checks can still use it.
    """

    path: Path
    value: str
    expected: str
    usable: bool = False


def limited(faults: Iterable[Fault]) -> list[Fault]:
    """Gather faults, at most `MOST_FAULTS` and one that says that there are more."""
    first = list(islice(faults, MOST_FAULTS + 1))
    if len(first) <= MOST_FAULTS:
        return first
    rest = Fault((), f'more than {MOST_FAULTS} faults', 'fewer; the rest is not looked for')
    return [*first[:-1], rest]


class Document:
    """Plain data with its faults: tells which values can be used."""

    def __init__(self, data: Mapping[str, Any], faults: Iterable[Fault]) -> None:
        self._data = data
        self._bad = {fault.path for fault in faults if not fault.usable}
        self._touched = {path[:k] for path in self._bad for k in range(len(path))}

    def get(self, *path: str | int) -> Any:
        """Return the value at a path if it is given and sound throughout, else None."""
        return None if path in self._touched else self._reach(path)

    def faulty(self, *path: str | int) -> bool:
        """Tell whether a value, something in it or something around it is unsound."""
        return path in self._touched or any(path[:k] in self._bad for k in range(len(path) + 1))

    def keys(self, *path: str | int) -> tuple[str, ...]:
        """Return the keys of a mapping, some of whose values may be unsound; empty if none."""
        value = self._reach(path)
        return tuple(value) if isinstance(value, dict) else ()

    def has(self, *path: str | int) -> bool:
        """Tell whether a value is given and of the right kind, though parts may be unsound."""
        return self._reach(path) is not None

    def indices(self, *path: str | int) -> range:
        """Return the indices of a list, some of whose items may be unsound; empty if no list."""
        value = self._reach(path)
        return range(len(value)) if isinstance(value, list) else range(0)

    def _reach(self, path: Path) -> Any:
        if any(path[:k] in self._bad for k in range(len(path) + 1)):
            return None
        value: Any = self._data
        for step in path:
            if isinstance(value, list) and isinstance(step, int):
                value = value[step]
            elif isinstance(value, dict):
                value = value.get(str(step))
            else:
                return None
        return value


def findings_of(
    faults: Iterable[Fault], data: object, file: str, parts: Mapping[str, str]
) -> tuple[Finding, ...]:
    """Turn faults into findings, in the order of the file.

    Args:
        faults: In any order.
        data: The whole document, parts in place.
        file: Name of the problem file.
        parts: Top-level key to the name of the file that its value came from.
    """
    ordered = sorted(dict.fromkeys(faults), key=lambda fault: _position(fault.path, data))
    findings = []
    for fault in ordered:
        part = parts.get(str(fault.path[0])) if fault.path else None
        path = fault.path if part is None else fault.path[1:]
        findings.append(Finding(part or file, path_text(path), fault.value, fault.expected))
    return tuple(findings)


def path_text(path: Sequence[str | int]) -> str:
    """Write a path as in ``hand.fingers[0].name``."""
    text = ''.join(f'[{step}]' if isinstance(step, int) else f'.{step}' for step in path)
    return text.removeprefix('.')


def shown(value: object) -> str:
    """Write a value as the file has it, shortened for print."""
    if value is None:
        return 'nothing'
    if isinstance(value, bool):
        return f'the truth value {str(value).lower()}'
    if isinstance(value, float) and not math.isfinite(value):
        return {'nan': '.nan', 'inf': '.inf', '-inf': '-.inf'}[str(value)]
    short = reprlib.Repr()
    short.maxstring = short.maxother = 80
    short.maxlevel = 3
    return short.repr(value)


def within_double(value: object) -> object:
    """Return a value, or infinity in place of an integer beyond double precision's range."""
    if isinstance(value, int) and abs(value) > sys.float_info.max:
        return math.copysign(math.inf, 1 if value > 0 else -1)
    return value


def _position(path: Path, data: object) -> tuple[int, ...]:
    position = []
    for step in path:
        if isinstance(data, dict):
            keys = list(data)
            position.append(keys.index(step) if step in data else len(keys))
            data = data.get(step)
        elif isinstance(data, list) and isinstance(step, int):
            position.append(step)
            data = data[step] if step < len(data) else None
    return tuple(position)
