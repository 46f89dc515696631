"""`cfplan call` against a node in a process of its own."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from ros.node.harness import DOMAIN, INFEASIBLE_FILE, REPOSITORY, STORY_FILE, TIMEOUT, Client
from ros.node.slow_search import slow_problem_file

Cfplan = Callable[..., subprocess.CompletedProcess[str]]
Start = Callable[..., subprocess.Popen[str]]
ENVIRONMENT = {**os.environ, 'ROS_DOMAIN_ID': str(DOMAIN), 'COLUMNS': '80'}


def command(*arguments: object) -> list[str]:
    code = 'from cfplan_core.command_line import main; main()'
    return [sys.executable, '-c', code, *map(str, arguments)]


@pytest.fixture
def cfplan(tmp_path: Path) -> Cfplan:
    """Runs the command line in tmp_path and waits for its end."""

    def run(*arguments: object) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            command(*arguments),
            env=ENVIRONMENT,
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=TIMEOUT,
        )

    return run


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """Starts the command line in tmp_path; what still runs at the end is killed."""
    processes: list[subprocess.Popen[str]] = []

    def begin(*arguments: object) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            command(*arguments),
            env=ENVIRONMENT,
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        processes.append(process)
        return process

    yield begin
    for process in processes:
        process.kill()
        process.communicate()


def changed_story(tmp_path: Path, change: Callable[[dict[str, Any]], None]) -> Path:
    data = yaml.safe_load(STORY_FILE.read_text(encoding='utf-8'))
    change(data)
    file = tmp_path / 'changed.yaml'
    file.write_text(yaml.safe_dump(data), encoding='utf-8')
    return file


def tilted_story(tmp_path: Path) -> Path:
    """The story with a goal of an orientation alone."""

    def change(data: dict[str, Any]) -> None:
        data['goal'] = {'orientation': -1.1, 'tolerance': {'angle': 0.05}}

    return changed_story(tmp_path, change)


@pytest.mark.parametrize(
    ('goal', 'options'),
    [
        ('grasp', ()),
        ('grasp', ('--max-needed-force', '3', '--stay-within', '-1,-1 1,-1 1,1 -1,1')),
        ('orientation', ('--forbid', 'object.v2|palm.0.e2', '--resolution', '0.1')),
        ('orientation', ('--prefer', 'shortest', '--alternatives', '2')),
    ],
    ids=['plain', 'bounds', 'constraints', 'alternatives'],
)
def test_answer_is_printed_and_written_as_the_planner_alone_does_it(
    goal: str, options: tuple[str, ...], cfplan: Cfplan, start: Start, tmp_path: Path
) -> None:
    file = STORY_FILE if goal == 'grasp' else tilted_story(tmp_path)
    options = ('--time-budget', str(TIMEOUT), *options)
    start('node', STORY_FILE)
    called = cfplan('call', file, '--wait', TIMEOUT, '--json', 'call.json', *options)
    planned = cfplan('plan', file, '--json', 'plan.json', *options)
    assert called.returncode == 0, called.stderr
    answer, record = called.stdout.rstrip().rsplit('\n', 1)
    without_times = [line for line in planned.stdout.splitlines() if 'planned in' not in line]
    assert [line for line in answer.splitlines() if 'planned in' not in line] == without_times
    assert (tmp_path / 'runs' / record.split()[-1]).exists()
    for suffix in ('', '.2') if '--alternatives' in options else ('',):
        first, second = (
            json.loads((tmp_path / f'{name}{suffix}.json').read_text())
            for name in ('call', 'plan')
        )
        assert first['frames'] == second['frames']
        assert first['segments'] == second['segments']
        assert first['message'] == second['message']


def test_figures_are_those_of_the_planner_alone(
    cfplan: Cfplan, start: Start, tmp_path: Path
) -> None:
    start('node', STORY_FILE)
    cfplan('call', STORY_FILE, '--wait', TIMEOUT, '--figures', 'call')
    cfplan('plan', STORY_FILE, '--figures', 'plan')
    names = sorted(path.name for path in (tmp_path / 'plan').iterdir())
    assert len(names) == 5
    assert sorted(path.name for path in (tmp_path / 'call').iterdir()) == names


def test_infeasible_is_status_1(cfplan: Cfplan, start: Start) -> None:
    start('node', INFEASIBLE_FILE)
    called = cfplan('call', INFEASIBLE_FILE, '--wait', TIMEOUT)
    assert called.returncode == 1, called.stderr
    assert 'infeasible' in called.stdout


def test_what_only_the_planner_finds_wrong_is_status_2(
    cfplan: Cfplan, start: Start, tmp_path: Path
) -> None:
    def lifted(data: dict[str, Any]) -> None:
        data['start']['object_pose'][1] += 0.001

    start('node', STORY_FILE)
    called = cfplan('call', changed_story(tmp_path, lifted), '--wait', TIMEOUT)
    assert called.returncode == 2
    assert 'start' in called.stderr
    assert 'Traceback' not in called.stderr


def test_problem_for_another_hand_is_refused(cfplan: Cfplan, start: Start, tmp_path: Path) -> None:
    def longer(data: dict[str, Any]) -> None:
        data['hand']['fingers'][0]['links'][0]['length'] += 0.001

    start('node', STORY_FILE)
    called = cfplan('call', changed_story(tmp_path, longer), '--wait', TIMEOUT)
    assert called.returncode == 2
    assert 'hand_digest' in called.stderr


def test_exhausted_budget_is_status_3(cfplan: Cfplan, start: Start) -> None:
    start('node', STORY_FILE)
    called = cfplan('call', STORY_FILE, '--wait', TIMEOUT, '--time-budget', 0.001)
    assert called.returncode == 3
    assert 'time budget' in called.stdout


def test_file_that_is_no_problem_is_status_2(cfplan: Cfplan) -> None:
    called = cfplan('call', 'missing.yaml')
    assert called.returncode == 2
    assert 'missing.yaml' in called.stderr


def test_planner_that_is_not_there_is_status_4(cfplan: Cfplan) -> None:
    called = cfplan('call', STORY_FILE, '--node', '/nowhere/planner', '--wait', 0.3)
    assert called.returncode == 4
    assert '/nowhere/planner/plan' in called.stderr


def test_name_that_is_no_node_is_status_2(cfplan: Cfplan) -> None:
    called = cfplan('call', STORY_FILE, '--node', 'two words', '--wait', 0.3)
    assert called.returncode == 2
    assert 'two words' in called.stderr
    assert 'Traceback' not in called.stderr


def test_planner_that_dies_while_it_plans_is_status_4(start: Start, tmp_path: Path) -> None:
    problem = slow_problem_file(tmp_path)
    node = start('node', problem)
    calling = start('call', problem, '--wait', TIMEOUT)
    wait_until_planning()
    node.kill()
    _, complaint = calling.communicate(timeout=3 * TIMEOUT)
    assert calling.returncode == 4
    assert 'without an answer' in complaint


def test_ctrl_c_ends_the_call_with_status_130(start: Start, tmp_path: Path) -> None:
    problem = slow_problem_file(tmp_path)
    start('node', problem)
    calling = start('call', problem, '--wait', TIMEOUT)
    wait_until_planning()
    calling.send_signal(signal.SIGINT)
    _, complaint = calling.communicate(timeout=TIMEOUT)
    assert calling.returncode == 130
    assert 'Traceback' not in complaint


def test_node_ends_well_on_ctrl_c(start: Start) -> None:
    node = start('node', STORY_FILE)
    client = Client()
    try:
        client.planner_state(lambda values: values['state'] == 'idle')
    finally:
        client.close()
    node.send_signal(signal.SIGINT)
    _, log = node.communicate(timeout=TIMEOUT)
    assert node.returncode == 0
    assert 'Traceback' not in log


def test_node_refuses_words_that_are_no_ros_arguments(cfplan: Cfplan) -> None:
    run = cfplan('node', STORY_FILE, 'another.yaml')
    assert run.returncode == 2
    assert 'another.yaml' in run.stderr


def test_node_with_a_file_that_is_no_problem_is_status_2(cfplan: Cfplan) -> None:
    run = cfplan('node', REPOSITORY / 'README.md')
    assert run.returncode == 2
    assert 'README.md' in run.stderr
    assert 'Traceback' not in run.stderr


def wait_until_planning() -> None:
    client = Client()
    try:
        client.planner_state(lambda values: values['state'] == 'planning')
    finally:
        client.close()
