from __future__ import annotations

import json
import math
import os
import stat
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cfplan_core.errors import InvalidPlanError
from cfplan_core.trajectory.plan_file import read_plan, write_plan
from cfplan_core.trajectory.plan_result import PlanResult, Segment, Statistics, Status

FINITE = st.floats(allow_nan=False, allow_infinity=False)
ARRAYS = ('times', 'joints', 'object_poses', 'torque_lower', 'torque_upper')


@pytest.fixture
def result() -> PlanResult:
    return PlanResult(
        problem='small',
        status=Status.SOLVED,
        joint_names=('left', 'right'),
        times=np.array([0.0, 0.1, 0.30000000000000004, 0.4]),
        joints=np.array([[0.1, 1 / 3], [0.2, 2.0], [math.pi, 1e-17], [0.0, -0.5]]),
        object_poses=np.arange(12.0).reshape(4, 3) / 7.0,
        torque_lower=np.array([[-math.inf, 0.0], [-1.0, 0.0], [-0.1, 0.0], [0.0, 0.0]]),
        torque_upper=np.array([[0.0, math.inf], [0.0, 1.5], [0.0, 0.2], [0.3, 0.4]]),
        segments=(
            Segment(('object.v0|palm.0.e2', 'object.e1|left.tip.v1'), 'form_closure', 0, 1),
            Segment(('object.v0|palm.0.e2',), 'force_closure', 1, 3),
        ),
        statistics=Statistics(0.08, 9, 7, 12, 30, {'unstable': 11, 'jammed': 2}),
    )


@pytest.fixture
def spoil(result: PlanResult, tmp_path: Path) -> Callable[[Callable[[Any], object]], str]:
    """Write a good plan, change its JSON, and return what reading it complains of."""

    def spoiled(change: Callable[[Any], object]) -> str:
        path = tmp_path / 'plan.json'
        write_plan(result, path)
        document = json.loads(path.read_text(encoding='utf-8'))
        change(document)
        path.write_text(json.dumps(document), encoding='utf-8')
        with pytest.raises(InvalidPlanError) as caught:
            read_plan(path)
        return str(caught.value).replace(str(path), 'plan.json')

    return spoiled


def equal(one: PlanResult, other: PlanResult) -> bool:
    same_arrays = all(np.array_equal(getattr(one, a), getattr(other, a)) for a in ARRAYS)
    names = ('problem', 'status', 'message', 'joint_names', 'segments', 'statistics')
    return same_arrays and all(getattr(one, a) == getattr(other, a) for a in names)


def test_plan_reads_back_as_written(result: PlanResult, tmp_path: Path) -> None:
    write_plan(result, tmp_path / 'plan.json')
    assert equal(read_plan(tmp_path / 'plan.json'), result)


@settings(max_examples=25, deadline=None)
@given(
    values=st.lists(FINITE, min_size=10, max_size=10),
    lower=st.floats(allow_nan=False, max_value=1e300),
    upper=st.floats(allow_nan=False, min_value=-1e300),
)
def test_every_finite_number_reads_back_exactly(
    tmp_path_factory: pytest.TempPathFactory, values: list[float], lower: float, upper: float
) -> None:
    path = tmp_path_factory.mktemp('plan') / 'plan.json'
    plan = PlanResult(
        problem='any',
        status=Status.SOLVED,
        joint_names=('j',),
        times=np.array([0.0, abs(values[0]) + 1.0]),
        joints=np.array(values[1:3]).reshape(2, 1),
        object_poses=np.array(values[3:9]).reshape(2, 3),
        torque_lower=np.array([[lower], [0.0]]),
        torque_upper=np.array([[upper], [0.0]]),
        segments=(Segment(('object.v0|palm.0.e0',), 'second_order', 0, 1),),
    )
    write_plan(plan, path)
    assert equal(read_plan(path), plan)


def test_file_has_the_keys_of_the_format_in_its_order(result: PlanResult, tmp_path: Path) -> None:
    write_plan(result, tmp_path / 'plan.json')
    document = json.loads((tmp_path / 'plan.json').read_text(encoding='utf-8'))
    assert list(document) == [
        'format',
        'problem',
        'status',
        'message',
        'joint_names',
        'frames',
        'segments',
        'statistics',
    ]
    frame_keys = ['time', 'joints', 'object_pose', 'torque_lower', 'torque_upper']
    assert [list(frame) for frame in document['frames']] == [frame_keys] * 4
    segment_keys = ['contacts', 'stability', 'first_frame', 'last_frame']
    assert [list(segment) for segment in document['segments']] == [segment_keys] * 2


def test_nominal_torques_read_back_as_written(result: PlanResult, tmp_path: Path) -> None:
    planned = replace(result, torque_nominal=np.arange(8.0).reshape(4, 2) / 7.0)
    write_plan(planned, tmp_path / 'plan.json')
    back = read_plan(tmp_path / 'plan.json')
    np.testing.assert_array_equal(back.torque_nominal, planned.torque_nominal)
    assert equal(back, result)


def test_a_plan_without_nominal_torques_reads_back_without(
    result: PlanResult, tmp_path: Path
) -> None:
    write_plan(result, tmp_path / 'plan.json')
    assert read_plan(tmp_path / 'plan.json').torque_nominal.shape == (0, 0)


def test_unbounded_torque_is_null(result: PlanResult, tmp_path: Path) -> None:
    write_plan(result, tmp_path / 'plan.json')
    frame = json.loads((tmp_path / 'plan.json').read_text(encoding='utf-8'))['frames'][0]
    assert (frame['torque_lower'], frame['torque_upper']) == ([None, 0.0], [0.0, None])


def test_same_result_gives_the_same_bytes(result: PlanResult, tmp_path: Path) -> None:
    for name in ('one', 'other'):
        write_plan(result, tmp_path / name)
    assert (tmp_path / 'one').read_bytes() == (tmp_path / 'other').read_bytes()


def test_minimal_statistics_are_enough(result: PlanResult, tmp_path: Path) -> None:
    path = tmp_path / 'plan.json'
    write_plan(result, path)
    document = json.loads(path.read_text(encoding='utf-8'))
    for key in ('formations', 'transitions', 'failures'):
        del document['statistics'][key]
    path.write_text(json.dumps(document), encoding='utf-8')
    assert read_plan(path).statistics == Statistics(0.08, 9, 7)


def test_planned_torque_and_control_are_part_of_the_format(
    result: PlanResult, tmp_path: Path
) -> None:
    path = tmp_path / 'plan.json'
    write_plan(result, path)
    document = json.loads(path.read_text(encoding='utf-8'))
    document['frames'][0]['torque_nominal'] = [0.0, 0.1]
    document['segments'][0]['control'] = {'left': 'position', 'right': 'effort'}
    path.write_text(json.dumps(document), encoding='utf-8')
    control = {'left': 'position', 'right': 'effort'}
    first = replace(result.segments[0], control=control)
    kept = replace(result, segments=(first, *result.segments[1:]))
    assert equal(read_plan(path), kept)
    write_plan(kept, path)
    assert equal(read_plan(path), kept)
    (end, *_) = (s.get('end') for s in json.loads(path.read_text(encoding='utf-8'))['segments'])
    assert end == {'event': 'contacts', 'made': [], 'broken': ['object.e1|left.tip.v1']}


@pytest.mark.parametrize('status', [s for s in Status if s is not Status.SOLVED])
def test_plan_that_is_not_solved_reads_back(status: Status, tmp_path: Path) -> None:
    plan = PlanResult('p', status, ('left',), message='10 µN short: «no»')
    write_plan(plan, tmp_path / 'plan.json')
    back = read_plan(tmp_path / 'plan.json')
    assert (back.status, back.message, back.solved) == (status, plan.message, False)
    assert [len(getattr(back, name)) for name in ARRAYS] == [0] * 5


def test_undecodable_file_name_in_a_message_reads_back(tmp_path: Path) -> None:
    plan = PlanResult('p', Status.INVALID, (), message='file \udcff.yaml')
    write_plan(plan, tmp_path / 'plan.json')
    assert read_plan(tmp_path / 'plan.json').message == plan.message


@pytest.mark.parametrize('array', ARRAYS)
@pytest.mark.parametrize('value', [math.nan, math.inf])
def test_number_that_is_not_finite_is_not_written(
    result: PlanResult, tmp_path: Path, array: str, value: float
) -> None:
    if (array, value) == ('torque_upper', math.inf):
        value = -math.inf
    values = getattr(result, array).copy()
    values[(1,) if array == 'times' else (1, 0)] = value
    with pytest.raises(InvalidPlanError, match=r'frames\[1\].*expected a finite number'):
        write_plan(replace(result, **{array: values}), tmp_path / 'plan.json')
    assert list(tmp_path.iterdir()) == []


def test_result_with_missing_rows_is_not_written(result: PlanResult, tmp_path: Path) -> None:
    short = replace(result, torque_lower=result.torque_lower[:-1])
    with pytest.raises(InvalidPlanError, match='torque_lower: got 3 rows, expected 4 rows'):
        write_plan(short, tmp_path / 'plan.json')


def test_refused_result_leaves_the_old_file(result: PlanResult, tmp_path: Path) -> None:
    path = tmp_path / 'plan.json'
    write_plan(result, path)
    before = path.read_bytes()
    with pytest.raises(InvalidPlanError):
        write_plan(replace(result, segments=result.segments[:1]), path)
    assert path.read_bytes() == before


def test_failed_write_leaves_the_old_file_and_nothing_else(
    result: PlanResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / 'plan.json'
    path.write_text('old', encoding='utf-8')

    def full(_: int) -> None:
        raise OSError(28, 'No space left on device')

    monkeypatch.setattr(os, 'fsync', full)
    with pytest.raises(OSError, match='No space left'):
        write_plan(result, path)
    assert path.read_text(encoding='utf-8') == 'old'
    assert list(tmp_path.iterdir()) == [path]


def test_file_has_the_permissions_of_the_umask(result: PlanResult, tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        write_plan(result, tmp_path / 'plan.json')
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / 'plan.json').stat().st_mode) == 0o640


def test_link_to_a_file_stays_a_link(result: PlanResult, tmp_path: Path) -> None:
    (tmp_path / 'real.json').write_text('old', encoding='utf-8')
    (tmp_path / 'link.json').symlink_to('real.json')
    write_plan(result, tmp_path / 'link.json')
    assert (tmp_path / 'link.json').is_symlink()
    assert equal(read_plan(tmp_path / 'real.json'), result)


def test_pipe_takes_the_text_and_stays_a_pipe(result: PlanResult, tmp_path: Path) -> None:
    write_plan(result, tmp_path / 'plan.json')
    os.mkfifo(tmp_path / 'pipe')
    reader = os.open(tmp_path / 'pipe', os.O_RDONLY | os.O_NONBLOCK)
    write_plan(result, tmp_path / 'pipe')
    assert os.read(reader, 1 << 16) == (tmp_path / 'plan.json').read_bytes()
    os.close(reader)
    assert stat.S_ISFIFO((tmp_path / 'pipe').stat().st_mode)


def test_directory_that_does_not_exist_is_an_os_error(result: PlanResult, tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        write_plan(result, tmp_path / 'none' / 'plan.json')


def set_at(*where: Any, to: Any) -> Callable[[Any], None]:
    def change(document: Any) -> None:
        for key in where[:-1]:
            document = document[key]
        document[where[-1]] = to

    return change


def drop_at(*where: Any) -> Callable[[Any], None]:
    def change(document: Any) -> None:
        for key in where[:-1]:
            document = document[key]
        del document[where[-1]]

    return change


@pytest.mark.parametrize(
    ('change', 'complaint'),
    [
        (set_at('format', to='cfplan/plan/2'), 'format: got "cfplan/plan/2", expected the format'),
        (set_at('status', to='done'), 'status: got "done", expected one of \'solved\''),
        (set_at('message', to=None), 'message: got null, expected why'),
        (drop_at('problem'), '(top level): got no problem, expected the keys format'),
        (set_at('extra', to=1), '(top level): got unknown extra, expected only format'),
        (
            set_at('joint_names', to=['left', 'left']),
            'joint_names: got ["left", "left"], expected',
        ),
        (set_at('frames', to={}), 'frames: got {}, expected a list of frames'),
        (set_at('frames', to=[]), 'frames: got none, expected at least one frame, as status is'),
        (set_at('frames', 2, 'time', to='0.3'), 'frames[2].time: got "0.3", expected a time in s'),
        (set_at('frames', 2, 'time', to=True), 'frames[2].time: got true, expected a time in s'),
        (set_at('frames', 2, 'time', to=0.1), 'frames[2].time: got 0.1, expected more than 0.1 s'),
        (set_at('frames', 2, 'time', to=0.05), 'frames[2].time: got 0.05, expected more than'),
        (set_at('frames', 0, 'time', to=-1.0), 'frames[0].time: got -1.0, expected a time in s'),
        (set_at('frames', 1, 'time', to=math.nan), 'frames[1].time: got NaN, expected a finite'),
        (set_at('frames', 1, 'joints', 0, to=math.inf), 'frames[1].joints[0]: got Infinity, exp'),
        (set_at('frames', 1, 'joints', 0, to=10**400), 'frames[1].joints[0]: got 1000000'),
        (set_at('frames', 1, 'joints', to=[0.1]), 'frames[1].joints: got 1 entries, expected 2'),
        (set_at('frames', 1, 'torque_lower', to=[]), 'frames[1].torque_lower: got 0 entries, exp'),
        (set_at('frames', 1, 'torque_upper', to=[0.0] * 3), 'frames[1].torque_upper: got 3 entri'),
        (set_at('frames', 1, 'torque_nominal', to=[0.0]), 'frames[1].torque_nominal: got 1 entri'),
        (set_at('frames', 1, 'joints', 0, to=None), 'frames[1].joints[0]: got null, expected an'),
        (set_at('frames', 1, 'object_pose', to=[0.0, 0.0]), 'frames[1].object_pose: got [0.0, 0.'),
        (drop_at('frames', 1, 'torque_lower'), 'frames[1]: got no torque_lower, expected the key'),
        (set_at('frames', 1, 'pose', to=0), 'frames[1]: got unknown pose, expected only time'),
        (set_at('segments', to=[]), 'segments: got none, expected segments that cover all frames'),
        (set_at('segments', 0, 'contacts', to=[]), 'segments[0].contacts: got [], expected a lis'),
        (
            set_at('segments', 0, 'contacts', 0, to='v0 on palm'),
            'segments[0].contacts[0]: got "v0 on palm", expected an elemental contact',
        ),
        (
            set_at('segments', 0, 'contacts', 0, to='object.v0|palm.0.v1'),
            'segments[0].contacts[0]: got "object.v0|palm.0.v1", expected an elemental contact',
        ),
        (
            set_at('segments', 1, 'stability', to='stable'),
            'segments[1].stability: got "stable", expected one of \'form_closure\'',
        ),
        (
            set_at('segments', 0, 'first_frame', to=1),
            'segments[0].first_frame: got 1, expected 0, the first frame',
        ),
        (
            set_at('segments', 1, 'first_frame', to=2),
            'segments[1].first_frame: got 2, expected 1, the frame shared with the segment before',
        ),
        (
            set_at('segments', 1, 'first_frame', to=1.5),
            'segments[1].first_frame: got 1.5, expected the index of a frame',
        ),
        (
            set_at('segments', 1, 'last_frame', to=2),
            'segments[1].last_frame: got 2, expected 3, as segments cover all frames',
        ),
        (
            set_at('segments', 1, 'last_frame', to=4),
            'segments[1].last_frame: got 4, expected at most 3',
        ),
        (
            set_at('segments', 1, 'last_frame', to=1),
            'segments[1].last_frame: got 1, expected more than first_frame, 1',
        ),
        (
            set_at('segments', 1, 'control', to={'left': 'velocity'}),
            "segments[1].control.left: got \"velocity\", expected 'position' or 'effort'",
        ),
        (
            set_at('segments', 1, 'control', to={'thumb': 'effort'}),
            "segments[1].control: got 'thumb', expected names of joint_names",
        ),
        (
            set_at('statistics', 'planning_time', to=-1.0),
            'statistics.planning_time: got -1.0, expected a duration in s',
        ),
        (
            set_at('status', to='infeasible'),
            "frames: got 4 entries, expected none, as status is 'infeasible'",
        ),
    ],
)
def test_malformed_plan_is_refused_with_field_value_and_expectation(
    spoil: Callable[[Callable[[Any], object]], str],
    change: Callable[[Any], object],
    complaint: str,
) -> None:
    assert f'plan.json: {complaint}' in spoil(change)


def test_everything_wrong_is_named_at_once(
    spoil: Callable[[Callable[[Any], object]], str],
) -> None:
    def change(document: Any) -> None:
        document['frames'][1]['joints'] = []
        document['frames'][2]['time'] = 0.0
        document['segments'][1]['last_frame'] = 2

    assert len(spoil(change).splitlines()) == 3


def test_long_list_of_mistakes_is_cut(spoil: Callable[[Callable[[Any], object]], str]) -> None:
    def change(document: Any) -> None:
        document['joint_names'] = [f'j{k}' for k in range(30)]
        document['frames'] = document['frames'] * 10

    lines = spoil(change).splitlines()
    assert len(lines) == 21
    assert lines[-1].startswith('plan.json: and ')


@pytest.mark.parametrize(
    ('content', 'complaint'),
    [
        (b'', 'line 1, column 1, expected JSON text'),
        (b'{"format": "cfplan/plan/1",}', 'expected JSON text'),
        (b'\xff\xfe{}', 'expected JSON text in UTF-8'),
        (b'[1, 2]', '(top level): got [1, 2], expected a plan, a mapping'),
        (b'{"format": 1, "format": 2}', 'format: got the same key twice, expected every key once'),
        (b'[' * 100_000, 'expected a plan in JSON'),
        (b'{"a": ' + b'9' * 5000 + b'}', 'expected a plan in JSON'),
    ],
    ids=['empty', 'comma', 'encoding', 'list', 'twice', 'nested', 'digits'],
)
def test_file_that_is_not_a_plan_is_refused(
    tmp_path: Path, content: bytes, complaint: str
) -> None:
    (tmp_path / 'plan.json').write_bytes(content)
    with pytest.raises(InvalidPlanError) as caught:
        read_plan(tmp_path / 'plan.json')
    assert complaint in str(caught.value)


def test_file_that_does_not_exist_is_named(tmp_path: Path) -> None:
    with pytest.raises(InvalidPlanError, match=r'none\.json: no such file or directory$'):
        read_plan(tmp_path / 'none.json')


def test_everything_missing_is_named_once(tmp_path: Path) -> None:
    (tmp_path / 'plan.json').write_text('{}', encoding='utf-8')
    with pytest.raises(InvalidPlanError) as caught:
        read_plan(tmp_path / 'plan.json')
    assert len(str(caught.value).splitlines()) == 1


def test_directory_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidPlanError, match='is a directory'):
        read_plan(tmp_path)
