"""Records runs. Trouble with the disk is reported, never raised: a plan is answered regardless."""

from __future__ import annotations

import errno
import io
import os
import shutil
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from datetime import datetime, timezone
from itertools import count
from pathlib import Path
from typing import Any

from cfplan_ros.recording.message_writer import MessageWriter
from cfplan_ros.recording.provenance import RECORD, provenance
from cfplan_ros.recording.recovery import recover_left_over
from cfplan_ros.recording.rewriting import Preview
from cfplan_ros.recording.run_file import RunFile, failure_reason, sync_directory
from cfplan_ros.recording.topics import (
    ESSENTIAL,
    PREVIEW,
    REQUEST,
    RESPONSE,
    full_name,
    qos_by_topic,
)

_ATTEMPTS = 10_000


class Recorder:
    """Writes one file for each run into a directory that several nodes may share.

    Files are named ``run_<UTC time>_<counter>.mcap``. The directory is created when it is
    needed. Different runs may be written by different threads at the same time.

    Args:
        directory: Where the files go.
        node_name: Fully qualified name of the node, e.g. ``/cfplan_planner``.
        log: Takes a line on what happened to runs that were left over, e.g. a logger's ``warn``.

    Raises:
        PackageNotFoundError, OSError: The interface files of a recorded type are not installed.
    """

    def __init__(
        self, directory: str | os.PathLike[str], node_name: str, log: Callable[[str], object]
    ) -> None:
        self.directory = Path(directory)
        self.node_name = node_name
        self._log = log
        self._counter = count(1)
        self._state = threading.Lock()
        self._last_file = ''
        self._last_failure = ''
        self._qos = qos_by_topic(node_name)
        _rehearse(node_name)

    @property
    def last_file(self) -> str:
        """Name of the last file that was begun; empty before the first."""
        return self._last_file

    @property
    def last_failure(self) -> str:
        """Why the last run that could not be recorded was not; empty if none failed."""
        return self._last_failure

    def free_space(self) -> int | None:
        """Bytes that the disk of the directory has left, or None if there is no directory."""
        try:
            return shutil.disk_usage(self.directory).free
        except OSError:
            return None

    def begin(self, request: Any, metadata: Mapping[str, object], start_time_ns: int) -> Run:
        """Start the file of a run with its request, on its way to the disk when this returns.

        Args:
            request: Of type ``PlanManipulation.Request``.
            metadata: See `provenance`.
            start_time_ns: The node's time, ns since the epoch; log time of the request.

        Returns:
            The run; if it cannot be recorded, one with a `Run.failure` that ignores all messages.
        """
        run = Run(self)
        run._begin(request, metadata, start_time_ns)
        return run

    def recover_left_over(self, preview: Preview | None = None) -> list[Path]:
        """Complete the files of the directory whose writer died, and log what came of each.

        Args:
            preview: Gives what viewers are shown, for runs that ended before that was written.

        Returns:
            The completed files.
        """
        return recover_left_over(self.directory, preview, self._log)

    def _create(self) -> RunFile:
        try:
            self.directory.mkdir(parents=True, exist_ok=True)
        except FileExistsError:
            raise NotADirectoryError(
                errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(self.directory)
            ) from None
        file = RunFile(self._names())
        with self._state:
            self._last_file = file.path.name
        return file

    def _names(self) -> Iterator[Path]:
        for _ in range(_ATTEMPTS):
            time = datetime.now(timezone.utc)
            with self._state:
                number = next(self._counter)
            yield self.directory / f'run_{time:%Y%m%dT%H%M%SZ}_{number:04d}.mcap'

    def _failed(self, reason: str) -> None:
        with self._state:
            self._last_failure = reason


def _rehearse(node_name: str) -> None:
    """Record into memory what makes the first run slower: schemas, serializers, compression."""
    writer = MessageWriter(io.BytesIO())
    for topic in (*ESSENTIAL, *PREVIEW):
        writer.add(topic.full_name(node_name), topic.message_class(), 0, topic.qos)
    writer.finish()


class Run:
    """The recording of one service call, from `Recorder.begin`.

    No method raises for trouble with the disk. The methods may be called from different
    threads, one after the other or at once.
    """

    def __init__(self, recorder: Recorder) -> None:
        self._recorder = recorder
        self._access = threading.RLock()
        self._file: RunFile | None = None
        self._name = ''
        self._failure = ''

    @property
    def name(self) -> str:
        """Name of the file in the directory; empty if the run is not recorded."""
        return self._name

    @property
    def failure(self) -> str:
        """Which file could not be written and why; empty while all is well."""
        return self._failure

    def finish_essential(
        self, response: Any, time_ns: int, messages: Iterable[tuple[str, Any]] = ()
    ) -> str:
        """Write what the run is about, and wait until the disk has it.

        Args:
            response: Of type ``PlanManipulation.Response``.
            time_ns: Stamp of the plan in the node's time, ns since the epoch; log time of
                the response and of all messages.
            messages: Topic and message, e.g. ``('joint_trajectory', trajectory)``; topics as
                in `add`.

        Returns:
            Why the run is not recorded, empty if it is. If it is not, `name` is empty from now.
        """

        def write(file: RunFile) -> None:
            for topic, message in ((RESPONSE, response), *messages):
                self._write(file, topic, message, time_ns)
            file.sync()
            if file.deleted:
                raise FileNotFoundError(errno.ENOENT, 'deleted while it was written')
            sync_directory(file.part.parent)

        reason = self._attempt(write)
        if reason:
            self._name = ''
        return reason

    def add(self, topic: str, message: Any, time_ns: int) -> None:
        """Add a message. It is in the file for sure after `close`.

        Args:
            topic: One of `topics`: a name below the node's, which ``~/`` may precede, or one from
                the root.
            message: Of the topic's type.
            time_ns: Log time, that of the message's stamp, ns since the epoch.
        """
        self._attempt(lambda file: self._write(file, topic, message, time_ns))

    def close(self) -> str:
        """Complete the file and put it in place; messages that follow are ignored.

        Returns:
            Why the run is not recorded, or not to its end; empty if it is.
        """

        def complete(file: RunFile) -> None:
            file.close()
            self._file = None

        return self._attempt(complete)

    def _begin(self, request: Any, metadata: Mapping[str, object], start_time_ns: int) -> str:
        recorder = self._recorder

        def write(file: RunFile) -> None:
            record = provenance(recorder.node_name, start_time_ns, metadata)
            file.add_metadata(RECORD, record)
            self._write(file, REQUEST, request, start_time_ns)
            file.flush()
            self._name = file.path.name

        with self._access:
            try:
                self._file = recorder._create()
            except OSError as error:
                self._fail(failure_reason(error, recorder.directory))
            return self._attempt(write)

    def _write(self, file: RunFile, topic: str, message: Any, time_ns: int) -> None:
        name = full_name(topic, self._recorder.node_name)
        file.add(name, message, time_ns, self._recorder._qos[name])

    def _attempt(self, action: Callable[[RunFile], None]) -> str:
        """Do something with the file, or give the file up; return why, if ever."""
        with self._access:
            if self._file is not None:
                try:
                    action(self._file)
                except OSError as error:
                    self._fail(failure_reason(error, self._file.part))
                    self._file.abandon()
                    self._file = None
            return self._failure

    def _fail(self, reason: str) -> None:
        self._failure = reason
        self._recorder._failed(reason)
