"""``cfplan execute``: what it prints, writes and returns."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from mcap.reader import make_reader
from PIL import Image
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState

from cfplan_core import PlanResult, Status, load_problem, plan, read_plan, write_plan
from cfplan_core.command_line.application import Application
from cfplan_core.execution.execute import execute_plan
from cfplan_ros.command_line.execute import execute
from cfplan_ros.recording.reading import read_run
from cfplan_ros.recording.topics import ESSENTIAL, PREVIEW, REQUEST, RESPONSE

PROBLEM_FILE = Path(__file__).parents[3] / 'config' / 'problems' / 'h020.yaml'


@pytest.fixture(scope='module')
def planned() -> PlanResult:
    return plan(load_problem(PROBLEM_FILE))


@pytest.fixture
def plan_file(planned: PlanResult, tmp_path: Path) -> Path:
    path = tmp_path / 'plan.json'
    write_plan(planned, path)
    return path


def _cfplan(*arguments: object) -> Result:
    application = Application('cfplan', commands={'execute': execute})
    return CliRunner().invoke(application, ['execute', *(str(a) for a in arguments)])


def test_plan_that_succeeds_is_described(plan_file: Path, planned: PlanResult) -> None:
    result = _cfplan(plan_file)
    assert result.exit_code == 0
    assert 'h020: the object ends in the goal grasp' in result.output
    assert 'as planned' in result.output
    for name in (*planned.joint_names, *planned.segments[0].contacts):
        assert name in result.output
    assert all(len(line) <= 80 for line in result.output.splitlines())


def test_plan_that_fails_has_its_own_status_and_names_the_contact(plan_file: Path) -> None:
    result = _cfplan(plan_file, '--friction', '1.5')
    assert result.exit_code == 1
    assert 'does not end in the goal grasp; first lost' in result.output.replace('\n', ' ')


def test_trials_end_in_a_success_rate(plan_file: Path) -> None:
    result = _cfplan(plan_file, '--mass-error', '0.2', '--trials', '2', '--seed', '5')
    assert result.exit_code == 0
    assert '2 of 2 times, 100% (34% to 100%' in result.output.replace('\n', ' ')


def test_figure_animation_and_recording_are_written(plan_file: Path, tmp_path: Path) -> None:
    figure, animation, record = (tmp_path / 'new' / name for name in ('f.png', 'a.gif', 'r.mcap'))
    result = _cfplan(plan_file, '--figure', figure, '--animation', animation, '--record', record)
    assert result.exit_code == 0
    with Image.open(figure) as image:
        assert image.width > 1000
    with Image.open(animation) as image:
        assert image.n_frames > 30
    assert read_run(record).count > 1000


def test_recording_has_the_topics_of_a_run_and_what_was_measured(
    plan_file: Path, tmp_path: Path
) -> None:
    record = tmp_path / 'r.mcap'
    assert _cfplan(plan_file, '--record', record).exit_code == 0
    run = execute_plan(load_problem(PROBLEM_FILE), read_plan(plan_file)).run
    states, topics = [], set()
    with open(record, 'rb') as stream:
        for _, channel, message in make_reader(stream).iter_messages():
            topics.add(channel.topic)
            if channel.topic.endswith('/joint_states'):
                states.append(deserialize_message(message.data, JointState))
    recorded = {t.full_name('/cfplan_planner') for t in (*ESSENTIAL, *PREVIEW)}
    calls = {f'/cfplan_planner/{name}' for name in (REQUEST, RESPONSE)}
    assert topics == recorded - calls
    assert np.array([s.position for s in states]) == pytest.approx(run.joints, abs=1e-6)
    assert np.array([s.effort for s in states]) == pytest.approx(run.torques, abs=1e-3)


def test_recording_does_not_replace_a_file(plan_file: Path, tmp_path: Path) -> None:
    record = tmp_path / 'r.mcap'
    record.write_bytes(b'precious')
    result = _cfplan(plan_file, '--record', record)
    assert result.exit_code == 2
    assert 'cannot write' in result.output
    assert record.read_bytes() == b'precious'


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        (('--figure', 'f.jpg'), '--figure: got f.jpg, expected a name in .png, .pdf, .svg'),
        (('--animation', 'a.avi'), '--animation: got a.avi, expected a name in .gif, .mp4'),
        (('--record', 'r.bag'), '--record: got r.bag, expected a name in .mcap'),
        (('--engine', 'bullet'), "'bullet' is not 'mujoco'"),
        (('--trials', '0'), '0 is not in the range'),
        (('--friction', '-1'), '-1.0 is not in the range'),
    ],
)
def test_impossible_option_is_refused(
    plan_file: Path, arguments: tuple[str, str], message: str
) -> None:
    result = _cfplan(plan_file, *arguments)
    assert result.exit_code == 2
    assert message in ' '.join(result.output.split()).replace('│ ', '')


def test_missing_engine_is_named_with_what_to_do(
    plan_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, 'mujoco', None)
    result = _cfplan(plan_file)
    assert result.exit_code == 2
    assert "pip install 'cfplan_ros[mujoco]'" in result.output


def test_plan_without_frames_is_refused(tmp_path: Path, planned: PlanResult) -> None:
    empty = np.empty((0, 0))
    nothing = PlanResult(planned.problem, Status.INFEASIBLE, planned.joint_names)
    write_plan(replace(nothing, joints=empty), tmp_path / 'none.json')
    result = _cfplan(tmp_path / 'none.json')
    assert result.exit_code == 2
    assert 'has no frames to execute, its status is infeasible' in result.output
