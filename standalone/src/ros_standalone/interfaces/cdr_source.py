"""What the generated functions that write and read CDR have in common.

Consecutive numbers, also across nested messages, form a *run* that one ``struct.Struct`` packs.
The padding inside a run depends on where it starts modulo 8, so a run has eight of them.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from ros_standalone.interfaces.field_checks import TYPE_CODES

HEADER_SIZE = 4
"""Bytes of the encapsulation header, after which alignment counts from zero."""

SIZES = {code: struct.calcsize(f'={code}') for code in (*TYPE_CODES.values(), '?', 'c')}
CODES = {**TYPE_CODES, 'bool': '?', 'byte': 'c'}
"""Single primitive values with their codes in the module struct."""


def run_structs(codes: str, byte_order: str) -> tuple[struct.Struct, ...]:
    """The layouts of a run of numbers, by the position of its start modulo 8.

    Args:
        codes: One code of the module struct for each number.
        byte_order: ``<`` or ``>``.
    """
    return tuple(_aligned(codes, byte_order, start) for start in range(8))


def _aligned(codes: str, byte_order: str, start: int) -> struct.Struct:
    layout = byte_order
    position = (start - HEADER_SIZE) % 8
    for code in codes:
        padding = -position % SIZES[code]
        layout += f'{padding}x{code}' if padding else code
        position += padding + SIZES[code]
    return struct.Struct(layout)


class Source:
    """The text of a function in the making, and the objects that it refers to."""

    def __init__(self, head: str) -> None:
        self.names: dict[str, Any] = {}
        self._lines = [head]
        self._depth = 1
        self._count = 0

    def add(self, line: str) -> None:
        """Append a line."""
        self._lines.append('    ' * self._depth + line)

    def fresh(self, prefix: str) -> str:
        """A variable name that is not in use."""
        self._count += 1
        return f'{prefix}{self._count}'

    def refer(self, prefix: str, value: Any) -> str:
        """A name by which the function finds an object."""
        name = self.fresh(prefix)
        self.names[name] = value
        return name

    @contextmanager
    def block(self, head: str) -> Iterator[None]:
        """Lines added inside are indented under ``head``."""
        self.add(head)
        self._depth += 1
        yield
        self._depth -= 1

    def compile(self, name: str, title: str) -> Any:
        """The function, whose name is ``name``; tracebacks show ``title`` as its file."""
        exec(compile('\n'.join(self._lines), f'<{title}>', 'exec'), self.names)
        return self.names[name]
