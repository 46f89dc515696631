"""Type descriptions and their hashes, RIHS01 of REP-2016."""

from __future__ import annotations

import hashlib
import json
from functools import cache
from typing import Any

from ros_standalone.interfaces.catalog import definition
from ros_standalone.interfaces.definitions import (
    STRINGS,
    Field,
    FieldType,
    MessageDefinition,
    ServiceDefinition,
)

EMPTY_MEMBER = 'structure_needs_at_least_one_member'
"""The byte that stands in a message without fields, as IDL structures cannot be empty."""

# type_description_interfaces/msg/FieldType
_TYPE_IDS = {
    'int8': 2,
    'uint8': 3,
    'int16': 4,
    'uint16': 5,
    'int32': 6,
    'uint32': 7,
    'int64': 8,
    'uint64': 9,
    'float32': 10,
    'float64': 11,
    'bool': 15,
    'byte': 16,
    'string': 17,
    'wstring': 18,
}
_NESTED = 1
_BOUNDED_STRING_OFFSET = 4
_ARRAY_OFFSET, _BOUNDED_OFFSET, _UNBOUNDED_OFFSET = 48, 96, 144


@cache
def hash_of(type_name: str) -> str:
    """RIHS01 type hash of a message or service, such as ``RIHS01_df66...``.

    Raises:
        InterfaceNotFoundError: There is no such interface.
    """
    text = json.dumps(_without_defaults(description_of(type_name)))
    return 'RIHS01_' + hashlib.sha256(text.encode()).hexdigest()


def description_of(type_name: str) -> dict[str, Any]:
    """Description of a message or service in the form of ``TypeDescription``.

    Returns:
        ``type_description`` and ``referenced_type_descriptions`` (sorted by name), each with
        ``type_name`` and ``fields``, a field with ``name``, ``type``, ``default_value``.

    Raises:
        InterfaceNotFoundError: There is no such interface.
    """
    referenced: set[str] = set()
    pending = [type_name]
    while pending:
        for nested in _nested_names(pending.pop()):
            if nested not in referenced:
                referenced.add(nested)
                pending.append(nested)
    return {
        'type_description': _individual(type_name),
        'referenced_type_descriptions': [_individual(name) for name in sorted(referenced)],
    }


def _fields(type_name: str) -> tuple[Field, ...]:
    found = definition(type_name)
    if isinstance(found, ServiceDefinition):
        parts = (found.request, found.response, found.event)
        names = ('request_message', 'response_message', 'event_message')
        return tuple(
            Field(name, FieldType(part.type_name)) for name, part in zip(names, parts, strict=True)
        )
    assert isinstance(found, MessageDefinition)
    return found.fields or (Field(EMPTY_MEMBER, FieldType('uint8')),)


def _nested_names(type_name: str) -> list[str]:
    return [field.type.base for field in _fields(type_name) if field.type.is_message]


def _individual(type_name: str) -> dict[str, Any]:
    return {'type_name': type_name, 'fields': [_field(field) for field in _fields(type_name)]}


def _field(field: Field) -> dict[str, Any]:
    kind = field.type
    type_id = _NESTED if kind.is_message else _TYPE_IDS[kind.base]
    if kind.base in STRINGS and kind.string_bound is not None:
        type_id += _BOUNDED_STRING_OFFSET
    if kind.is_array:
        type_id += _ARRAY_OFFSET
    elif kind.is_sequence:
        type_id += _UNBOUNDED_OFFSET if kind.size is None else _BOUNDED_OFFSET
    return {
        'name': field.name,
        'type': {
            'type_id': type_id,
            'capacity': kind.size or 0,
            'string_capacity': kind.string_bound or 0,
            'nested_type_name': kind.base if kind.is_message else '',
        },
        'default_value': '' if field.default is None else str(field.default),
    }


def _without_defaults(description: dict[str, Any]) -> dict[str, Any]:
    def strip(individual: dict[str, Any]) -> dict[str, Any]:
        fields = [{'name': f['name'], 'type': f['type']} for f in individual['fields']]
        return {'type_name': individual['type_name'], 'fields': fields}

    return {
        'type_description': strip(description['type_description']),
        'referenced_type_descriptions': [
            strip(individual) for individual in description['referenced_type_descriptions']
        ],
    }
