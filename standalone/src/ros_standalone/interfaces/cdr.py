"""Messages to bytes and back: CDR as ROS 2 puts it on the wire, with its 4-byte header.

The encoding is XCDR1 of the DDS-XTypes standard (plain CDR): values are aligned to their own size,
8 at most, counted from the end of the header.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any, TypeVar

from ros_standalone.interfaces.cdr_reader import reader_for
from ros_standalone.interfaces.cdr_source import HEADER_SIZE
from ros_standalone.interfaces.cdr_writer import writer_for
from ros_standalone.interfaces.classes import Message
from ros_standalone.interfaces.errors import SerializationError

MessageT = TypeVar('MessageT')

_BYTE_ORDERS = {b'\x00\x00': '>', b'\x00\x01': '<'}
_OTHER_REPRESENTATIONS = {
    2: 'a parameter list',
    3: 'a parameter list',
    6: 'XCDR2',
    7: 'XCDR2',
    8: 'XCDR2, delimited',
    9: 'XCDR2, delimited',
    10: 'an XCDR2 parameter list',
    11: 'an XCDR2 parameter list',
}

_writers: dict[type[Any], Callable[[Any], bytes]] = {}
_readers: dict[tuple[type[Any], str], Callable[[bytes], Any]] = {}


def serialize(message: Any) -> bytes:
    """Write a message as little-endian CDR.

    Raises:
        TypeError: It is no message.
        SerializationError: A field holds what it must not, as when a wrong value was appended to a
            list.
    """
    message_class = type(message)
    write = _writers.get(message_class) or _make_writer(message_class)
    try:
        return write(message)
    except SerializationError as error:
        raise SerializationError(f'cannot serialize {_name(message_class)}: {error}') from None
    except (AttributeError, OverflowError, TypeError, ValueError, struct.error) as error:
        reason = _wrong_field(message) or str(error)
        raise SerializationError(f'cannot serialize {_name(message_class)}: {reason}') from None


def deserialize(data: bytes | bytearray | memoryview, message_class: type[MessageT]) -> MessageT:
    """Read a message from CDR of either byte order. Bytes after its end are ignored.

    Args:
        data: The bytes, header included.
        message_class: What to make of them.

    Raises:
        TypeError: The class is no message class.
        SerializationError: The data ends too early or is not plain CDR.
    """
    if not isinstance(data, bytes):
        data = bytes(data)
    byte_order = _BYTE_ORDERS.get(data[:2])
    if byte_order is None or len(data) < HEADER_SIZE:
        raise SerializationError(
            f'cannot read {_name(message_class)}: expected a header of plain CDR, '
            f'00 00 or 00 01 and two more bytes, got {_describe_header(data)}'
        )
    read = _readers.get((message_class, byte_order)) or _make_reader(message_class, byte_order)
    try:
        message: MessageT = read(data)
    except (SerializationError, struct.error) as error:
        raise SerializationError(
            f'cannot read {_name(message_class)}: the data ends too early, after '
            f'{len(data)} bytes ({error})'
        ) from None
    return message


def _make_writer(message_class: type[Any]) -> Callable[[Any], bytes]:
    _require_message_class(message_class)
    write = writer_for(message_class._definition)
    return _writers.setdefault(message_class, write)


def _make_reader(message_class: type[Any], byte_order: str) -> Callable[[bytes], Any]:
    _require_message_class(message_class)
    read = reader_for(message_class._definition, byte_order)
    return _readers.setdefault((message_class, byte_order), read)


def _require_message_class(message_class: Any) -> None:
    if not (isinstance(message_class, type) and issubclass(message_class, Message)):
        raise TypeError(f'expected a message class, got {message_class!r}')


def _name(message_class: type[Any]) -> str:
    return str(message_class._definition.type_name)


def _describe_header(data: bytes) -> str:
    header = data[:HEADER_SIZE].hex(' ') or 'no bytes'
    if len(data) < HEADER_SIZE:
        return header
    other = _OTHER_REPRESENTATIONS.get(data[1]) if data[0] == 0 else None
    return f'{header}, {other}' if other else header


def _wrong_field(message: Any, path: str = '') -> str:
    """What is wrong with the first field that its own check refuses; empty if none is."""
    for name in message.get_fields_and_field_types():
        value = getattr(message, name)
        try:
            setattr(message, name, value)
        except AssertionError as error:
            return f'{path}{name}: {error}'
        nested = value if isinstance(value, (list, tuple)) else [value]
        for index, item in enumerate(nested):
            if isinstance(item, Message):
                place = f'{name}[{index}]' if nested is value else name
                wrong = _wrong_field(item, f'{path}{place}.')
                if wrong:
                    return wrong
    return ''
