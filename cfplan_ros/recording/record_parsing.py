"""Reads single MCAP records, and only those that are what was written as far as can be told."""

from __future__ import annotations

import io
import struct
import zlib
from typing import Any

from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Chunk, McapRecord, Message
from mcap.stream_reader import CRCValidationError, breakup_chunk
from zstandard import ZstdError

PREFIX = struct.Struct('<BQ')
"""Opcode and length, bytes, of what follows."""

# Times of the first and last message, length and checksum of the records, length of a name.
_CHUNK_HEAD = struct.Struct('<QQQII')
_CHUNK_REST = _CHUNK_HEAD.size + 8
_LONGEST_NAME = 16

# What mcap and its decompressors raise for data that is no longer what was written.
_DAMAGE = (
    McapError,
    CRCValidationError,
    ZstdError,
    struct.error,
    ValueError,
    OverflowError,
    MemoryError,
    RuntimeError,
)
_TYPES: dict[int, Any] = {
    Opcode.HEADER: records.Header,
    Opcode.FOOTER: records.Footer,
    Opcode.SCHEMA: records.Schema,
    Opcode.CHANNEL: records.Channel,
    Opcode.CHUNK: Chunk,
    Opcode.MESSAGE_INDEX: records.MessageIndex,
    Opcode.CHUNK_INDEX: records.ChunkIndex,
    Opcode.ATTACHMENT: Attachment,
    Opcode.ATTACHMENT_INDEX: records.AttachmentIndex,
    Opcode.STATISTICS: records.Statistics,
    Opcode.METADATA: records.Metadata,
    Opcode.METADATA_INDEX: records.MetadataIndex,
    Opcode.SUMMARY_OFFSET: records.SummaryOffset,
    Opcode.DATA_END: records.DataEnd,
}
KNOWN = frozenset({*_TYPES, Opcode.MESSAGE})


def parse(opcode: int, content: bytes) -> McapRecord | None:
    """Read a record.

    Args:
        opcode: One of `KNOWN`.
        content: What follows the prefix.

    Returns:
        The record; None if it does not fill the content exactly, or fails its checksum.
    """
    stream = ReadDataStream(_Whole(content))
    try:
        record: McapRecord
        if opcode == Opcode.MESSAGE:
            record = Message.read(stream, len(content))
        else:
            record = _TYPES[opcode].read(stream)
    except _DAMAGE:
        return None
    if stream.count != len(content):
        return None
    if isinstance(record, Attachment):
        (checksum,) = struct.unpack('<I', content[-4:])
        if checksum not in (0, zlib.crc32(content[:-4])):
            return None
    return record


def chunk_length(head: bytes) -> int | None:
    """Length of a chunk's content by what its fields say, bytes; None if it is no chunk.

    Args:
        head: The first bytes of the content, 52 if there are as many.
    """
    try:
        name: int = _CHUNK_HEAD.unpack_from(head)[-1]
        if name > _LONGEST_NAME:
            return None
        data: int = struct.unpack_from('<Q', head, _CHUNK_HEAD.size + name)[0]
    except struct.error:
        return None
    return _CHUNK_REST + name + data


def contents_of(chunk: Chunk) -> list[McapRecord] | None:
    """Schemas, channels and messages of a chunk; None if it fails its checksum."""
    try:
        return breakup_chunk(chunk, validate_crc=True)
    except _DAMAGE:
        return None


class _Whole(io.BytesIO):
    """Refuses to read less than is asked for."""

    def read(self, size: int | None = -1, /) -> bytes:
        data = super().read(size)
        if size is not None and len(data) < size:
            raise EndOfFile
        return data
