from __future__ import annotations

import json
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from cfplan_msgs.srv import PlanManipulation
from mcap.reader import make_reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import MarkerArray

from cfplan_ros.recording.schemas import message_class_of, schema_of, type_hash, type_name
from cfplan_ros.recording.topics import ESSENTIAL, PREVIEW

GOLDEN = Path(__file__).parents[1] / 'golden'


def _golden_hashes() -> Iterator[tuple[str, str]]:
    """Type names with the hashes that a real Jazzy has for them."""
    golden = json.loads((GOLDEN / 'cdr_jazzy.json').read_text(encoding='utf-8'))
    for name, entry in golden['messages'].items():
        yield name, entry['hash']
    for name, entry in golden['services'].items():
        for half in ('Request', 'Response'):
            yield f'{name}_{half}', entry[half]['hash']


def _installed(name: str) -> type[Any]:
    try:
        import_module(name.partition('/')[0])
    except ImportError:
        pytest.skip(f'{name.partition("/")[0]} is not installed')
    return message_class_of(name)


@pytest.mark.parametrize(('name', 'expected'), list(_golden_hashes()))
def test_hash_is_that_of_a_real_jazzy(name: str, expected: str) -> None:
    assert type_hash(_installed(name)) == expected


@pytest.mark.parametrize('message_class', [MarkerArray, JointTrajectory])
def test_definition_is_that_of_rosbag2_but_for_the_texts_of_the_files(
    message_class: type[Any],
) -> None:
    with (GOLDEN / 'rosbag2_jazzy.mcap').open('rb') as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    golden = {schema.name: schema.data.decode() for schema in summary.schemas.values()}
    schema = schema_of(message_class)
    # The same types in the same order, with the same separators and the same fields; comments
    # differ between releases of the common interfaces.
    assert _bare(schema.text) == _bare(golden[schema.name])


def _bare(definition: str) -> list[str]:
    lines = [' '.join(line.partition('#')[0].split()) for line in definition.splitlines()]
    return [line for line in lines if line]


def test_comments_of_the_interface_file_are_kept() -> None:
    assert '# Where hand and object are now.' in schema_of(PlanManipulation.Request).text


def test_constants_of_a_service_are_with_the_half_that_defines_them() -> None:
    constant = 'uint16 BUDGET_EXHAUSTED=11'
    assert constant in schema_of(PlanManipulation.Response).text
    assert constant not in schema_of(PlanManipulation.Request).text


def test_a_half_of_a_service_is_recorded_as_a_message() -> None:
    schema = schema_of(PlanManipulation.Request)
    assert schema.name == 'cfplan_msgs/msg/PlanManipulation_Request'
    assert message_class_of(schema.name) is PlanManipulation.Request


def test_a_half_of_a_service_is_found_by_its_ros_name() -> None:
    name = 'cfplan_msgs/srv/PlanManipulation_Response'
    assert type_name(PlanManipulation.Response) == name
    assert message_class_of(name) is PlanManipulation.Response


@pytest.mark.parametrize('topic', [*ESSENTIAL, *PREVIEW], ids=lambda topic: topic.name)
def test_hash_is_the_one_rosbags_computes_from_the_definition(topic: Any) -> None:
    schema = schema_of(topic.message_class)
    store = get_typestore(Stores.EMPTY)
    types = get_types_from_msg(schema.text, schema.name)
    name = type_name(topic.message_class)
    store.register({**types, name: types[schema.name]})
    assert store.hash_rihs01(name) == schema.type_hash


def test_unknown_type_is_named() -> None:
    with pytest.raises(LookupError, match=r'std_msgs/msg/Nothing'):
        message_class_of('std_msgs/msg/Nothing')
