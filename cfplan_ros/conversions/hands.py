"""The planner's own hand and object, from files of their own or out of problem files."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cfplan_core.errors import CfplanError, Finding, InvalidProblemError
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.model import Hand, ManipulatedObject, Problem
from cfplan_core.model.faults import Fault, findings_of, shown
from cfplan_core.model.loading import problem_from_mapping
from cfplan_core.model.yaml_file import read_yaml

_CONTENTS = {
    'hand': 'a mapping of palm and fingers, or a problem with a hand',
    'object': 'a mapping of vertices and mass, or a problem with an object',
}
_TRIANGLE = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]
_ANY_HAND = {
    'palm': [],
    'fingers': [
        {
            'name': 'finger',
            'base': [0.0, 0.0],
            'base_angle': 0.0,
            'joints': [
                {'name': 'joint', 'limits': [-1.0, 1.0], 'velocity_limit': 1, 'effort_limit': 1}
            ],
            'links': [{'name': 'link', 'length': 1.0, 'vertices': _TRIANGLE}],
        }
    ],
}
_ANY_OBJECT = {'vertices': _TRIANGLE, 'mass': 1.0}
# File name for findings that are not about the part looked at.
_ELSEWHERE = '<elsewhere>'


def load_hand(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read a hand.

    Args:
        path: A YAML file with the mapping that a problem file has under ``hand``, or a problem
            file, of which only the hand is checked.

    Returns:
        The mapping, free of faults.

    Raises:
        InvalidProblemError: The file cannot be read or the hand is wrong, with all findings.
    """
    return _load(path, 'hand')


def load_object(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read an object, from a file of its own or out of a problem file, as `load_hand` does."""
    return _load(path, 'object')


def build_hand(mapping: Mapping[str, Any], file: str = '<hand>') -> Hand:
    """Build a hand from the mapping that a problem file has under ``hand``.

    Args:
        mapping: In the format ``cfplan/problem/1``.
        file: Name for findings.

    Raises:
        InvalidProblemError: The mapping is wrong, with all findings.
    """
    return _sound(mapping, 'hand', file).hand


def build_object(mapping: Mapping[str, Any], file: str = '<object>') -> ManipulatedObject:
    """Build an object from the mapping that a problem file has under ``object``.

    Args:
        mapping: In the format ``cfplan/problem/1``.
        file: Name for findings.

    Raises:
        InvalidProblemError: The mapping is wrong, with all findings.
    """
    return _sound(mapping, 'object', file).object


def hand_digest(hand: Hand | Mapping[str, Any]) -> str:
    """Return a digest of what a hand is, the same however its file is written.

    It is the SHA-256 of the hand's bodies, axes, names, limits and masses, as JSON with every
    number as the shortest decimal that gives the same double.

    Args:
        hand: A hand, or its mapping in a problem file.

    Returns:
        64 hexadecimal digits.

    Raises:
        InvalidProblemError: The mapping is wrong, with all findings.
    """
    hand = hand if isinstance(hand, Hand) else build_hand(hand)
    content = {
        'palm': [_rows(vertices) for vertices in hand.palm],
        'fingers': [
            {
                'name': finger.name,
                'base': _rows(finger.base),
                'base_angle': _number(finger.base_angle),
                'joints': [
                    {
                        'name': joint.name,
                        'lower': _number(joint.lower),
                        'upper': _number(joint.upper),
                        'velocity_limit': _number(joint.velocity_limit),
                        'effort_limit': _number(joint.effort_limit),
                        'acceleration_limit': None
                        if joint.acceleration_limit is None
                        else _number(joint.acceleration_limit),
                    }
                    for joint in finger.joints
                ],
                'links': [
                    {
                        'name': link.name,
                        'length': _number(link.length),
                        'vertices': _rows(link.vertices),
                        'mass': _number(link.mass),
                    }
                    for link in finger.links
                ],
            }
            for finger in hand.fingers
        ],
    }
    text = json.dumps(content, sort_keys=True, separators=(',', ':'), allow_nan=False)
    return hashlib.sha256(text.encode('ascii')).hexdigest()


def _number(value: float) -> float:
    """A double, and zero without a sign: -0.0 is the same hand."""
    return float(value) + 0.0


def _rows(array: FloatArray) -> Any:
    return (array + 0.0).tolist()


def _load(path: str | os.PathLike[str], part: str) -> dict[str, Any]:
    file = os.fsdecode(path)
    value: Any = _read(file, part)
    reference: str | None = file
    if isinstance(value.get(part), str):
        reference = file = os.fsdecode(Path(file).parent / value[part])
        value = _read(file, part)
    elif part in value:
        value, reference = value[part], None
        if not isinstance(value, dict):
            raise InvalidProblemError([Finding(file, part, shown(value), _CONTENTS[part])])
    _sound(value, part, file, reference)
    return dict(value)


def _read(file: str, part: str) -> dict[str, Any]:
    data, faults = read_yaml(Path(file), _CONTENTS[part])
    if not faults and not isinstance(data, dict):
        faults = [Fault((), shown(data), _CONTENTS[part])]
    if faults:
        raise InvalidProblemError(findings_of(faults, data, file, {}))
    assert isinstance(data, dict)
    return data


def _sound(
    value: Mapping[str, Any], part: str, file: str, reference: str | None = None
) -> Problem:
    """Make some problem with a hand or object; of its faults only those of the part count.

    Args:
        value: The part.
        part: Its key in a problem file.
        file: Name for findings.
        reference: Name of the file of the part alone, if it has one: its findings' fields then
            start inside the part.
    """
    hand = value if part == 'hand' else _ANY_HAND
    problem = {
        'format': 'cfplan/problem/1',
        'name': 'any',
        'gravity': [0.0, 0.0],
        'hand': hand,
        'object': _ANY_OBJECT,
        'contact': {'friction': 0.0},
        'start': {'object_pose': [0.0, 0.0, 0.0], 'joints': dict.fromkeys(_joints(hand), 0.0)},
        'goal': {'object_pose': [0.0, 0.0, 0.0]},
        part: value if reference is None else reference,
    }
    reading = problem_from_mapping(problem, _ELSEWHERE, '')
    findings = [
        Finding(file, found.field, found.value, found.expected)
        for found in reading.findings
        if found.file != _ELSEWHERE or found.field.startswith(part)
    ]
    if findings:
        raise InvalidProblemError(findings)
    if reading.problem is None:
        raise CfplanError(f'{file}: {part}: cannot be used')
    return reading.problem


def _joints(hand: Mapping[str, Any]) -> list[str]:
    """Names of a hand's joints, as far as they can be made out."""
    names = []
    fingers = hand.get('fingers')
    for finger in fingers if isinstance(fingers, list | tuple) else ():
        joints = finger.get('joints') if isinstance(finger, Mapping) else None
        for joint in joints if isinstance(joints, list | tuple) else ():
            name = joint.get('name') if isinstance(joint, Mapping) else None
            if isinstance(name, str):
                names.append(name)
    return names
