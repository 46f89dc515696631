"""What makes a document a plan of the format ``cfplan/plan/1``: its schema and beyond."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Mapping
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from cfplan_core.errors import Finding, InvalidPlanError
from cfplan_core.trajectory.plan_result import Status

if TYPE_CHECKING:
    from jsonschema.exceptions import ValidationError

FORMAT = 'cfplan/plan/1'
MOST_FINDINGS = 20
JOINT_LISTS = ('joints', 'torque_lower', 'torque_upper', 'torque_nominal')

Complaint = tuple[str, str, str]
"""Field, value found there, what was expected."""


def refuse_malformed(document: Any, name: str) -> None:
    """Pass a well-formed plan document, refuse any other.

    Args:
        document: Parsed JSON.
        name: Of its file, for messages.

    Raises:
        InvalidPlanError: Says file, field, value and what was expected, for everything wrong.
    """
    # jsonschema reports each missing key by itself; the complaint already names them all.
    complaints = list(dict.fromkeys(_schema_complaints(document)))
    complaints = complaints or list(_content_complaints(document))
    if complaints:
        lines = [str(Finding(name, *complaint)) for complaint in complaints[:MOST_FINDINGS]]
        if len(complaints) > MOST_FINDINGS:
            lines.append(f'{name}: and {len(complaints) - MOST_FINDINGS} more')
        raise InvalidPlanError('\n'.join(lines))


def _schema_complaints(document: Any) -> Iterator[Complaint]:
    from jsonschema import Draft202012Validator

    schema = json.loads(files(__package__).joinpath('plan.schema.json').read_text('utf-8'))
    errors = Draft202012Validator(schema).iter_errors(document)
    for error in sorted(errors, key=lambda e: [str(part).zfill(9) for part in e.absolute_path]):
        yield _schema_complaint(error)


def _schema_complaint(error: ValidationError) -> Complaint:
    where = ''
    for part in error.absolute_path:
        where += f'[{part}]' if isinstance(part, int) else f'.{part}' if where else str(part)
    instance: Any = error.instance
    rule = error.schema if isinstance(error.schema, Mapping) else {}
    if error.validator == 'required':
        missing = [key for key in rule['required'] if key not in instance]
        return where, f'no {", ".join(missing)}', f'the keys {", ".join(rule["required"])}'
    if error.validator == 'additionalProperties':
        unknown = [key for key in instance if key not in rule['properties']]
        return where, f'unknown {", ".join(unknown)}', f'only {", ".join(rule["properties"])}'
    return where, _short(instance), str(rule.get('description', error.message))


def _content_complaints(document: dict[str, Any]) -> Iterator[Complaint]:
    """What a schema cannot say; the document already satisfies the schema."""
    not_finite = list(_non_finite(document, ''))
    yield from not_finite
    frames = document['frames']
    if document['status'] != Status.SOLVED.value:
        for key in ('frames', 'segments'):
            if document[key]:
                yield (
                    key,
                    f'{len(document[key])} entries',
                    f'none, as status is {document["status"]!r}',
                )
        return
    if not frames:
        yield 'frames', 'none', "at least one frame, as status is 'solved'"
        return
    names = document['joint_names']
    for k, frame in enumerate(frames):
        for key in JOINT_LISTS:
            if key in frame and len(frame[key]) != len(names):
                yield (
                    f'frames[{k}].{key}',
                    f'{len(frame[key])} entries',
                    f'{len(names)} entries, one per joint of joint_names',
                )
        if k > 0 and not not_finite and frame['time'] <= frames[k - 1]['time']:
            yield (
                f'frames[{k}].time',
                f'{frame["time"]!r}',
                f'more than {frames[k - 1]["time"]!r} s, the time of the frame before',
            )
    yield from _segment_complaints(document['segments'], len(frames), names)


def _segment_complaints(
    segments: list[dict[str, Any]], frame_count: int, joint_names: list[str]
) -> Iterator[Complaint]:
    if not segments:
        yield 'segments', 'none', 'segments that cover all frames'
        return
    expected_first = 0
    for k, segment in enumerate(segments):
        first, last = segment['first_frame'], segment['last_frame']
        if first != expected_first:
            why = 'the first frame' if k == 0 else 'the frame shared with the segment before'
            yield f'segments[{k}].first_frame', str(first), f'{expected_first}, {why}'
        if last <= first and frame_count > 1:
            yield f'segments[{k}].last_frame', str(last), f'more than first_frame, {first}'
        if last >= frame_count:
            yield f'segments[{k}].last_frame', str(last), f'at most {frame_count - 1}'
        for name in segment.get('control', {}):
            if name not in joint_names:
                yield f'segments[{k}].control', repr(name), 'names of joint_names'
        expected_first = last
    if expected_first < frame_count - 1:
        yield (
            f'segments[{len(segments) - 1}].last_frame',
            str(expected_first),
            f'{frame_count - 1}, as segments cover all frames',
        )


def _non_finite(value: Any, where: str) -> Iterator[Complaint]:
    if isinstance(value, (int, float)) and not abs(value) <= sys.float_info.max:
        yield where, _short(value), 'a finite number (null where a torque is unbounded)'
    elif isinstance(value, dict):
        for key, entry in value.items():
            yield from _non_finite(entry, f'{where}.{key}' if where else key)
    elif isinstance(value, list):
        for k, entry in enumerate(value):
            yield from _non_finite(entry, f'{where}[{k}]')


def _short(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 60 else text[:57] + '...'
