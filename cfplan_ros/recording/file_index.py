"""The index at the end of an MCAP file, in which its writer says what it has written."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from typing import BinaryIO

from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, Footer, McapRecord, Schema, Statistics
from mcap.writer import MCAP0_MAGIC

from cfplan_ros.recording.record_parsing import KNOWN, PREFIX, parse

_FOOTER_SIZE = 20
_CHECKSUM_SIZE = 4


@dataclass(frozen=True)
class FileIndex:
    """An index that passes its checksum.

    Attributes:
        start: Where it begins in the file, bytes.
        statistics: How much of everything was written; None if the writer did not count.
        schemas: By id; what the writer repeats.
        channels: By id; what the writer repeats.
        chunks: By the place in the file, bytes.
    """

    start: int
    statistics: Statistics | None
    schemas: dict[int, Schema]
    channels: dict[int, Channel]
    chunks: dict[int, ChunkIndex]


def ends_as_complete(file: BinaryIO, size: int) -> bool:
    """Say whether the last bytes are those that end an MCAP file."""
    if size < 2 * len(MCAP0_MAGIC):
        return False
    file.seek(size - len(MCAP0_MAGIC))
    return file.read(len(MCAP0_MAGIC)) == MCAP0_MAGIC


def read_index(file: BinaryIO, size: int) -> FileIndex | None:
    """Read the index of a file.

    Args:
        file: A seekable binary file.
        size: Its length, bytes.

    Returns:
        None if there is no index, or a damaged one.
    """
    footer_start = size - len(MCAP0_MAGIC) - PREFIX.size - _FOOTER_SIZE
    if footer_start < len(MCAP0_MAGIC):
        return None
    file.seek(footer_start)
    data = file.read(PREFIX.size + _FOOTER_SIZE)
    if PREFIX.unpack_from(data) != (Opcode.FOOTER, _FOOTER_SIZE):
        return None
    footer = parse(Opcode.FOOTER, data[PREFIX.size :])
    assert isinstance(footer, Footer)
    start = footer.summary_start or footer_start
    if not len(MCAP0_MAGIC) <= start <= footer_start:
        return None
    file.seek(start)
    summary = file.read(footer_start - start)
    if footer.summary_crc:
        if zlib.crc32(data[:-_CHECKSUM_SIZE], zlib.crc32(summary)) != footer.summary_crc:
            return None
    elif not ends_as_complete(file, size):
        return None
    found = _records(summary)
    if found is None:
        return None
    return FileIndex(
        start,
        next((record for record in found if isinstance(record, Statistics)), None),
        {record.id: record for record in found if isinstance(record, Schema)},
        {record.id: record for record in found if isinstance(record, Channel)},
        {record.chunk_start_offset: record for record in found if isinstance(record, ChunkIndex)},
    )


def data_checksum(file: BinaryIO, end: int) -> int:
    """CRC-32 of a file's first bytes, as the end of its data section gives it."""
    file.seek(0)
    checksum = 0
    while end > 0:
        block = file.read(min(end, 1 << 20))
        if not block:
            break
        checksum = zlib.crc32(block, checksum)
        end -= len(block)
    return checksum


def _records(data: bytes) -> list[McapRecord] | None:
    """What an index holds; None if it does not consist of records."""
    found: list[McapRecord] = []
    position = 0
    while position < len(data):
        if position + PREFIX.size > len(data):
            return None
        opcode, length = PREFIX.unpack_from(data, position)
        position += PREFIX.size
        if position + length > len(data):
            return None
        if opcode in KNOWN:
            record = parse(opcode, data[position : position + length])
            if record is None:
                return None
            found.append(record)
        position += length
    return found
