"""What can be read of an MCAP file whose writer died, or that was damaged since."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    Channel,
    Chunk,
    DataEnd,
    McapRecord,
    Message,
    MessageIndex,
    Metadata,
    Schema,
)
from mcap.writer import MCAP0_MAGIC

from cfplan_core.errors import CfplanError
from cfplan_ros.recording.file_index import data_checksum, ends_as_complete, read_index
from cfplan_ros.recording.record_parsing import KNOWN, PREFIX, chunk_length, contents_of, parse
from cfplan_ros.recording.wording import counted

_CONTENT = (
    Opcode.HEADER,
    Opcode.METADATA,
    Opcode.ATTACHMENT,
    Opcode.SCHEMA,
    Opcode.CHANNEL,
    Opcode.MESSAGE,
)
_CHUNK_HEAD = 52
_BLOCK = 1 << 20
# Begins a record that is never part of another, and that can be told from what looks like one.
_LANDMARK = re.compile(rb'[\x06\x07\x09\x0c\x0f](?=[\s\S]{5}\x00\x00\x00)')
_NAMED_PLACES = 3


class NotMcapError(CfplanError):
    """A file that should be a recording is something else."""


class IntactRecords:
    """Iterates over the contents of a file as far as they are what was written.

    Yields headers, metadata, attachments, schemas, channels and messages in the order of the
    file, those of chunks included; indexes and summaries are left out. So are chunks that fail
    their checksum; what follows them is read. Where a schema or channel went with a chunk, it is
    taken from the index at the end; without that its messages are left out too.

    The attributes that say what was found are known when an iteration has ended.

    Args:
        file: A seekable binary file.
        path: Its name, for errors.

    Attributes:
        size: Length of the file, bytes.
        kept: How many messages can be read.
        written: How many the file says were written, what was cut off at its end apart.
        dropped: Length of what is torn off at the end, bytes.
        damage: What is damaged, or was lost, but for a torn end, in words.
        complete: True if all that was written is there, with the index.

    Raises:
        NotMcapError: The file does not begin as an MCAP file does.
    """

    def __init__(self, file: BinaryIO, path: Path) -> None:
        self._file = file
        self.size = file.seek(0, os.SEEK_END)
        if self.size == 0:
            raise NotMcapError(f'{path}: the file is empty, expected an MCAP file')
        file.seek(0)
        magic = file.read(len(MCAP0_MAGIC))
        if magic != MCAP0_MAGIC[: self.size]:
            raise NotMcapError(f'{path}: begins with {magic!r}, expected an MCAP file')
        self._ended = ends_as_complete(file, self.size)
        self._index = read_index(file, self.size)
        self._end = self._index.start if self._index else self.size
        self._start()

    def __iter__(self) -> Iterator[McapRecord]:
        self._start()
        schemas, channels = {0}, set()
        for record in self._records():
            if isinstance(record, Message) and record.channel_id not in channels:
                definitions = self._definitions(record.channel_id, schemas)
                if not definitions:
                    self._unread += 1
                    continue
                channels.add(record.channel_id)
                yield from definitions
            elif isinstance(record, Schema):
                schemas.add(record.id)
            elif isinstance(record, Channel):
                if record.schema_id not in schemas:
                    continue
                channels.add(record.id)
            if isinstance(record, Message):
                self.kept += 1
            self._metadata += isinstance(record, Metadata)
            self._attachments += isinstance(record, Attachment)
            yield record
        self._compare()

    def _start(self) -> None:
        self.kept = self.written = self.dropped = 0
        self.damage: tuple[str, ...] = ()
        self.complete = False
        self._places: list[str] = []
        self._single = self._chunked = self._indexed = self._unread = 0
        self._metadata = self._attachments = 0
        self._has_chunks = bool(self._index and self._index.chunks)
        self._checksum_fails = False

    def _definitions(self, channel_id: int, schemas: set[int]) -> list[McapRecord]:
        """Channel of a message, and schema if it is not known, from the index; none without."""
        channel = self._index.channels.get(channel_id) if self._index else None
        if self._index is None or channel is None:
            return []
        if channel.schema_id in schemas:
            return [channel]
        schema = self._index.schemas.get(channel.schema_id)
        if schema is None:
            return []
        schemas.add(schema.id)
        return [schema, channel]

    def _records(self) -> Iterator[McapRecord]:
        """Every record that is whole, chunks broken up."""
        position, at_end = min(len(MCAP0_MAGIC), self.size), False
        while position < self._end and not at_end:
            found = self._at(position)
            if found is None:
                resume = self._landmark(position + 1)
                if resume is None:
                    break
                self._places.append(f'bytes {position} to {resume - 1}')
                position = resume
                continue
            opcode, length, records = found
            for record in records:
                if isinstance(record, MessageIndex):
                    self._indexed += len(record.records)
                elif isinstance(record, DataEnd):
                    checksum = record.data_section_crc
                    self._checksum_fails = checksum not in (
                        0,
                        data_checksum(self._file, position) if checksum else 0,
                    )
            if opcode == Opcode.CHUNK:
                self._has_chunks = True
                self._chunked += sum(isinstance(record, Message) for record in records)
                yield from records
            elif opcode in _CONTENT:
                self._single += opcode == Opcode.MESSAGE
                yield from records
            at_end = opcode in (Opcode.DATA_END, Opcode.FOOTER)
            position += length
        if not at_end and position < self._end:
            if self._index:
                self._places.append(f'bytes {position} to {self._end - 1}')
            else:
                self.dropped = self.size - position

    def _at(self, position: int) -> tuple[int, int, list[McapRecord]] | None:
        """Opcode, length with prefix and contents of the record that begins at a place.

        Returns:
            None if what is there cannot be what was written.
        """
        self._file.seek(position)
        head = self._file.read(min(PREFIX.size + _CHUNK_HEAD, self._end - position))
        if len(head) < PREFIX.size:
            return None
        opcode, length = PREFIX.unpack_from(head)
        # One of opcode and length may be damaged: what is inside has a checksum.
        fields = chunk_length(head[PREFIX.size :])
        if fields is not None and (opcode == Opcode.CHUNK or fields == length):
            records = self._chunk_at(position, fields, opcode == Opcode.CHUNK and fields == length)
            if records is not None:
                return Opcode.CHUNK, PREFIX.size + fields, records
        end = position + PREFIX.size + length
        # A machine that loses power can leave zeros where data should have come.
        if opcode in (0, Opcode.CHUNK) or end > self._end:
            return None
        # No writer mixes the two, and of a message nothing but its chunk has a checksum.
        if opcode == Opcode.MESSAGE and self._has_chunks:
            return None
        if opcode not in KNOWN:
            return (opcode, PREFIX.size + length, []) if self._may_begin(end) else None
        content = self._content(position, length)
        record = parse(opcode, content) if content is not None else None
        return (opcode, PREFIX.size + length, [record]) if record is not None else None

    def _chunk_at(self, position: int, length: int, framed: bool) -> list[McapRecord] | None:
        content = self._content(position, length)
        chunk = parse(Opcode.CHUNK, content) if content is not None else None
        if not isinstance(chunk, Chunk) or not (framed or chunk.uncompressed_crc):
            return None
        records = contents_of(chunk)
        if records is not None and not (framed and self._as_indexed(position, chunk)):
            place = f'the head of the chunk at byte {position}'
            if place not in self._places:
                self._places.append(place)
        return records

    def _as_indexed(self, position: int, chunk: Chunk) -> bool:
        """Say whether a chunk's head, which has no checksum, is as in the index."""
        index = self._index.chunks.get(position) if self._index else None
        return index is None or all(
            getattr(index, name) == getattr(chunk, name)
            for name in (
                'message_start_time',
                'message_end_time',
                'uncompressed_size',
                'compression',
            )
        )

    def _content(self, position: int, length: int) -> bytes | None:
        if position + PREFIX.size + length > self._end:
            return None
        self._file.seek(position + PREFIX.size)
        content = self._file.read(length)
        return content if len(content) == length else None

    def _may_begin(self, position: int) -> bool:
        """Say whether a record, or the index, may begin at a place."""
        if position == self._end:
            return True
        self._file.seek(position)
        head = self._file.read(PREFIX.size)
        if len(head) < PREFIX.size:
            return False
        opcode, length = PREFIX.unpack(head)
        return bool(opcode) and position + PREFIX.size + int(length) <= self._end

    def _landmark(self, position: int) -> int | None:
        """The next place at which a record begins for certain."""
        while position < self._end:
            self._file.seek(position)
            block = self._file.read(min(_BLOCK, self._end - position))
            for match in _LANDMARK.finditer(block):
                if self._at(position + match.start()) is not None:
                    return position + match.start()
            if len(block) < _BLOCK:
                return None
            position += _BLOCK - PREFIX.size
        return None

    def _compare(self) -> None:
        """Hold what was found against what the file says of itself."""
        damage = []
        if self._places:
            places = self._places[:_NAMED_PLACES]
            if len(self._places) > _NAMED_PLACES:
                places.append(counted(len(self._places) - _NAMED_PLACES, 'more place'))
            damage.append(', '.join(places))
        elif self._checksum_fails:
            damage.append('what is no message fails its checksum')
        statistics = self._index.statistics if self._index else None
        self.written = self._single + max(self._chunked, self._indexed)
        if statistics is not None:
            self.written = statistics.message_count
            for thing, found, written in (
                ('message', self.kept, self.written),
                ('metadata record', self._metadata, statistics.metadata_count),
                ('attachment', self._attachments, statistics.attachment_count),
            ):
                if found != written and not (thing == 'message' and damage):
                    damage.append(f'{found} of {counted(written, thing)} found')
        if self._unread:
            damage.append(f'{counted(self._unread)} of topics that were lost')
        if self._ended != (self._index is not None):
            damage.append('the index at the end')
        self.damage = tuple(damage)
        self.complete = self._ended and self._index is not None and not damage
