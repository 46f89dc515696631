"""What can be read of an MCAP file whose writer died: every record up to the first torn one."""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, McapRecord, Message, Schema
from mcap.stream_reader import CRCValidationError, StreamReader, breakup_chunk
from mcap.writer import MCAP0_MAGIC
from zstandard import ZstdError

from cfplan_core.errors import CfplanError

_PREFIX = struct.Struct('<BQ')
_CONTENT = (
    Opcode.HEADER,
    Opcode.METADATA,
    Opcode.ATTACHMENT,
    Opcode.SCHEMA,
    Opcode.CHANNEL,
    Opcode.MESSAGE,
    Opcode.CHUNK,
)
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


class NotMcapError(CfplanError):
    """A file that should be a recording is something else."""


class IntactRecords:
    """Iterates over the contents of a file as far as they were written.

    Yields headers, metadata, attachments, schemas, channels and messages in the order of the
    file, those of chunks included; indexes and summaries are left out. So is what nobody could
    read: channels whose schema, and messages whose channel, was in a damaged chunk.

    Args:
        file: A seekable binary file.
        path: Its name, for errors.

    Attributes:
        size: Length of the file, bytes.
        intact: Length up to the first torn record, bytes; known when the iteration has ended.
        complete: True if the file ends with the index that its writer put there; known then too.
        damaged_chunks: How many chunks before that fail their checksum and were left out.

    Raises:
        NotMcapError: The file does not begin as an MCAP file does.
    """

    def __init__(self, file: BinaryIO, path: Path) -> None:
        self._file = file
        self.size = file.seek(0, os.SEEK_END)
        self.intact = 0
        self.complete = False
        self.damaged_chunks = 0
        if self.size == 0:
            raise NotMcapError(f'{path}: the file is empty, expected an MCAP file')
        file.seek(0)
        magic = file.read(len(MCAP0_MAGIC))
        if magic != MCAP0_MAGIC[: self.size]:
            raise NotMcapError(f'{path}: begins with {magic!r}, expected an MCAP file')

    def __iter__(self) -> Iterator[McapRecord]:
        schemas, channels = {0}, set()
        for record in self._records():
            if isinstance(record, Schema):
                schemas.add(record.id)
            elif isinstance(record, Channel):
                if record.schema_id not in schemas:
                    continue
                channels.add(record.id)
            elif isinstance(record, Message) and record.channel_id not in channels:
                continue
            yield record

    def _records(self) -> Iterator[McapRecord]:
        for opcode, start in self._frames():
            if opcode not in _CONTENT:
                continue
            self._file.seek(start)
            try:
                # Reads this one record; a chunk's contents are checked before any is used.
                record = next(iter(StreamReader(self._file, True, emit_chunks=True).records))
                records = [record]
                if isinstance(record, Chunk):
                    records = breakup_chunk(record, validate_crc=True)
            except _DAMAGE:
                self.damaged_chunks += 1
            else:
                yield from records

    def _frames(self) -> Iterator[tuple[int, int]]:
        """Opcode and start of every record that lies inside the file as a whole."""
        self.intact = min(len(MCAP0_MAGIC), self.size)
        while self.intact + _PREFIX.size <= self.size:
            self._file.seek(self.intact)
            opcode, length = _PREFIX.unpack(self._file.read(_PREFIX.size))
            end = self.intact + _PREFIX.size + length
            # A machine that loses power can leave zeros where data should have come.
            if opcode == 0 or end > self.size:
                return
            yield opcode, self.intact
            self.intact = end
            if opcode == Opcode.FOOTER:
                self._file.seek(end)
                self.complete = self._file.read(len(MCAP0_MAGIC)) == MCAP0_MAGIC
                self.intact = self.size if self.complete else end
                return
