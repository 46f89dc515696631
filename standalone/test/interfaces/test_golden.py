"""Every interface that a real ROS 2 Jazzy wrote down."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from ros_standalone.interfaces import SerializationError, deserialize, load, serialize, type_hash

_GOLDEN = json.loads(
    (Path(__file__).parents[1] / 'golden' / 'cdr_jazzy.json').read_text(encoding='utf-8')
)
_MESSAGES: dict[str, Any] = _GOLDEN['messages']
_PARTS: dict[str, Any] = {
    f'{name}_{part}': service[part]
    for name, service in _GOLDEN['services'].items()
    for part in ('Request', 'Response')
}
_ALL = {**_MESSAGES, **_PARTS}
_WITH_DEFAULT = [name for name, entry in _ALL.items() if 'default_cdr' in entry]


@pytest.mark.parametrize('name', _ALL)
def test_value_serializes_to_the_bytes_of_ros(name: str, message_from: Callable[..., Any]) -> None:
    message = message_from(load(name), _ALL[name]['value'])
    assert serialize(message).hex() == _ALL[name]['cdr']


@pytest.mark.parametrize('name', _WITH_DEFAULT)
def test_default_message_serializes_to_the_bytes_of_ros(name: str) -> None:
    assert serialize(load(name)()).hex() == _ALL[name]['default_cdr']


@pytest.mark.parametrize('name', _ALL)
def test_bytes_of_ros_are_read_as_the_value(name: str, message_from: Callable[..., Any]) -> None:
    message = deserialize(bytes.fromhex(_ALL[name]['cdr']), load(name))
    assert message == message_from(load(name), _ALL[name]['value'])


@pytest.mark.parametrize('name', [*_ALL, *_GOLDEN['services']])
def test_type_hash_is_that_of_ros(name: str) -> None:
    entry = _ALL[name] if name in _ALL else _GOLDEN['services'][name]
    assert type_hash(load(name)) == entry['hash']


@pytest.mark.parametrize('name', _ALL)
def test_field_types_are_those_of_ros(name: str) -> None:
    assert load(name).get_fields_and_field_types() == _ALL[name]['fields']


@pytest.mark.parametrize('name', _ALL)
def test_every_beginning_of_the_bytes_is_refused(name: str) -> None:
    data = bytes.fromhex(_ALL[name]['cdr'])
    for size in range(len(data)):
        with pytest.raises(SerializationError, match=f'cannot read {name}'):
            deserialize(data[:size], load(name))


@pytest.mark.parametrize('name', _ALL)
def test_padding_after_the_bytes_is_ignored(name: str) -> None:
    data = bytes.fromhex(_ALL[name]['cdr'])
    assert deserialize(data + b'\0\0\0', load(name)) == deserialize(data, load(name))
