"""Generates, for a message class, the function that reads it from XCDR1."""

from __future__ import annotations

import array
import sys
from collections.abc import Callable
from typing import Any

from ros_standalone.interfaces.cdr_source import (
    CODES,
    HEADER_SIZE,
    SIZES,
    Source,
    run_structs,
)
from ros_standalone.interfaces.classes import load
from ros_standalone.interfaces.definitions import STRINGS, Field, MessageDefinition
from ros_standalone.interfaces.errors import SerializationError
from ros_standalone.interfaces.field_checks import TYPE_CODES


def reader_for(definition: MessageDefinition, byte_order: str) -> Callable[[bytes], Any]:
    """Generate the function from bytes, header included, to a message.

    Args:
        definition: Of the message.
        byte_order: ``<`` or ``>``.

    Raises:
        SerializationError: There is a field of a type without CDR encoding here.
    """
    return _Reader(byte_order).generate(definition)


class _Reader:
    def __init__(self, byte_order: str) -> None:
        self.byte_order = byte_order
        self.is_swapped = (byte_order == '<') != (sys.byteorder == 'little')
        self.source = Source('def read(data):')
        self.run: list[tuple[str, str]] = []

    def generate(self, definition: MessageDefinition) -> Callable[[bytes], Any]:
        self.source.names.update(new=object.__new__, array=array.array, short=_short)
        self.source.add(f'position, end = {HEADER_SIZE}, len(data)')
        self.source.add('view = memoryview(data)')
        message = self.message(definition)
        self.flush()
        self.source.add(f'return {message}')
        read: Callable[[bytes], Any] = self.source.compile(
            'read', f'CDR reader of {definition.type_name}'
        )
        return read

    def message(self, definition: MessageDefinition) -> str:
        cls = self.source.refer('class', load(definition.type_name))
        variable = self.source.fresh('m')
        self.source.add(f'{variable} = new({cls})')
        if not definition.fields:
            self.run.append(('B', self.source.fresh('unused')))
        for field in definition.fields:
            target = f'{variable}._{field.name}'
            if field.type.is_single:
                self.single(field, target)
            else:
                self.several(field, target)
        return variable

    def single(self, field: Field, target: str) -> None:
        base = field.type.base
        if base in STRINGS:
            self.string(field, target)
        elif field.type.is_message:
            nested = self.message(load(base)._definition)
            self.source.add(f'{target} = {nested}')
        else:
            self.run.append((CODES[base], target))

    def string(self, field: Field, target: str) -> None:
        if field.type.base == 'wstring':
            raise SerializationError(f'field {field.name!r} is a wstring, which is not supported')
        size = self.source.fresh('n')
        self.run.append(('I', size))
        self.flush()
        stop = self.stop(size)
        self.source.add(f"{target} = str(view[position:{stop} - 1], 'utf-8', 'replace')")
        self.source.add(f'position = {stop}')

    def stop(self, size: str) -> str:
        """Add lines that find where ``size`` bytes end, and refuse data that ends before."""
        stop = self.source.fresh('stop')
        self.source.add(f'{stop} = position + {size}')
        self.source.add(f'if {stop} > end:')
        self.source.add(f'    short({stop}, end)')
        return stop

    def several(self, field: Field, target: str) -> None:
        kind = field.type
        if kind.is_array:
            size = str(kind.size)
        else:
            size = self.source.fresh('n')
            self.run.append(('I', size))
        self.flush()
        if kind.base in TYPE_CODES:
            self.numbers(field, target, size)
            return
        if kind.base in ('bool', 'byte'):
            stop = self.stop(size)
            if kind.base == 'bool':
                self.source.add(f'{target} = list(map(bool, view[position:{stop}]))')
            else:
                self.source.add(f'{target} = [data[i : i + 1] for i in range(position, {stop})]')
            self.source.add(f'position = {stop}')
            return
        self.elements(field, target, size)

    def numbers(self, field: Field, target: str, count: str) -> None:
        kind = field.type
        size = SIZES[TYPE_CODES[kind.base]]
        if kind.is_array:
            self.align(size)
            stop = self.stop(f'{count} * {size}')
            self.source.names['frombuffer'] = _numpy_frombuffer()
            dtype = f'{self.byte_order}{TYPE_CODES[kind.base]}'
            if TYPE_CODES[kind.base] in 'qQ':
                dtype = f'{self.byte_order}{"i" if kind.base[0] == "i" else "u"}8'
            self.source.add(
                f'{target} = frombuffer(data, {dtype!r}, {count}, position).astype({kind.base!r})'
            )
            self.source.add(f'position = {stop}')
            return
        numbers = self.source.fresh('a')
        self.source.add(f'{numbers} = array({TYPE_CODES[kind.base]!r})')
        with self.source.block(f'if {count}:'):
            if size > 4:  # after the length, all others are aligned
                self.align(size)
            stop = self.stop(f'{count} * {size}')
            self.source.add(f'{numbers}.frombytes(view[position:{stop}])')
            if self.is_swapped:
                self.source.add(f'{numbers}.byteswap()')
            self.source.add(f'position = {stop}')
        self.source.add(f'{target} = {numbers}')

    def align(self, size: int) -> None:
        if size > 1:
            self.source.add(f'position += -(position - {HEADER_SIZE}) % {size}')

    def elements(self, field: Field, target: str, count: str) -> None:
        items = self.source.fresh('items')
        self.source.add(f'{items} = []')
        self.stop(count)  # an element has a byte at least: refuse absurd numbers at once
        with self.source.block(f'for _ in range({count}):'):
            if field.type.base in STRINGS:
                item = self.source.fresh('s')
                self.string(field, item)
            else:
                item = self.message(load(field.type.base)._definition)
            self.flush()
            self.source.add(f'{items}.append({item})')
        self.source.add(f'{target} = {items}')

    def flush(self) -> None:
        if not self.run:
            return
        structs = run_structs(''.join(code for code, _ in self.run), self.byte_order)
        unpack = self.source.refer('unpack', tuple(item.unpack_from for item in structs))
        sizes = self.source.refer('size', tuple(item.size for item in structs))
        targets = ', '.join(target for _, target in self.run)
        self.source.add('phase = position & 7')
        self.source.add(f'{targets}, = {unpack}[phase](data, position)')
        self.source.add(f'position += {sizes}[phase]')
        self.run.clear()


def _short(stop: int, end: int) -> None:
    raise SerializationError(f'expected {stop} bytes or more, got {end}')


def _numpy_frombuffer() -> Callable[..., Any]:
    from numpy import frombuffer

    return frombuffer
