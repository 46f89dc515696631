"""Problem files: read them, or say everything that is wrong with them at once.

Only what a file says is checked here, against the format ``cfplan/problem/1`` and itself. Whether
its grasps touch, penetrate or are stable is for the layers above.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from cfplan_core.errors import Finding, InvalidProblemError
from cfplan_core.model.building import build_problem
from cfplan_core.model.checks import content_faults
from cfplan_core.model.faults import (
    Document,
    Fault,
    Path,
    findings_of,
    limited,
    shown,
    within_double,
)
from cfplan_core.model.problem import Problem
from cfplan_core.model.schema import schema_faults
from cfplan_core.model.yaml_file import DEEPEST_NESTING, read_yaml

# Of the files that are most easily taken for problems.
_PLAN_FORMAT = 'cfplan/plan/1'
_CONTENTS = 'a mapping of format, name, gravity, hand, object, contact, start, goal'
_PARTS = {'hand': 'a mapping of palm, fingers', 'object': 'a mapping of vertices, mass'}


@dataclass(frozen=True, eq=False)
class ProblemReading:
    """What came of reading a problem.

    Attributes:
        problem: The problem, if enough is sound to build it. Where there are findings it serves
            further checks only: neutral values stand for what is wrong (see `build_problem`).
        findings: Everything that is wrong, in the order of the file.
    """

    problem: Problem | None
    findings: tuple[Finding, ...]


def load_problem(path: str | os.PathLike[str]) -> Problem:
    """Read a problem file.

    Args:
        path: A YAML file of format ``cfplan/problem/1``.

    Raises:
        InvalidProblemError: The file cannot be read or is wrong, with all findings.
    """
    reading = read_problem(path)
    if reading.findings or reading.problem is None:
        raise InvalidProblemError(reading.findings)
    return reading.problem


def read_problem(path: str | os.PathLike[str]) -> ProblemReading:
    """Read a problem file and gather what is wrong with it; no content makes this raise.

    Args:
        path: A YAML file of format ``cfplan/problem/1``.
    """
    file = os.fsdecode(path)
    data, faults = read_yaml(FilePath(file), _CONTENTS)
    if data is None and faults:
        return ProblemReading(None, findings_of(faults, data, file, {}))
    return _reading(data, faults, file, FilePath(file).parent)


def problem_from_mapping(
    data: Mapping[str, Any],
    file: str = '<problem>',
    directory: str | os.PathLike[str] | None = None,
) -> ProblemReading:
    """Make a problem of data in memory, as `read_problem` does of a file.

    Args:
        data: A problem of format ``cfplan/problem/1``; tuples and NumPy arrays may be lists.
        file: Name for findings.
        directory: Where paths of the hand and the object start; if None, these must be inline.
    """
    faults: list[Fault] = []
    return _reading(_plain(data, (), faults), faults, file, directory)


def _reading(
    data: object, faults: list[Fault], file: str, directory: str | os.PathLike[str] | None
) -> ProblemReading:
    if not isinstance(data, dict):
        wrong = Fault((), shown(data), _CONTENTS)
        return ProblemReading(None, findings_of([*faults, wrong], data, file, {}))
    if data.get('format') == _PLAN_FORMAT:
        wrong = Fault((), f'a plan ({_PLAN_FORMAT})', 'a problem (cfplan/problem/1)')
        return ProblemReading(None, findings_of([wrong], {}, file, {}))
    whole, files, part_faults = _with_parts(data, file, directory)
    faults = [*faults, *part_faults]
    known = {fault.path for fault in faults}
    faults += limited(fault for fault in schema_faults(whole) if fault.path not in known)
    faults += limited(content_faults(Document(whole, faults)))
    problem = build_problem(Document(whole, faults))
    return ProblemReading(problem, findings_of(faults, whole, file, files))


def _with_parts(
    data: dict[str, Any], file: str, directory: str | os.PathLike[str] | None
) -> tuple[dict[str, Any], dict[str, str], list[Fault]]:
    """Put the hand and the object in place of the paths of their files.

    Returns:
        The whole problem, the file of each part that has one, and the faults of these files.
    """
    whole, files, faults = dict(data), {}, []
    for key, contents in _PARTS.items():
        reference = data.get(key)
        if not isinstance(reference, str) or not reference:
            continue
        if directory is None:
            faults.append(Fault((key,), shown(reference), f'{contents}, inline'))
            continue
        path = FilePath(directory, reference)
        files[key] = str(path)
        value, part_faults = read_yaml(path, contents, file)
        faults += [
            Fault((key, *fault.path), fault.value, fault.expected, fault.usable)
            for fault in part_faults
        ]
        if isinstance(value, dict):
            whole[key] = value
        elif value is not None or not part_faults:
            faults.append(Fault((key,), shown(value), contents))
    return whole, files, faults


def _plain(value: object, path: Path, faults: list[Fault]) -> object:
    """Copy data into dictionaries and lists; what has no place in a file becomes a fault."""
    if len(path) > DEEPEST_NESTING:
        faults.append(Fault(path, 'more', f'at most {DEEPEST_NESTING} nested lists'))
        return None
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Mapping):
        faults += [
            Fault((*path, str(key)), f'the key {shown(key)}', 'a text as the key')
            for key in value
            if not isinstance(key, str)
        ]
        return {
            key: _plain(item, (*path, key), faults)
            for key, item in value.items()
            if isinstance(key, str)
        }
    if isinstance(value, list | tuple):
        return [_plain(item, (*path, k), faults) for k, item in enumerate(value)]
    return within_double(value)
