"""Plan files, format ``cfplan/plan/1``: a plan written whole, and read back or refused."""

from __future__ import annotations

import json
import math
import os
import secrets
from pathlib import Path
from typing import Any

import numpy as np

from cfplan_core.errors import Finding, InvalidPlanError
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.trajectory.plan_format import FORMAT, refuse_malformed
from cfplan_core.trajectory.plan_result import PlanResult, Segment, Statistics, Status
from cfplan_core.trajectory.segment_ends import SegmentEnd, segment_ends

Document = dict[str, Any]


def write_plan(result: PlanResult, path: str | os.PathLike[str]) -> None:
    """Write a plan file; an existing file is replaced at once or not at all.

    The same result gives the same bytes. The search trees of the result are not in the file.

    Args:
        result: The plan; infinite torque limits become null.
        path: Where to. Its directory must exist.

    Raises:
        InvalidPlanError: The result is not one that `read_plan` would take back.
        OSError: The file cannot be written.
    """
    name = os.fspath(path)
    document = _document(result, name)
    refuse_malformed(document, name)
    _put_in_place(Path(name), _text(document))


def read_plan(path: str | os.PathLike[str]) -> PlanResult:
    """Read a plan file.

    ``torque_nominal`` is checked and not kept if only some frames have it.

    Args:
        path: A file of the format ``cfplan/plan/1``.

    Returns:
        The plan, with null torque limits as infinities and without trees.

    Raises:
        InvalidPlanError: The file cannot be read or is not a plan; says file, field, value and
            what was expected, for everything that is wrong.
    """
    name = os.fspath(path)
    document = _parse(name)
    refuse_malformed(document, name)
    return _result(document)


def _parse(name: str) -> Any:
    def unique(pairs: list[tuple[str, Any]]) -> Document:
        mapping = dict(pairs)
        if len(mapping) < len(pairs):
            keys = [key for key, _ in pairs]
            twice = next(key for key in keys if keys.count(key) > 1)
            raise _invalid(name, twice, 'the same key twice', 'every key once')
        return mapping

    try:
        with open(name, encoding='utf-8') as file:
            return json.load(file, object_pairs_hook=unique)
    except OSError as error:
        reason = error.strerror or str(error)
        raise _invalid(name, '', reason[:1].lower() + reason[1:], '') from None
    except UnicodeDecodeError:
        raise _invalid(name, '', 'bytes that are not UTF-8', 'JSON text in UTF-8') from None
    except json.JSONDecodeError as error:
        what = f'{error.msg} at line {error.lineno}, column {error.colno}'
        raise _invalid(name, '', what, 'JSON text') from None
    except (ValueError, RecursionError):
        raise _invalid(name, '', 'an oversized number or nesting', 'a plan in JSON') from None


def _result(document: Document) -> PlanResult:
    names, frames = document['joint_names'], document['frames']

    def column(key: str, width: int, null: float = math.nan) -> FloatArray:
        rows = [[null if entry is None else entry for entry in frame[key]] for frame in frames]
        return np.array(rows, dtype=np.float64).reshape(len(frames), width)

    planned = bool(frames) and all('torque_nominal' in frame for frame in frames)
    nominal = column('torque_nominal', len(names)) if planned else np.empty((0, 0))
    return PlanResult(
        problem=document['problem'],
        status=Status(document['status']),
        joint_names=tuple(names),
        message=document['message'],
        times=np.array([frame['time'] for frame in frames], dtype=np.float64),
        joints=column('joints', len(names)),
        object_poses=column('object_pose', 3),
        torque_lower=column('torque_lower', len(names), -math.inf),
        torque_upper=column('torque_upper', len(names), math.inf),
        torque_nominal=nominal,
        segments=tuple(
            Segment(
                contacts=tuple(segment['contacts']),
                stability=segment['stability'],
                first_frame=int(segment['first_frame']),
                last_frame=int(segment['last_frame']),
                needed_force=segment.get('needed_force'),
                control=segment.get('control'),
            )
            for segment in document['segments']
        ),
        statistics=_statistics(document['statistics']),
    )


def _statistics(document: Document) -> Statistics:
    return Statistics(
        planning_time=float(document['planning_time']),
        initial_tree_nodes=int(document['initial_tree_nodes']),
        goal_tree_nodes=int(document['goal_tree_nodes']),
        formations=int(document.get('formations', 0)),
        transitions=int(document.get('transitions', 0)),
        failures={reason: int(times) for reason, times in document.get('failures', {}).items()},
    )


def _document(result: PlanResult, name: str) -> Document:
    count = len(result.times)
    for key in ('joints', 'object_poses', 'torque_lower', 'torque_upper', 'torque_nominal'):
        rows = len(getattr(result, key))
        if rows != count and (rows or key != 'torque_nominal'):
            raise _invalid(name, key, f'{rows} rows', f'{count} rows, one per entry of times')

    def limits(row: FloatArray, unbounded: float) -> list[float | None]:
        return [None if value == unbounded else value for value in row.tolist()]

    nominal = len(result.torque_nominal) > 0
    statistics = result.statistics
    return {
        'format': FORMAT,
        'problem': result.problem,
        'status': result.status.value,
        'message': result.message,
        'joint_names': list(result.joint_names),
        'frames': [
            {
                'time': float(result.times[k]),
                'joints': result.joints[k].tolist(),
                'object_pose': result.object_poses[k].tolist(),
                'torque_lower': limits(result.torque_lower[k], -math.inf),
                'torque_upper': limits(result.torque_upper[k], math.inf),
                **({'torque_nominal': result.torque_nominal[k].tolist()} if nominal else {}),
            }
            for k in range(count)
        ],
        'segments': [
            _segment(segment, end)
            for segment, end in zip(result.segments, segment_ends(result.segments), strict=True)
        ],
        'statistics': {
            'planning_time': float(statistics.planning_time),
            'initial_tree_nodes': int(statistics.initial_tree_nodes),
            'goal_tree_nodes': int(statistics.goal_tree_nodes),
            'formations': int(statistics.formations),
            'transitions': int(statistics.transitions),
            'failures': {reason: int(times) for reason, times in statistics.failures.items()},
        },
    }


def _segment(segment: Segment, end: SegmentEnd) -> Document:
    document: Document = {
        'contacts': list(segment.contacts),
        'stability': segment.stability,
        'first_frame': int(segment.first_frame),
        'last_frame': int(segment.last_frame),
    }
    if segment.needed_force is not None:
        document['needed_force'] = float(segment.needed_force)
    if segment.control is not None:
        document['control'] = dict(segment.control)
        document['end'] = {
            'event': end.ending.value,
            'made': list(end.made),
            'broken': list(end.broken),
        }
    return document


def _text(document: Document) -> str:
    """JSON with one frame or segment a line, so that two plans can be compared by line."""

    def dump(value: Any) -> str:
        return json.dumps(value, ensure_ascii=False, allow_nan=False)

    entries = []
    for key, value in document.items():
        if key in ('frames', 'segments') and value:
            value_text = '[\n  ' + ',\n  '.join(dump(entry) for entry in value) + '\n ]'
        else:
            value_text = dump(value)
        entries.append(f'{dump(key)}: {value_text}')
    return '{\n ' + ',\n '.join(entries) + '\n}\n'


def _put_in_place(path: Path, text: str) -> None:
    # Lone surrogates (undecodable file names in a message) become JSON's own escapes.
    data = text.encode('utf-8', errors='backslashreplace')
    # A device or a pipe takes the text; replacing it by a file would destroy it.
    if path.exists() and not path.is_file() and not path.is_dir():
        path.write_bytes(data)
        return
    target = path.resolve()
    # Not tempfile: its files are readable by the owner alone, whatever the umask says.
    temporary = target.with_name(f'.{target.name}.{secrets.token_hex(4)}.tmp')
    try:
        with open(temporary, 'xb') as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, target)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def _invalid(name: str, field: str, value: str, expected: str) -> InvalidPlanError:
    return InvalidPlanError(str(Finding(name, field, value, expected)))
