"""The executable: arguments, signals, exit status and what is printed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import yaml
from mcap.reader import make_reader
from ros.node.harness import (
    DOMAIN,
    REPOSITORY,
    STORY_FILE,
    TIMEOUT,
    Client,
    Code,
    eventually,
    story_request,
)
from ros.node.slow_search import slow_hand_file, slow_request

Run = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def run_node(tmp_path: Path) -> Iterator[Run]:
    """Starts the node in a process of its own, in tmp_path."""
    processes: list[subprocess.Popen[str]] = []

    def run(*arguments: str) -> subprocess.Popen[str]:
        path = os.pathsep.join([str(REPOSITORY), os.environ.get('PYTHONPATH', '')])
        process = subprocess.Popen(
            [sys.executable, '-m', 'cfplan_ros.planner_node', *arguments],
            env={**os.environ, 'ROS_DOMAIN_ID': str(DOMAIN), 'PYTHONPATH': path},
            cwd=tmp_path,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        processes.append(process)
        return process

    yield run
    for process in processes:
        process.kill()
        process.wait()
        assert process.stderr is not None
        process.stderr.close()


def parameters(**values: object) -> list[str]:
    settings = [word for name, value in values.items() for word in ('-p', f'{name}:={value}')]
    return ['--ros-args', *settings]


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_signal_while_planning_cancels_answers_records_and_ends_well(
    run_node: Run, client: Client, tmp_path: Path, number: signal.Signals
) -> None:
    process = run_node(*parameters(hand_file=slow_hand_file(tmp_path)))
    pending = client.send_plan(slow_request())
    client.planner_state(lambda values: values['state'] == 'planning')
    process.send_signal(number)
    began = time.monotonic()
    response = pending.answer()
    _, errors = process.communicate(timeout=TIMEOUT)
    assert process.returncode == 0
    assert time.monotonic() - began < 5.0
    assert response.error_code == Code.CANCELED
    assert 'Traceback' not in errors
    with (tmp_path / 'runs' / response.record).open('rb') as stream:
        assert len(list(make_reader(stream).iter_messages())) == 2


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_signal_while_idle_ends_well(
    run_node: Run, client: Client, number: signal.Signals
) -> None:
    process = run_node()
    assert client.plan(story_request()).error_code == Code.NOT_CONFIGURED
    process.send_signal(number)
    _, errors = process.communicate(timeout=TIMEOUT)
    assert process.returncode == 0
    assert 'Traceback' not in errors


def test_signal_right_after_an_answer_leaves_a_complete_run(
    run_node: Run, client: Client, tmp_path: Path
) -> None:
    process = run_node(*parameters(hand_file=STORY_FILE))
    response = client.plan(story_request())
    process.terminate()
    process.communicate(timeout=TIMEOUT)
    assert process.returncode == 0
    assert os.listdir(tmp_path / 'runs') == [response.record]


def test_run_of_a_killed_planner_is_completed_by_the_next(
    run_node: Run, client: Client, tmp_path: Path
) -> None:
    process = run_node(*parameters(hand_file=STORY_FILE))
    response = client.plan(story_request())
    process.kill()
    process.wait(TIMEOUT)
    run_node(*parameters(hand_file=STORY_FILE))
    file = tmp_path / 'runs' / response.record
    eventually(file.exists, f'{file} is not recovered')
    with file.open('rb') as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert summary.statistics is not None
    counts = summary.statistics.channel_message_counts
    frames = len(response.plan.joint_trajectory.points)
    assert sorted(counts.values()) == [1] * 7 + [frames] * 5


def test_parameters_come_from_a_file(run_node: Run, client: Client, tmp_path: Path) -> None:
    file = tmp_path / 'parameters.yaml'
    values = {'hand_file': str(STORY_FILE), 'preview': {'speed': 3.0}}
    file.write_text(yaml.safe_dump({'/**': {'ros__parameters': values}}), encoding='utf-8')
    run_node('--ros-args', '--params-file', str(file))
    assert client.get('preview.speed') == 3.0
    assert client.plan(story_request()).error_code == Code.NONE


def test_parameter_file_of_the_package_serves_as_it_is(run_node: Run, client: Client) -> None:
    file = REPOSITORY / 'config' / 'planner_node.yaml'
    run_node('--ros-args', '--params-file', str(file))
    request = story_request()
    request.object = []
    assert client.plan(request).error_code == Code.NONE


@pytest.mark.parametrize(
    ('arguments', 'text'),
    [
        (parameters(hand_file='nowhere.yaml'), 'nowhere.yaml'),
        (parameters(gravity='[1.0]'), 'expected two finite numbers'),
        (parameters(queue_length='many'), 'queue_length'),
        (parameters(queue_length='-5'), 'queue_length'),
        (parameters(default_time_budget='100.0'), 'at most maximal_time_budget'),
        (['--ros-args', '--params-file', 'nowhere.yaml'], 'nowhere.yaml'),
        (['--ros-args', '-p', 'nonsense'], 'nonsense'),
    ],
)
def test_arguments_that_cannot_work_end_the_node_with_a_message(
    run_node: Run, arguments: list[str], text: str
) -> None:
    process = run_node(*arguments)
    _, errors = process.communicate(timeout=TIMEOUT)
    assert process.returncode == 2
    assert text in errors
    assert 'Traceback' not in errors


def test_planner_says_in_diagnostics_what_it_did(run_node: Run, client: Client) -> None:
    run_node(*parameters(hand_file=STORY_FILE))
    response = client.plan(story_request('turned'))
    values = client.planner_state(lambda values: values.get('last problem') == 'turned')
    assert values['state'] == 'idle'
    assert values['last outcome'] == 'SOLVED'
    _, recorder = client.status('recorder', lambda status: True)
    assert recorder['directory'] == 'runs'
    assert recorder['last file'] == response.record


def test_little_space_left_is_a_warning(run_node: Run, client: Client) -> None:
    run_node(*parameters(hand_file=STORY_FILE, disk_space_warning='999999999.0'))
    client.plan(story_request())
    status, _ = client.status('recorder', lambda status: 'MB left' in status.message)
    assert status.level == b'\x01'


def test_missing_toppra_is_said_at_the_start(
    run_node: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    absent = tmp_path / 'absent'
    (absent / 'toppra').mkdir(parents=True)
    (absent / 'toppra' / '__init__.py').write_text('raise ImportError("No module")\n')
    monkeypatch.setenv('PYTHONPATH', f'{absent}{os.pathsep}{os.environ.get("PYTHONPATH", "")}')
    process = run_node(*parameters(hand_file=STORY_FILE))
    _, errors = process.communicate(timeout=TIMEOUT)
    assert process.returncode == 2
    assert 'pip install toppra' in errors
    assert 'Traceback' not in errors
