"""What a reader must know of a message type: name, definition text and RIHS01 type hash.

Everything is found from the message class and the interface files of the installation, so that
it is right for whatever version of the common interfaces is installed.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, cast

from ament_index_python.packages import get_package_share_directory

ENCODING = 'ros2msg'

_SEPARATOR = '=' * 80
_FIELD_TYPE = re.compile(
    r'(?:(?P<sequence>sequence)<)?'
    r'(?P<base>[\w/]+)(?:<(?P<string_bound>\d+)>)?'
    r'(?(sequence)(?:,\s*(?P<sequence_bound>\d+))?>|(?:\[(?P<length>\d+)\])?)'
)
# Numbers of type_description_interfaces/msg/FieldType.
_NESTED, _BOUNDED = 1, 4
_ARRAY, _BOUNDED_SEQUENCE, _SEQUENCE = 48, 96, 144
_FIELD_TYPE_IDS = {
    'int8': 2,
    'uint8': 3,
    'int16': 4,
    'uint16': 5,
    'int32': 6,
    'uint32': 7,
    'int64': 8,
    'uint64': 9,
    'float': 10,
    'double': 11,
    'char': 13,
    'wchar': 14,
    'boolean': 15,
    'octet': 16,
    'string': 17,
    'wstring': 18,
}


@dataclass(frozen=True)
class Schema:
    """A message type as a recording describes it.

    Attributes:
        name: E.g. ``std_msgs/msg/Header``; ``cfplan_msgs/msg/PlanManipulation_Request`` for the
            request of a service, which is recorded as a message: with its ROS name, which has
            ``srv`` in the middle, rosbags and others fail to decode it.
        text: Definition in the encoding ``ros2msg``: the interface file as it is, then each type
            that it depends on below a separator.
        type_hash: RIHS01 hash of REP-2016, e.g. ``RIHS01_b106…``.
    """

    name: str
    text: str
    type_hash: str


def schema_of(message_class: type[Any]) -> Schema:
    """Describe a message class, also the request or response of a service.

    Raises:
        PackageNotFoundError: The package of a type is not in the ament index.
        OSError: A type's interface file cannot be read.
    """
    return _schema(type_name(message_class))


@cache
def _schema(name: str) -> Schema:
    message_class = message_class_of(name)
    parts = [_definition(name)]
    for dependency in _dependencies(message_class, {}):
        package, _, short = type_name(dependency).split('/')
        parts.append(f'{_SEPARATOR}\nMSG: {package}/{short}\n{_definition(type_name(dependency))}')
    recorded_as = name.replace('/srv/', '/msg/')
    return Schema(recorded_as, '\n'.join(parts), type_hash(message_class))


def type_name(message_class: type[Any]) -> str:
    """ROS name of a message type, e.g. ``cfplan_msgs/srv/PlanManipulation_Request``."""
    package, kind = message_class.__module__.split('.')[:2]
    return f'{package}/{kind}/{message_class.__name__}'


def message_class_of(name: str) -> type[Any]:
    """Find the class of a message type by its name in ROS, in a definition or in a recording.

    Raises:
        LookupError: No such type is installed.
    """
    package, *_, short = name.split('/')
    # Only the two halves of a service have an underscore in their names, and of these only the
    # service is sure to be a name of its module.
    service, _, half = short.rpartition('_')
    try:
        if service:
            found = getattr(getattr(import_module(f'{package}.srv'), service), half)
        else:
            found = getattr(import_module(f'{package}.msg'), short)
    except (ImportError, AttributeError, ValueError):
        raise LookupError(f'the message type {name} is not installed') from None
    return cast('type[Any]', found)


def type_hash(message_class: type[Any]) -> str:
    """RIHS01 hash: SHA-256 of the type description and those of all types that it refers to."""
    descriptions = {
        type_name(each): _description(each)
        for each in _dependencies(message_class, {message_class: None})
    }
    hashed = {
        'type_description': _description(message_class),
        'referenced_type_descriptions': [descriptions[name] for name in sorted(descriptions)],
    }
    return f'RIHS01_{hashlib.sha256(json.dumps(hashed).encode()).hexdigest()}'


def _definition(name: str) -> str:
    """Text of the interface file; of a service's file the half that defines the type."""
    package, kind, short = name.split('/')
    service, _, half = short.rpartition('_') if kind == 'srv' else (short, '', '')
    path = Path(get_package_share_directory(package)) / kind / f'{service}.{kind}'
    text = path.read_text(encoding='utf-8')
    if kind == 'srv':
        request, _, response = re.split(r'^(---)[ \t]*\n', text, maxsplit=1, flags=re.MULTILINE)
        text = request if half == 'Request' else response
    return text if text.endswith('\n') else f'{text}\n'


def _dependencies(message_class: type[Any], met: dict[type[Any], None]) -> Iterator[type[Any]]:
    """All types inside a type, each once, in rosbag2's order: depth first, siblings by name."""
    fields = message_class.get_fields_and_field_types().values()
    nested = {_parsed(field)['base'] for field in fields} - _FIELD_TYPE_IDS.keys()
    for name in sorted(nested):
        dependency = message_class_of(name)
        if dependency not in met:
            met[dependency] = None
            yield dependency
            yield from _dependencies(dependency, met)


def _description(message_class: type[Any]) -> dict[str, Any]:
    fields = dict(message_class.get_fields_and_field_types())
    # The C structs that rosidl generates cannot be empty.
    fields = fields or {'structure_needs_at_least_one_member': 'uint8'}
    return {
        'type_name': type_name(message_class),
        'fields': [{'name': name, 'type': _field_type(text)} for name, text in fields.items()],
    }


def _field_type(text: str) -> dict[str, Any]:
    """Describe a field's type, given as in ``get_fields_and_field_types()``."""
    parsed = _parsed(text)
    base = parsed['base']
    number = _FIELD_TYPE_IDS.get(base, _NESTED)
    if parsed['string_bound']:
        number += _BOUNDED
    if parsed['length']:
        number += _ARRAY
    elif parsed['sequence_bound']:
        number += _BOUNDED_SEQUENCE
    elif parsed['sequence']:
        number += _SEQUENCE
    return {
        'type_id': number,
        'capacity': int(parsed['length'] or parsed['sequence_bound'] or 0),
        'string_capacity': int(parsed['string_bound'] or 0),
        'nested_type_name': '' if base in _FIELD_TYPE_IDS else base.replace('/', '/msg/'),
    }


@cache
def _parsed(text: str) -> dict[str, Any]:
    match = _FIELD_TYPE.fullmatch(text)
    if match is None:
        raise ValueError(f'{text!r} is no type of a message field')
    return match.groupdict()
