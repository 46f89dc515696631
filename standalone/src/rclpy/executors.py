"""Executors: they wait for what the nodes' entities receive and run the callbacks."""

from __future__ import annotations

import os
import threading
import warnings
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from rclpy import _unsupported
from rclpy._executor import (
    ConditionReachedException,
    Executor,
    ExternalShutdownException,
    ShutdownException,
    TimeoutException,
)
from rclpy.context import Context
from rclpy.task import Future, Task

__all__ = [
    'ConditionReachedException',
    'Executor',
    'ExternalShutdownException',
    'MultiThreadedExecutor',
    'ShutdownException',
    'SingleThreadedExecutor',
    'TimeoutException',
]

__getattr__ = _unsupported.module_getattr(__name__)


class SingleThreadedExecutor(Executor):
    """Runs callbacks one after the other in the thread that spins."""

    def spin_once(self, timeout_sec: float | None = None) -> None:  # noqa: D102
        self._spin_once(timeout_sec, lambda: False)

    def spin_once_until_future_complete(  # noqa: D102
        self, future: Future[Any], timeout_sec: float | None = None
    ) -> None:
        future._add_waiter(self.wake)
        self._spin_once(timeout_sec, lambda: future.done() or future.cancelled())

    def _spin_once(self, timeout_sec: float | None, condition: Callable[[], bool]) -> None:
        try:
            task, _, _ = self.wait_for_ready_callbacks(timeout_sec, None, condition)
        except (ShutdownException, TimeoutException, ConditionReachedException):
            return
        self._run(task)
        task.result()  # raises what the callback raised


class MultiThreadedExecutor(Executor):
    """Runs callbacks in a pool of threads, as far as their callback groups let them.

    Args:
        num_threads: Size of the pool; None takes the number of cores that the process may use.
        context: The context of the nodes; None for the default one.
    """

    def __init__(self, num_threads: int | None = None, *, context: Context | None = None) -> None:
        super().__init__(context=context)
        if num_threads is None:
            num_threads = len(os.sched_getaffinity(0))
        if num_threads == 1:
            warnings.warn(
                'MultiThreadedExecutor is used with a single thread.\n'
                'Use the SingleThreadedExecutor instead.',
                stacklevel=2,
            )
        self._pool = ThreadPoolExecutor(num_threads, thread_name_prefix='rclpy')
        self._failed: deque[Task[Any]] = deque()

    def spin_once(self, timeout_sec: float | None = None) -> None:  # noqa: D102
        self._spin_once(timeout_sec, lambda: False)

    def spin_once_until_future_complete(  # noqa: D102
        self, future: Future[Any], timeout_sec: float | None = None
    ) -> None:
        future._add_waiter(self.wake)
        self._spin_once(timeout_sec, lambda: future.done() or future.cancelled())

    def shutdown(self, timeout_sec: float | None = None, *, wait_for_threads: bool = True) -> bool:
        """Run no more callbacks and wait for those that run.

        Args:
            timeout_sec: How long to wait at most; None and negative mean as long as it takes.
            wait_for_threads: Wait for the threads of the pool to end, too.

        Returns:
            Whether all callbacks have ended.
        """
        success = super().shutdown(timeout_sec)
        is_callback = threading.get_ident() in self._running
        self._pool.shutdown(wait=wait_for_threads and success and not is_callback)
        return success

    def _spin_once(self, timeout_sec: float | None, condition: Callable[[], bool]) -> None:
        try:
            task, _, _ = self.wait_for_ready_callbacks(
                timeout_sec, None, lambda: bool(self._failed) or condition()
            )
        except (
            ExternalShutdownException,
            ShutdownException,
            TimeoutException,
            ConditionReachedException,
        ):
            pass
        else:
            try:
                self._pool.submit(self._run_and_note, task)
            except RuntimeError:
                # The pool was shut down between the wait and here.
                task.cancel()
                if not self._is_shutdown:
                    raise
        if self._failed:
            self._failed.popleft().result()  # raises what the callback raised

    def _run_and_note(self, task: Task[Any]) -> None:
        self._run(task)
        if task.done() and task.exception() is not None:
            self._failed.append(task)
            self.wake()
