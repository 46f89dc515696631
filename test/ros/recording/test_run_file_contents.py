"""A run file, as independent readers see it."""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from mcap.reader import make_reader
from rclpy.serialization import deserialize_message, serialize_message
from ros.recording.example import NODE, STAMP, START, example, recorder
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability

from cfplan_ros.recording.topics import ESSENTIAL, LATCHED, PREVIEW

GOLDEN = Path(__file__).parents[1] / 'golden' / 'rosbag2_jazzy.mcap'
READER = Path(__file__).parents[1] / 'readers'
NPM_PATIENCE = 300
_TOPICS = {topic.full_name(NODE): topic for topic in (*ESSENTIAL, *PREVIEW)}


@pytest.fixture(scope='module')
def run_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp('runs')
    run = example().begin(recorder(directory))
    assert example().answer(run) == ''
    example().play(run)
    assert run.close() == ''
    return directory / run.name


@pytest.fixture(scope='module')
def sent() -> list[tuple[str, int, Any]]:
    """What the planner recorded, in its order."""
    e = example()
    answered = [('plan/response', e.response), *e.essentials]
    messages = [('plan/request', START, e.request)]
    messages += [(topic, STAMP, message) for topic, message in answered]
    messages += [(topic, time, message) for time, topic, message in e.preview()]
    return [
        (t if t.startswith('/') else f'{NODE}/{t.removeprefix("~/")}', time, message)
        for t, time, message in messages
    ]


def _summary(path: Path) -> Any:
    with path.open('rb') as file:
        return make_reader(file).get_summary()


def test_rosbags_reads_every_message_as_it_was_recorded(
    run_file: Path, sent: list[tuple[str, int, Any]]
) -> None:
    with AnyReader([run_file]) as reader:
        read = [
            (connection.topic, time, connection.msgtype, bytes(data))
            for connection, time, data in reader.messages()
        ]
    expected = [
        (topic, time, _schema_name(topic), serialize_message(message))
        for topic, time, message in sent
    ]
    assert sorted(read) == sorted(expected)


def _schema_name(topic: str) -> str:
    message_class = _TOPICS[topic].message_class
    return f'{message_class.__module__.split(".")[0]}/msg/{message_class.__name__}'


def test_rosbags_decodes_the_trajectory_of_the_response(run_file: Path) -> None:
    decoded = {}
    with AnyReader([run_file]) as reader:
        for connection, _, data in reader.messages():
            decoded[connection.topic] = reader.deserialize(data, connection.msgtype)
    response = decoded[f'{NODE}/plan/response']
    trajectory = decoded[f'{NODE}/joint_trajectory']
    positions = np.array([point.positions for point in trajectory.points])
    assert np.array_equal(positions, example().result.joints)
    answered = np.array([p.positions for p in response.plan.joint_trajectory.points])
    assert np.array_equal(answered, positions)


def test_channels_have_the_keys_of_rosbag2(run_file: Path) -> None:
    golden = {tuple(c.metadata) for c in _summary(GOLDEN).channels.values()}
    assert {tuple(c.metadata) for c in _summary(run_file).channels.values()} == golden


def test_profiles_have_the_layout_of_rosbag2(run_file: Path) -> None:
    (golden, *_) = _summary(GOLDEN).channels.values()
    (expected,) = yaml.safe_load(golden.metadata['offered_qos_profiles'])
    for channel in _summary(run_file).channels.values():
        (profile,) = yaml.safe_load(channel.metadata['offered_qos_profiles'])
        assert list(profile) == list(expected)
        assert profile['deadline'] == expected['deadline']


def test_schemas_are_named_and_encoded_as_rosbag2_does(run_file: Path) -> None:
    schemas = _summary(run_file).schemas.values()
    assert {schema.encoding for schema in schemas} == {
        schema.encoding for schema in _summary(GOLDEN).schemas.values()
    }
    assert {schema.name for schema in schemas} == {_schema_name(topic) for topic in _TOPICS}


def test_every_topic_has_one_channel_with_a_schema(run_file: Path) -> None:
    summary = _summary(run_file)
    topics = [channel.topic for channel in summary.channels.values()]
    assert sorted(topics) == sorted(_TOPICS)
    assert all(channel.schema_id in summary.schemas for channel in summary.channels.values())


def test_rosbags_sees_latched_topics_as_latched_and_no_others(run_file: Path) -> None:
    with AnyReader([run_file]) as reader:
        latched = {
            connection.topic
            for connection in reader.connections
            for qos in connection.ext.offered_qos_profiles
            if qos.durability is QosDurability.TRANSIENT_LOCAL
        }
    assert latched == {topic for topic, t in _TOPICS.items() if t.qos is LATCHED}


def test_times_never_decrease_in_the_order_of_the_file(run_file: Path) -> None:
    with run_file.open('rb') as file:
        times = [m.log_time for _, _, m in make_reader(file).iter_messages(log_time_order=False)]
    assert times == sorted(times)
    assert times[0] == START


def test_log_time_is_the_stamp(run_file: Path) -> None:
    with AnyReader([run_file]) as reader:
        for connection, time, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            for stamp in _stamps(message):
                assert stamp.sec * 10**9 + stamp.nanosec == time


def _stamps(message: Any) -> list[Any]:
    if hasattr(message, 'header'):
        return [message.header.stamp]
    for several in ('transforms', 'markers'):
        if hasattr(message, several):
            return [each.header.stamp for each in getattr(message, several)]
    # A request has no stamp; a response has that of its plan.
    return [message.plan.header.stamp] if hasattr(message, 'plan') else []


def test_chunks_are_compressed_and_have_checksums(run_file: Path) -> None:
    from mcap.records import Chunk
    from mcap.stream_reader import StreamReader

    with run_file.open('rb') as file:
        records = list(StreamReader(file, emit_chunks=True, validate_crcs=True).records)
    chunks = [record for record in records if isinstance(record, Chunk)]
    assert {chunk.compression for chunk in chunks} == {'zstd'}
    assert all(chunk.uncompressed_crc for chunk in chunks)


def test_metadata_is_cfplans_and_never_rosbag2s(run_file: Path) -> None:
    with run_file.open('rb') as file:
        (record,) = make_reader(file).iter_metadata()
    assert record.name == 'cfplan'
    assert json.loads(record.metadata['options']) == {'time_budget': 10.0}
    assert {'version', 'git_commit', 'problem', 'parameters', 'node'} <= record.metadata.keys()


def test_recorded_problem_gives_the_recorded_plan(run_file: Path) -> None:
    from cfplan_core import plan
    from cfplan_core.model.loading import problem_from_mapping

    with run_file.open('rb') as file:
        (record,) = make_reader(file).iter_metadata()
    problem = problem_from_mapping(json.loads(record.metadata['problem'])).problem
    assert problem is not None
    assert np.array_equal(plan(problem).joints, example().result.joints)


@pytest.fixture(scope='module')
def foxglove(run_file: Path, tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, Any]]:
    """The file as Foxglove's libraries read it."""
    node, npm = shutil.which('node'), shutil.which('npm')
    if node is None or npm is None:
        pytest.skip('node and npm are not installed: the file is not read by @mcap/core')
    script = _installed(npm) / 'read_run.mjs'
    output = subprocess.run(
        [node, str(script), str(run_file)], capture_output=True, text=True, timeout=60, check=False
    )
    assert output.returncode == 0, output.stderr
    return [json.loads(line) for line in output.stdout.splitlines()]


def _installed(npm: str) -> Path:
    """Install the reader's packages once, in a folder that git ignores."""
    target = READER / '.installed'
    wanted = {name: (READER / name).read_bytes() for name in ('package.json', 'read_run.mjs')}
    if target.is_dir() and all((target / n).read_bytes() == data for n, data in wanted.items()):
        return target
    fresh = READER / f'.installed-{os.getpid()}'
    fresh.mkdir()
    (fresh / '.gitignore').write_text('*\n')
    for name, data in wanted.items():
        (fresh / name).write_bytes(data)
    options = ['--no-package-lock', '--no-audit', '--no-fund', '--ignore-scripts']
    output = subprocess.run(
        [npm, 'install', *options],
        cwd=fresh,
        capture_output=True,
        text=True,
        timeout=NPM_PATIENCE,
        check=False,
    )
    assert output.returncode == 0, output.stderr
    shutil.rmtree(target, ignore_errors=True)
    fresh.rename(target)
    return target


def test_foxglove_reads_every_message_in_the_order_of_time(
    foxglove: list[dict[str, Any]], sent: list[tuple[str, int, Any]]
) -> None:
    read = [(record['topic'], int(record['logTime'])) for record in foxglove[1:]]
    assert sorted(read) == sorted((topic, time) for topic, time, _ in sent)
    assert [time for _, time in read] == sorted(time for _, time in read)


def test_foxglove_sees_the_channels_as_recorded(foxglove: list[dict[str, Any]]) -> None:
    assert foxglove[0]['header']['profile'] == 'ros2'
    channels = {channel['topic']: channel for channel in foxglove[0]['channels']}
    assert channels.keys() == _TOPICS.keys()
    for topic, channel in channels.items():
        assert channel['schema'] == _schema_name(topic)
        assert (channel['messageEncoding'], channel['schemaEncoding']) == ('cdr', 'ros2msg')
        assert channel['metadata'].keys() == {'offered_qos_profiles', 'topic_type_hash'}


def test_foxglove_decodes_every_message_as_it_was_recorded(
    foxglove: list[dict[str, Any]], sent: list[tuple[str, int, Any]]
) -> None:
    read = {
        (record['topic'], int(record['logTime'])): record['message'] for record in foxglove[1:]
    }
    for topic, time, message in sent:
        # Through its serialization, as floats of 32 bits lose digits there.
        stored = deserialize_message(serialize_message(message), type(message))
        assert read[topic, time] == _plain(stored)


def _plain(message: Any) -> Any:
    """A message as the script prints it."""
    if hasattr(message, 'get_fields_and_field_types'):
        fields = message.get_fields_and_field_types()
        return {name: _plain(getattr(message, name)) for name in fields}
    if isinstance(message, (bytes, str, bool)):
        return message
    if isinstance(message, float) and not math.isfinite(message):
        return str(message).replace('inf', 'Infinity')
    if hasattr(message, 'tolist'):
        message = message.tolist()
    return [_plain(each) for each in message] if isinstance(message, list) else message
