"""Runs on disk, and disks that do not take them."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from mcap.reader import make_reader
from rclpy.serialization import deserialize_message
from ros.node.harness import Client, Code, Planner, eventually, story_request
from ros.node.slow_search import slow_hand_file, slow_request
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import MarkerArray

Start = Callable[..., Planner]


def runs(directory: Path) -> list[str]:
    return sorted(path.name for path in directory.glob('run_*'))


def test_answer_names_the_file_of_its_run(
    planner: Planner, client: Client, tmp_path: Path
) -> None:
    response = client.plan(story_request())
    file = tmp_path / 'runs' / response.record
    eventually(file.exists, f'{file} is not completed')
    with file.open('rb') as stream:
        (trajectory,) = (
            deserialize_message(message.data, JointTrajectory)
            for _, channel, message in make_reader(stream).iter_messages()
            if channel.topic == '/cfplan_planner/joint_trajectory'
        )
    assert trajectory == response.plan.joint_trajectory


def test_run_holds_request_answer_plan_markers_and_the_plan_played_in_time(
    planner: Planner, client: Client, tmp_path: Path
) -> None:
    response = client.plan(story_request())
    file = tmp_path / 'runs' / response.record
    eventually(file.exists, f'{file} is not completed')
    counts = message_counts(file)
    frames = len(response.plan.joint_trajectory.points)
    once = (
        'plan/request',
        'plan/response',
        'joint_trajectory',
        'torque_limits',
        'plan_result',
        'markers',
    )
    played = ('joint_states', 'object_pose', 'contact_markers', 'preview/torque_limits')
    assert counts == {
        **{f'/cfplan_planner/{topic}': 1 for topic in once},
        **{f'/cfplan_planner/{topic}': frames for topic in played},
        '/tf_static': 1,
        '/tf': frames,
    }


def test_run_holds_no_command_that_was_not_published(
    planner: Planner, client: Client, tmp_path: Path
) -> None:
    """Whoever plays the run to a controller must not move a hand that was not to be moved."""
    response = client.plan(story_request(plan_only=True))
    file = tmp_path / 'runs' / response.record
    eventually(file.exists, f'{file} is not completed')
    topics = set(message_counts(file))
    assert '/cfplan_planner/plan_result' in topics
    assert not topics & {'/cfplan_planner/joint_trajectory', '/cfplan_planner/torque_limits'}


def message_counts(file: Path) -> dict[str, int]:
    with file.open('rb') as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert summary.statistics is not None
    return {
        summary.channels[channel].topic: count
        for channel, count in summary.statistics.channel_message_counts.items()
    }


def test_request_without_plan_is_recorded_with_its_answer(
    planner: Planner, client: Client, tmp_path: Path
) -> None:
    request = story_request()
    request.object[0].mass = -1.0
    response = client.plan(request)
    file = tmp_path / 'runs' / response.record
    eventually(file.exists, f'{file} is not completed')
    assert message_counts(file) == {
        '/cfplan_planner/plan/request': 1,
        '/cfplan_planner/plan/response': 1,
    }


def test_nothing_is_recorded_when_recording_is_off(
    start_planner: Start, client: Client, tmp_path: Path
) -> None:
    start_planner(record=False)
    assert client.plan(story_request()).record == ''
    (result,) = client.set(record=True)
    assert result.successful
    assert client.plan(story_request()).record != ''
    assert len(runs(tmp_path / 'runs')) == 1


def test_directory_can_be_changed(planner: Planner, client: Client, tmp_path: Path) -> None:
    (result,) = client.set(record_directory=str(tmp_path / 'others'))
    assert result.successful, result.reason
    response = client.plan(story_request())
    eventually((tmp_path / 'others' / response.record).exists, 'not completed')


def test_canceled_run_is_recorded(start_planner: Start, client: Client, tmp_path: Path) -> None:
    planner = start_planner(hand_file=str(slow_hand_file(tmp_path)))
    pending = client.send_plan(slow_request())
    client.planner_state(lambda values: values['state'] == 'planning')
    planner.stop()
    response = pending.answer()
    assert response.error_code == Code.CANCELED
    assert message_counts(tmp_path / 'runs' / response.record) == {
        '/cfplan_planner/plan/request': 1,
        '/cfplan_planner/plan/response': 1,
    }


def test_markers_are_published_also_without_recording(
    start_planner: Start, client: Client
) -> None:
    start_planner(record=False)
    heard = client.listen(MarkerArray, 'markers')
    client.plan(story_request())
    assert heard.next().markers


# Disks that do not take a run.


def test_directory_that_is_gone_is_reported_and_the_plan_answered(
    start_planner: Start, client: Client, tmp_path: Path
) -> None:
    blocked = tmp_path / 'blocked'
    blocked.write_text('a file, not a directory', encoding='utf-8')
    start_planner(record_directory=str(blocked))
    plan_is_answered_published_and_reported(client, str(blocked))


@pytest.fixture
def full_disk(tmp_path: Path) -> Iterator[Path]:
    """A directory on a file system of its own with no block left."""
    directory = tmp_path / 'disk'
    directory.mkdir()
    mount = shutil.which('mount')
    if os.geteuid() != 0 or mount is None:
        pytest.skip('mounting a small file system takes root')
    options = ['-t', 'tmpfs', '-o', 'size=64k', 'tmpfs', str(directory)]
    if subprocess.run([mount, *options], capture_output=True, check=False).returncode != 0:
        pytest.skip('a small file system cannot be mounted here')
    (directory / 'ballast').write_bytes(bytes(56 * 1024))
    yield directory
    subprocess.run(['umount', str(directory)], check=True)


def test_full_disk_is_reported_and_the_plan_answered(
    start_planner: Start, client: Client, full_disk: Path
) -> None:
    planner = start_planner(record_directory=str(full_disk))
    plan_is_answered_published_and_reported(client, 'No space left on device')
    (full_disk / 'ballast').unlink()
    small = story_request()
    small.object[0].mass = -1.0
    assert client.plan(small).record != ''
    planner.stop()


def plan_is_answered_published_and_reported(client: Client, reason: str) -> None:
    heard = client.listen(JointTrajectory, 'joint_trajectory')
    response = client.plan(story_request())
    assert response.error_code == Code.NONE
    assert response.record == ''
    assert 'not recorded' in response.error_msg
    assert reason in response.error_msg
    assert heard.next() == response.plan.joint_trajectory
    status, _ = client.status('recorder', lambda status: 'not recorded' in status.message)
    assert reason in status.message
    assert status.level == b'\x01'
