"""Jobs, such as plans to compute, are served one after the other on a thread of their own."""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Callable
from enum import Enum
from typing import Generic, TypeVar

Job = TypeVar('Job')


class Admission(Enum):
    """What became of a job that was handed in."""

    ACCEPTED = 'accepted'
    FULL = 'full'
    CLOSED = 'closed'


class JobQueue(Generic[Job]):
    """Serves jobs in the order of their arrival, each exactly once.

    Closing the queue sets `canceled`. Jobs that are waiting then are still served, so that each
    gets its answer: `serve` looks at `canceled` and ends early.

    Args:
        serve: Called with one job after the other, never at the same time. Must not raise.
        name: Of the thread.
    """

    def __init__(self, serve: Callable[[Job], object], name: str) -> None:
        self.canceled = threading.Event()
        self._serve = serve
        self._waiting: deque[Job] = deque()
        self._serving = False
        self._idle_since = -math.inf
        self._changed = threading.Condition()
        # A daemon: a search that does not end must not keep the process alive.
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    @property
    def load(self) -> tuple[bool, int]:
        """Whether a job is being served, and how many wait."""
        with self._changed:
            return self._serving, len(self._waiting)

    def submit(self, job: Job, capacity: int) -> Admission:
        """Hand in a job.

        Args:
            job: What to serve.
            capacity: Jobs that may wait while one is served.
        """
        with self._changed:
            if self.canceled.is_set():
                return Admission.CLOSED
            if len(self._waiting) + self._serving > capacity:
                return Admission.FULL
            self._waiting.append(job)
            self._changed.notify_all()
            return Admission.ACCEPTED

    def wait_until_idle(self, timeout: float, quiet: float = 0.0) -> bool:
        """Wait until nothing is served or waits; tell whether that is so after `timeout` s.

        Args:
            timeout: s.
            quiet: For so long, s, it must have been so; a closed queue is quiet at once.
        """
        deadline = time.monotonic() + timeout
        with self._changed:
            while (missing := self._missing_quiet(quiet)) > 0.0:
                left = deadline - time.monotonic()
                if left <= 0.0:
                    return False
                self._changed.wait(min(left, missing))
            return True

    def close(self) -> None:
        """Take no more jobs and cancel the one that is served; returns at once."""
        with self._changed:
            self.canceled.set()
            self._changed.notify_all()

    def join(self, timeout: float) -> bool:
        """Wait until a closed queue has served its last job; tell whether it has within s."""
        self._thread.join(timeout)
        return not self._thread.is_alive()

    def _missing_quiet(self, quiet: float) -> float:
        """How long the queue must still stay idle, s; infinite while it is not."""
        if self._serving or self._waiting:
            return math.inf
        if self.canceled.is_set():
            return 0.0
        return self._idle_since + quiet - time.monotonic()

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._waiting or self.canceled.is_set())
                if not self._waiting:
                    return
                job = self._waiting.popleft()
                self._serving = True
            try:
                self._serve(job)
            finally:
                with self._changed:
                    self._serving = False
                    self._idle_since = time.monotonic()
                    self._changed.notify_all()
