"""Checks of a plan's form: names, array shapes, time, segments. The others rest on them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cfplan_core.trajectory.plan_result import PlanResult
from cfplan_core.verification.mechanism import Mechanism
from cfplan_core.verification.report import Recorder
from cfplan_core.verification.touching import Pair, parse_pair

CLASSES = ('form_closure', 'force_closure', 'second_order')


@dataclass(frozen=True)
class Stretch:
    """A segment whose contacts are resolved.

    Attributes:
        number: Of the segment in the plan, counted from 1 as in tables and figures.
        contacts: What touches in it.
        stability: The class that it claims.
        first: Its first frame.
        last: Its last frame.
    """

    number: int
    contacts: tuple[Pair, ...]
    stability: str
    first: int
    last: int


def check_structure(
    mechanism: Mechanism, result: PlanResult, record: Recorder
) -> tuple[Stretch, ...] | None:
    """Check form and names.

    Returns:
        The segments, or None if the plan is too malformed to check anything else.
    """
    if not record.require(
        'solved',
        result.solved,
        None,
        f'status is {result.status.value!r}, expected a solved plan',
    ):
        return None
    problem = mechanism.problem
    record.require(
        'names',
        result.problem == problem.name,
        None,
        f'the plan is for problem {result.problem!r}, expected {problem.name!r}',
    )
    names = problem.hand.joint_names
    same_joints = record.require(
        'names',
        result.joint_names == names,
        None,
        f'joint names are {result.joint_names}, expected {names}',
    )
    if not (same_joints and _check_arrays(result, len(names), record)):
        return None
    for frame, (before, after) in enumerate(pairwise(result.times.tolist()), start=1):
        message = f'time goes from {before!r} to {after!r} s, expected an increase'
        record.require('time', after > before, frame, message)
    covered = _check_segments(result, record)
    stretches = _resolve(mechanism, result, record)
    if not covered or stretches is None or np.any(np.diff(result.times) <= 0.0):
        return None
    return stretches


def _check_arrays(result: PlanResult, joints: int, record: Recorder) -> bool:
    frames = len(result.times)
    fits = record.require('arrays', frames > 0, None, 'the plan has no frames')
    for name, width in (
        ('times', None),
        ('joints', joints),
        ('object_poses', 3),
        ('torque_lower', joints),
        ('torque_upper', joints),
        ('torque_nominal', joints),
    ):
        array = getattr(result, name)
        if name == 'torque_nominal' and not len(array):
            continue
        shape = (frames,) if width is None else (frames, width)
        if not record.require(
            'arrays',
            array.shape == shape,
            None,
            f'{name} has shape {array.shape}, expected {shape}',
        ):
            fits = False
            continue
        unbounded = {'torque_lower': -np.inf, 'torque_upper': np.inf}.get(name)
        good = np.isfinite(array) | (array == unbounded) if unbounded else np.isfinite(array)
        for frame in range(frames):
            holds = bool(np.all(good[frame]))
            fits &= record.require(
                'arrays', holds, frame, f'{name} is {array[frame]}, expected finite numbers'
            )
    return fits


def _check_segments(result: PlanResult, record: Recorder) -> bool:
    last_frame = len(result.times) - 1
    holds = record.require(
        'segments', bool(result.segments), None, 'the plan has no segments, expected some'
    )
    expected = 0
    for k, segment in enumerate(result.segments, start=1):
        first, last = segment.first_frame, segment.last_frame
        holds &= record.require(
            'segments',
            first == expected,
            None,
            f'segment {k} begins at frame {first}, expected {expected}',
        )
        holds &= record.require(
            'segments',
            first < last <= last_frame or first == last == last_frame == 0,
            None,
            f'segment {k} has frames {first} to {last}, expected more than one of 0 to '
            f'{last_frame}',
        )
        expected = last
    holds &= record.require(
        'segments',
        expected == last_frame,
        None,
        f'segments end at frame {expected}, expected {last_frame}',
    )
    return holds


def _resolve(
    mechanism: Mechanism, result: PlanResult, record: Recorder
) -> tuple[Stretch, ...] | None:
    stretches: list[Stretch] = []
    holds = True
    for k, segment in enumerate(result.segments, start=1):
        holds &= record.require(
            'stability_class',
            segment.stability in CLASSES,
            segment.first_frame,
            f'segment {k} claims {segment.stability!r}, expected one of {CLASSES}',
        )
        pairs: list[Pair] = []
        for name in segment.contacts:
            try:
                pair = parse_pair(name, mechanism)
                message = f'segment {k} names {name!r} twice, expected it once'
                new = pair not in pairs
            except ValueError as error:
                new, message = False, f'segment {k}: {error}'
            if record.require('names', new, segment.first_frame, message):
                pairs.append(pair)
            else:
                holds = False
        holds &= record.require(
            'names',
            bool(segment.contacts),
            segment.first_frame,
            f'segment {k} names no contacts, expected some',
        )
        stretches.append(
            Stretch(k, tuple(pairs), segment.stability, segment.first_frame, segment.last_frame)
        )
    return tuple(stretches) if holds else None
