from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from ros.conversions.example_files import STORY_FILE

from cfplan_core import InvalidProblemError, Problem
from cfplan_ros.conversions.hands import (
    build_hand,
    build_object,
    hand_digest,
    load_hand,
    load_object,
)

STORY = yaml.safe_load(STORY_FILE.read_text())


@pytest.fixture
def hand() -> dict[str, Any]:
    return copy.deepcopy(STORY['hand'])


def written(folder: Path, name: str, data: object) -> Path:
    path = folder / name
    path.write_text(yaml.safe_dump(data))
    return path


def test_a_hand_is_the_same_from_a_problem_and_from_a_file_of_its_own(
    tmp_path: Path, hand: dict[str, Any]
) -> None:
    assert load_hand(written(tmp_path, 'hand.yaml', hand)) == load_hand(STORY_FILE) == hand


def test_a_hand_is_found_in_the_file_that_a_problem_names(
    tmp_path: Path, hand: dict[str, Any]
) -> None:
    written(tmp_path, 'hand.yaml', hand)
    problem = written(tmp_path, 'problem.yaml', {**STORY, 'hand': 'hand.yaml'})
    assert load_hand(problem) == hand


def test_an_object_is_the_same_from_a_problem_and_from_a_file_of_its_own(tmp_path: Path) -> None:
    bare = written(tmp_path, 'object.yaml', STORY['object'])
    assert load_object(bare) == load_object(STORY_FILE) == STORY['object']


def test_a_built_hand_is_that_of_the_problem(story: Problem, hand: dict[str, Any]) -> None:
    built = build_hand(hand)
    assert built.joint_names == story.hand.joint_names
    angles = story.start.joints
    for body, vertices in story.hand.world_vertices(angles).items():
        assert np.array_equal(built.world_vertices(angles)[body], vertices)


def test_a_built_object_is_that_of_the_problem(story: Problem) -> None:
    assert np.array_equal(build_object(STORY['object']).vertices, story.object.vertices)


def test_all_faults_of_a_hand_are_found_in_its_own_file(
    tmp_path: Path, hand: dict[str, Any]
) -> None:
    hand['fingers'][0]['joints'][0]['velocity_limit'] = -1.0
    hand['fingers'][1]['links'][0]['length'] = 'long'
    path = written(tmp_path, 'hand.yaml', hand)
    with pytest.raises(InvalidProblemError) as caught:
        load_hand(path)
    assert [(found.file, found.field) for found in caught.value.findings] == [
        (str(path), 'fingers[0].joints[0].velocity_limit'),
        (str(path), 'fingers[1].links[0].length'),
    ]


def test_a_fault_of_a_hand_in_a_problem_has_the_fields_of_the_problem(
    tmp_path: Path, hand: dict[str, Any]
) -> None:
    del hand['fingers'][0]['base']
    path = written(tmp_path, 'problem.yaml', {**STORY, 'hand': hand})
    with pytest.raises(InvalidProblemError) as caught:
        load_hand(path)
    assert [(found.file, found.field) for found in caught.value.findings] == [
        (str(path), 'hand.fingers[0].base')
    ]


def test_a_hand_does_not_depend_on_the_rest_of_its_problem(
    tmp_path: Path, hand: dict[str, Any]
) -> None:
    problem = {'format': 'cfplan/problem/1', 'hand': hand, 'goal': 'somewhere'}
    assert load_hand(written(tmp_path, 'problem.yaml', problem)) == hand


def test_zero_need_not_be_an_angle_that_a_joint_takes(hand: dict[str, Any]) -> None:
    hand['fingers'][0]['joints'][0]['limits'] = [2.0, 3.0]
    assert build_hand(hand).joints[0].lower == 2.0


@pytest.mark.parametrize(
    ('text', 'said'),
    [
        ('', 'got nothing'),
        ('[1, 2]', r'got \[1, 2\]'),
        ('hand: 7', 'hand: got 7'),
        ('hand: elsewhere.yaml', 'elsewhere.yaml: no such file'),
        ('palm: [', 'expected YAML'),
        ('palm: []\nfingers: []', r'fingers: got 0: \[\]'),
    ],
)
def test_a_file_without_a_hand_is_refused(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / 'hand.yaml'
    path.write_text(text)
    with pytest.raises(InvalidProblemError, match=said):
        load_hand(path)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InvalidProblemError, match=r'none\.yaml: no such file'):
        load_hand(tmp_path / 'none.yaml')


def test_a_digest_is_64_hexadecimal_digits(hand: dict[str, Any]) -> None:
    digest = hand_digest(hand)
    assert len(digest) == 64
    assert int(digest, 16) > 0


def test_a_digest_is_of_the_hand_and_not_of_its_file(hand: dict[str, Any]) -> None:
    rewritten = json.loads(json.dumps(hand, sort_keys=True))
    rewritten['fingers'][0]['base_angle'] = 0
    rewritten['fingers'][0]['base'] = [-8e-2, -0.0]
    rewritten['fingers'][0]['links'][0]['mass'] = 0.0
    assert rewritten != hand
    assert hand_digest(rewritten) == hand_digest(hand)


def test_a_digest_is_the_same_of_mapping_and_hand(story: Problem, hand: dict[str, Any]) -> None:
    assert hand_digest(hand) == hand_digest(story.hand)


@pytest.mark.parametrize(
    ('path', 'value'),
    [
        (('palm', 0, 'vertices', 0, 1), -0.0500000001),
        (('fingers', 0, 'name'), 'thumb'),
        (('fingers', 0, 'base', 0), -0.081),
        (('fingers', 0, 'base_angle'), 1e-9),
        (('fingers', 0, 'joints', 0, 'name'), 'other'),
        (('fingers', 0, 'joints', 0, 'limits', 0), 0.031),
        (('fingers', 0, 'joints', 0, 'limits', 1), 3.0),
        (('fingers', 0, 'joints', 0, 'velocity_limit'), 2.0),
        (('fingers', 0, 'joints', 0, 'effort_limit'), 4.0),
        (('fingers', 0, 'joints', 0, 'acceleration_limit'), 4.0),
        (('fingers', 0, 'links', 0, 'name'), 'other'),
        (('fingers', 0, 'links', 0, 'length'), 0.081),
        (('fingers', 0, 'links', 0, 'vertices', 2, 1), 0.0061),
        (('fingers', 0, 'links', 0, 'mass'), 0.01),
    ],
    ids=str,
)
def test_another_hand_has_another_digest(
    hand: dict[str, Any], path: tuple[str | int, ...], value: object
) -> None:
    other: Any = copy.deepcopy(hand)
    part = other
    for step in path[:-1]:
        part = part[step]
    part[path[-1]] = value
    assert hand_digest(other) != hand_digest(hand)
