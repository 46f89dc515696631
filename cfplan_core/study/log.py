"""The rows of a study on disk: there as soon as a run has ended, whatever happens next."""

from __future__ import annotations

import csv
import fcntl
import io
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from types import TracebackType

from cfplan_core.errors import CfplanError
from cfplan_core.study.record import COLUMNS, Record, cells_of, record_from

_HEADER = ','.join(COLUMNS)


class StudyLog:
    """A CSV file of records that one process at a time appends to.

    A row that was being written when the process or the machine stopped is dropped when the file
    is opened again: it is the last one.

    Args:
        path: Of the file; it and its folder are made if missing.

    Attributes:
        path: Of the file.
        records: By the run's key. Of runs that are in the file twice the later one counts.

    Raises:
        CfplanError: The file is no study's, damaged, or in use by another process.
        OSError: The file cannot be opened or written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        path.parent.mkdir(parents=True, exist_ok=True)
        self._stream = path.open('a+b')
        try:
            self._lock()
            self.records = {record.key: record for record in self._read()}
        except BaseException:
            self._stream.close()
            raise

    def __enter__(self) -> StudyLog:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def append(self, record: Record) -> None:
        """Write a record; it is on disk when this returns."""
        self._write(_line(cells_of(record)))
        self.records[record.key] = record

    def forget(self, keys: Iterable[str]) -> None:
        """Take runs as not done; the rows that they get next replace those that they have."""
        for key in list(keys):
            self.records.pop(key, None)

    def sort(self) -> None:
        """Put the rows in the order of their parameters, each run once; the file stays whole."""
        text = sorted_text(self.records.values())
        self._stream.seek(0)
        if self._stream.read() == text:
            return
        temporary = self.path.with_name(f'.{self.path.name}.{os.getpid()}.tmp')
        try:
            with open(temporary, 'xb') as stream:
                stream.write(text)
                stream.flush()
                os.fsync(stream.fileno())
            os.replace(temporary, self.path)
        finally:
            temporary.unlink(missing_ok=True)

    def close(self) -> None:
        """Let go of the file."""
        self._stream.close()

    def _lock(self) -> None:
        try:
            fcntl.flock(self._stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise CfplanError(f'{self.path}: is in use by another study') from None

    def _read(self) -> list[Record]:
        self._stream.seek(0)
        data = self._stream.read()
        # What was not written to its end.
        whole = data[: data.rfind(b'\n') + 1]
        lines = whole.decode('utf-8', errors='replace').splitlines()
        if not lines:
            if not _HEADER.encode().startswith(data):
                raise self._foreign(data.decode('utf-8', errors='replace'))
            self._stream.truncate(0)
            self._write(_HEADER + '\n')
            return []
        if lines[0] != _HEADER:
            raise self._foreign(lines[0])
        records = []
        for number, cells in enumerate(csv.reader(lines[1:]), 2):
            try:
                records.append(record_from(cells))
            except CfplanError as error:
                # After a power cut the last block of a file may hold anything.
                if number < len(lines):
                    raise CfplanError(f'{self.path}: line {number}: {error}') from None
                whole = whole[: whole.rfind(b'\n', 0, -1) + 1]
        if len(whole) < len(data):
            self._stream.truncate(len(whole))
            os.fsync(self._stream.fileno())
        return records

    def _foreign(self, found: str) -> CfplanError:
        return CfplanError(
            f'{self.path}: got {found[:40]!r} in line 1, expected the columns of a study: '
            f'{_HEADER}'
        )

    def _write(self, text: str) -> None:
        self._stream.write(text.encode())
        self._stream.flush()
        os.fsync(self._stream.fileno())


def sorted_text(records: Iterable[Record]) -> bytes:
    """Write records as a CSV file in the order of their parameters."""
    rows = sorted(records, key=lambda record: record.order)
    return ''.join([_HEADER + '\n', *(_line(cells_of(row)) for row in rows)]).encode()


def _line(cells: Sequence[str]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator='\n').writerow(cells)
    return text.getvalue()
