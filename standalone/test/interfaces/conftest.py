from collections.abc import Callable, Mapping
from typing import Any

import pytest

from ros_standalone.interfaces import Message, load


def _message_from(message_class: type[Any], value: Mapping[str, Any]) -> Any:
    message = message_class()
    types = message_class.get_fields_and_field_types()
    for name, item in value.items():
        setattr(message, name, _field_from(getattr(message, name), types[name], item))
    return message


def _field_from(default: Any, idl_type: str, item: Any) -> Any:
    element = idl_type.removeprefix('sequence<').split('>')[0].split(',')[0].split('[')[0]
    if isinstance(default, Message):
        return _message_from(type(default), item)
    if '/' in element:
        package, name = element.split('/')
        cls = load(f'{package}/msg/{name}')
        return [_message_from(cls, value) for value in item]
    if element == 'octet':
        return item.encode('latin-1') if isinstance(item, str) else [_octet(v) for v in item]
    return item


def _octet(character: str) -> bytes:
    return character.encode('latin-1')


@pytest.fixture(scope='session')
def message_from() -> Callable[[type[Any], Mapping[str, Any]], Any]:
    """Makes a message of a class from a mapping of plain values."""
    return _message_from
