"""An MCAP file in the making: what is flushed outlives its writer, what is complete is renamed."""

from __future__ import annotations

import errno
import fcntl
import io
import os
import shutil
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from rclpy.qos import QoSProfile

from cfplan_ros.recording.message_writer import MessageWriter

PART = '.part'

_BUFFER_SIZE = 1 << 20
_NO_SPACE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL, errno.EBADF)


class RunFile:
    """Writes ``<name>.part``, which becomes ``<name>`` when it is closed.

    An advisory lock marks the part as in use for as long as its writer lives. Every method may
    raise OSError; after that only `abandon` is of use.

    Args:
        paths: Names to try, best first; the first that nobody else uses is taken.
    """

    def __init__(self, paths: Iterable[Path]) -> None:
        self.path, descriptor = _create(paths)
        self.part = part_of(self.path)
        self._kept = 0
        self._stream = io.BufferedWriter(io.FileIO(descriptor, 'wb'), _BUFFER_SIZE)
        self._writer = MessageWriter(self._stream)

    @property
    def empty(self) -> bool:
        """True until something has been flushed."""
        return self._kept == 0

    @property
    def deleted(self) -> bool:
        """True if somebody has removed the file while it is being written."""
        return os.fstat(self._stream.fileno()).st_nlink == 0

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Add a record of names and values."""
        self._writer.add_metadata(name, dict(values))

    def add(self, topic: str, message: Any, time_ns: int, qos: QoSProfile) -> None:
        """Add a message, as with `MessageWriter.add`; the next flush takes it to the file."""
        self._writer.add(topic, message, time_ns, qos)

    def flush(self) -> None:
        """Hand everything added so far to the operating system: it survives this process."""
        self._writer.flush()
        self._kept = self._stream.tell()

    def sync(self) -> None:
        """Flush and wait until the disk holds it: it survives the machine."""
        self.flush()
        os.fsync(self._stream.fileno())

    def close(self) -> None:
        """Write the index, and put the file in place under its name."""
        self.flush()
        self._writer.finish()
        os.fsync(self._stream.fileno())
        os.rename(self.part, self.path)
        self._stream.close()
        sync_directory(self.path.parent)

    def abandon(self) -> None:
        """Close after an error, keeping what was flushed before it; never raises."""
        raw = self._stream.raw
        with suppress(OSError):
            os.ftruncate(raw.fileno(), self._kept)
        if self.empty:
            with suppress(OSError):
                self.part.unlink()
        # Past the buffer, which would try once more to write what the disk did not take.
        with suppress(OSError):
            raw.close()


def part_of(path: Path) -> Path:
    """Name of a file while it is being written."""
    return path.with_name(path.name + PART)


def lock(descriptor: int) -> bool | None:
    """Take the lock that says that a file is being written, without waiting.

    Returns:
        True if it was free, False if another process or file object holds it, None where the
        file system has no locks. The kernel releases it when the file is closed, also by death.
    """
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in _NO_LOCKS:
            return None
        if error.errno in (errno.EWOULDBLOCK, errno.EACCES):
            return False
        raise
    return True


def same_file(path: Path, descriptor: int) -> bool:
    """Say whether a path still leads to the file that was opened."""
    try:
        return os.path.samestat(os.stat(path), os.fstat(descriptor))
    except FileNotFoundError:
        return False


def sync_directory(directory: Path) -> None:
    """Wait until the disk holds the names of a directory's files."""
    descriptor = os.open(directory, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        # Not every file system can do this for a directory.
        if error.errno not in (errno.EINVAL, errno.EOPNOTSUPP, errno.EBADF):
            raise
    finally:
        os.close(descriptor)


def failure_reason(error: OSError, path: Path) -> str:
    """Say which file the system refused to write and why, with the space left if that is it."""
    reason = f'{error.filename or path}: {error.strerror or error}'
    if error.errno in _NO_SPACE:
        with suppress(OSError):
            reason += f' ({shutil.disk_usage(path.parent).free} bytes free)'
    return reason


def _create(paths: Iterable[Path]) -> tuple[Path, int]:
    """Create and lock the part of the first path that is free; return path and descriptor."""
    for path in paths:
        part = part_of(path)
        try:
            descriptor = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
        except FileExistsError:
            continue
        try:
            # Another process may have completed a run of this name, or have taken the new part
            # for one that was left over.
            if lock(descriptor) is not False and same_file(part, descriptor):
                if not path.exists():
                    return path, descriptor
                part.unlink()
        except OSError:
            os.close(descriptor)
            raise
        os.close(descriptor)
    raise FileExistsError(errno.EEXIST, 'no file name is free', str(path))
