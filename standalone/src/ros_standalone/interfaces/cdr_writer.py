"""Generates, for a message class, the function that writes it as little-endian XCDR1."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ros_standalone.interfaces.cdr_source import CODES, SIZES, Source, run_structs
from ros_standalone.interfaces.classes import load
from ros_standalone.interfaces.definitions import STRINGS, Field, MessageDefinition
from ros_standalone.interfaces.errors import SerializationError
from ros_standalone.interfaces.field_checks import TYPE_CODES

_PADDING = {size: tuple(bytes(-position % size) for position in range(8)) for size in (1, 2, 4, 8)}
"""Bytes up to the next multiple of a size, by position modulo 8; the header is half of 8."""


def writer_for(definition: MessageDefinition) -> Callable[[Any], bytes]:
    """Generate the function from a message to its bytes, header included.

    Raises:
        SerializationError: There is a field of a type without CDR encoding here.
    """
    return _Writer().generate(definition)


class _Writer:
    def __init__(self) -> None:
        self.source = Source('def write(message):')
        self.run: list[tuple[str, str]] = []

    def generate(self, definition: MessageDefinition) -> Callable[[Any], bytes]:
        self.source.add(r"buffer = bytearray(b'\0\1\0\0')")
        self.source.names['require_length'] = _require_length
        self.source.names['require_class'] = _require_class
        self.message(definition, 'message')
        self.flush()
        self.source.add('return bytes(buffer)')
        write: Callable[[Any], bytes] = self.source.compile(
            'write', f'CDR writer of {definition.type_name}'
        )
        return write

    def message(self, definition: MessageDefinition, variable: str) -> None:
        if not definition.fields:
            self.run.append(('B', '0'))
        for field in definition.fields:
            value = f'{variable}._{field.name}'
            if field.type.is_single:
                self.single(field, value)
            else:
                self.several(field, value)

    def single(self, field: Field, value: str) -> None:
        base = field.type.base
        if base in STRINGS:
            self.string(field, value)
        elif field.type.is_message:
            nested = self.source.fresh('m')
            self.source.add(f'{nested} = {value}')
            self.message(load(base)._definition, nested)
        else:
            self.run.append((CODES[base], value))

    def string(self, field: Field, value: str) -> None:
        if field.type.base == 'wstring':
            raise SerializationError(f'field {field.name!r} is a wstring, which is not supported')
        encoded = self.source.fresh('s')
        self.source.add(f'{encoded} = {value}.encode()')
        self.run.append(('I', f'len({encoded}) + 1'))
        self.flush()
        self.source.add(f'buffer += {encoded}')
        self.source.add(r"buffer += b'\0'")

    def several(self, field: Field, value: str) -> None:
        kind = field.type
        values = self.source.fresh('v')
        self.source.add(f'{values} = {value}')
        if kind.is_array and kind.base not in TYPE_CODES:
            self.source.add(f'if len({values}) != {kind.size}:')
            self.source.add(f'    require_length({field.name!r}, {values}, {kind.size})')
        elif kind.is_sequence:
            self.run.append(('I', f'len({values})'))
        self.flush()
        if kind.base in TYPE_CODES:
            self.numbers(field, values)
        elif kind.base == 'bool':
            self.source.add(f'buffer += bytes(map(bool, {values}))')
        elif kind.base == 'byte':
            joined = self.source.fresh('b')
            self.source.add(f"{joined} = b''.join({values})")
            self.source.add(f'if len({joined}) != len({values}):')
            self.source.add(f'    require_length({field.name!r}, {joined}, len({values}))')
            self.source.add(f'buffer += {joined}')
        else:
            self.elements(field, values)

    def numbers(self, field: Field, values: str) -> None:
        size = SIZES[TYPE_CODES[field.type.base]]
        padding = self.source.refer('padding', _PADDING[size])
        if field.type.is_array:
            self.source.add(f'buffer += {padding}[(len(buffer) - 4) & 7]')
            self.source.add(f'buffer += {values}.tobytes()')
            return
        with self.source.block(f'if {values}:'):
            if size > 4:  # after the length, all others are aligned
                self.source.add(f'buffer += {padding}[(len(buffer) - 4) & 7]')
            self.source.add(f'buffer += {values}')

    def elements(self, field: Field, values: str) -> None:
        element = self.source.fresh('e')
        with self.source.block(f'for {element} in {values}:'):
            if field.type.base in STRINGS:
                self.string(field, element)
            else:
                cls = load(field.type.base)
                name = self.source.refer('class', cls)
                self.source.add(f'if not isinstance({element}, {name}):')
                self.source.add(f'    require_class({field.name!r}, {element}, {name})')
                self.message(cls._definition, element)
            self.flush()

    def flush(self) -> None:
        if not self.run:
            return
        structs = run_structs(''.join(code for code, _ in self.run), '<')
        pack = self.source.refer('pack', tuple(item.pack for item in structs))
        values = ', '.join(value for _, value in self.run)
        self.source.add(f'buffer += {pack}[len(buffer) & 7]({values})')
        self.run.clear()


def _require_length(name: str, values: Any, size: int) -> None:
    raise SerializationError(f'field {name!r} holds {len(values)} values; expected {size}')


def _require_class(name: str, value: Any, cls: type[Any]) -> None:
    raise SerializationError(
        f'field {name!r} holds a {type(value).__name__}; expected {cls.__module__}.{cls.__name__}'
    )
