"""The node's parameters: what is offered, refused and said."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest
import yaml
from rcl_interfaces.srv import DescribeParameters, ListParameters
from ros.node.harness import REPOSITORY, STORY_FILE, Client, Code, Planner, story_request

from cfplan_ros.parameters import (
    DEFAULTS,
    TABLE,
    Configuration,
    ParameterError,
    Settings,
    configure,
)

Start = Callable[..., Planner]
NAMES = [row.name for row in TABLE]


def test_parameter_file_names_exactly_the_parameters() -> None:
    assert set(flat(parameter_file())) == set(NAMES)


def test_parameter_file_has_the_defaults_but_for_hand_and_object() -> None:
    values = flat(parameter_file())
    defaults = {
        row.name: list(row.default) if isinstance(row.default, tuple) else row.default
        for row in TABLE
    }
    differing = {name for name in NAMES if values[name] != defaults[name]}
    assert differing == {'hand_file', 'object_file'}


def test_parameter_file_works() -> None:
    configuration = configure(DEFAULTS.changed(flat(parameter_file())))
    assert configuration.setup.hand is not None
    assert configuration.setup.object is not None


def test_every_parameter_has_its_setting() -> None:
    assert [row.attribute for row in TABLE] == [field.name for field in fields(Settings)]


def test_every_parameter_is_described(planner: Planner, client: Client) -> None:
    listed = client.call(ListParameters, 'list_parameters', ListParameters.Request())
    assert set(NAMES) <= set(listed.result.names)
    request = DescribeParameters.Request(names=NAMES)
    described = client.call(DescribeParameters, 'describe_parameters', request).descriptors
    assert [each.description for each in described] == [row.description for row in TABLE]


def parameter_file() -> dict[str, Any]:
    text = (REPOSITORY / 'config' / 'planner_node.yaml').read_text(encoding='utf-8')
    content: dict[str, Any] = yaml.safe_load(text)['/**']['ros__parameters']
    return content


def flat(values: dict[str, Any], prefix: str = '') -> dict[str, Any]:
    result = {}
    for name, value in values.items():
        if isinstance(value, dict):
            result |= flat(value, f'{prefix}{name}.')
        else:
            result[prefix + name] = value
    return result


# Refusals.


@pytest.fixture
def hands(tmp_path: Path) -> Path:
    (tmp_path / 'not_yaml.yaml').write_text('palm: [', encoding='utf-8')
    (tmp_path / 'no_hand.yaml').write_text('hand: {palm: []}', encoding='utf-8')
    (tmp_path / 'file').write_text('', encoding='utf-8')
    return tmp_path


@pytest.mark.parametrize(
    ('name', 'value', 'text'),
    [
        ('hand_file', 'nowhere.yaml', "hand_file: got 'nowhere.yaml', expected a file"),
        ('hand_file', 'x' * 5000, 'expected a file: File name too long'),
        ('hand_file', '{}/not_yaml.yaml', 'expected YAML'),
        ('hand_file', '{}/no_hand.yaml', 'hand.fingers'),
        ('object_file', '{}/no_hand.yaml', 'object_file'),
        ('gravity', [0.0], 'gravity: got [0.0], expected two finite numbers, m/s^2'),
        ('gravity', [0.0, float('nan')], 'expected two finite numbers'),
        ('frame_id', '/palm', "frame_id: got '/palm', expected"),
        ('frame_id', 'object', 'expected a name that no link or object has'),
        ('frame_id', 'left/link_1', 'expected a name that no link or object has'),
        ('frame_id', 'right_base', 'expected a name that no link or object has'),
        ('default_time_budget', 61.0, 'at most maximal_time_budget, 60 s'),
        ('maximal_time_budget', 1.0, 'at most maximal_time_budget, 1 s'),
        ('default_preference', 'best', "default_preference: got 'best', expected one of first"),
        ('default_resolution', 0.0001, 'default_resolution'),
        ('record_directory', '', "record_directory: got ''"),
        ('record_directory', '{}/file', 'expected a directory to write in'),
        ('record_directory', '/proc/runs', 'expected a directory to write in'),
        ('queue_length', -1, 'queue_length'),
        ('queue_length', 1.5, "expected 'Type.INTEGER'"),
        ('preview__speed', 0.0, 'preview.speed'),
    ],
)
def test_value_that_cannot_work_is_refused_when_set(
    planner: Planner, client: Client, hands: Path, name: str, value: Any, text: str
) -> None:
    before = client.get(name.replace('__', '.'))
    value = value.format(hands) if isinstance(value, str) else value
    (result,) = client.set(**{name: value})
    assert not result.successful
    assert text in result.reason
    assert client.get(name.replace('__', '.')) == before


def test_everything_that_is_wrong_is_said_at_once() -> None:
    wrong = {'hand_file': 'nowhere.yaml', 'gravity': (1.0,), 'frame_id': ''}
    with pytest.raises(ParameterError) as caught:
        configure(DEFAULTS.changed(wrong))
    for name in wrong:
        assert name in str(caught.value)


def test_values_that_work_together_are_taken_together(planner: Planner, client: Client) -> None:
    result = client.set_atomically(default_time_budget=100.0, maximal_time_budget=200.0)
    assert result.successful, result.reason


def test_values_that_do_not_work_together_change_nothing(planner: Planner, client: Client) -> None:
    result = client.set_atomically(preview__speed=2.0, default_time_budget=100.0)
    assert not result.successful
    assert client.get('preview.speed') == 1.0


def test_hand_that_is_set_is_the_one_that_plans(start_planner: Start, client: Client) -> None:
    start_planner(hand_file='')
    assert client.plan(story_request()).error_code == Code.NOT_CONFIGURED
    (result,) = client.set(hand_file=str(STORY_FILE))
    assert result.successful, result.reason
    assert client.plan(story_request()).error_code == Code.NONE


def test_hand_file_may_go_once_it_is_loaded(
    start_planner: Start, client: Client, tmp_path: Path
) -> None:
    hand = tmp_path / 'hand.yaml'
    hand.write_bytes(STORY_FILE.read_bytes())
    start_planner(hand_file=str(hand))
    hand.unlink()
    (result,) = client.set(preview__speed=2.0)
    assert result.successful, result.reason


def test_file_is_found_by_its_name_in_the_package(monkeypatch: Any, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    name = {'hand_file': 'problems/trinkle_hunter_1991.yaml'}
    assert configure(DEFAULTS.changed(name)).hand is not None


def test_file_in_the_working_directory_comes_first(monkeypatch: Any, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'problems').mkdir()
    (tmp_path / 'problems' / 'trinkle_hunter_1991.yaml').write_text('palm: [', encoding='utf-8')
    with pytest.raises(ParameterError, match='expected YAML'):
        configure(DEFAULTS.changed({'hand_file': 'problems/trinkle_hunter_1991.yaml'}))


def test_planner_does_not_start_with_a_hand_that_does_not_load(start_planner: Start) -> None:
    with pytest.raises(ParameterError, match=r'nowhere\.yaml'):
        start_planner(hand_file='nowhere.yaml')


def test_parameters_of_others_are_left_alone() -> None:
    before: Configuration = configure(DEFAULTS)
    assert before.settings.changed({'use_sim_time': True}) == before.settings
