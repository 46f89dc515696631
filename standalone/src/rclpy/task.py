"""Futures, and the tasks that an executor runs."""

from __future__ import annotations

import inspect
import sys
import threading
import warnings
import weakref
from collections.abc import Callable, Coroutine, Generator, Iterable
from typing import TYPE_CHECKING, Any, Generic, TypeVar

if TYPE_CHECKING:
    from rclpy.executors import Executor

T = TypeVar('T')


class Future(Generic[T]):
    """The outcome of work that may not have ended yet.

    Args:
        executor: Where done callbacks run; without one they run in the thread that ends the work.
    """

    def __init__(self, *, executor: Executor | None = None) -> None:
        self._done = False
        self._cancelled = False
        self._result: T | None = None
        self._exception: BaseException | None = None
        self._exception_fetched = False
        self._callbacks: list[Callable[[Future[T]], Any]] = []
        self._waiters: list[Callable[[], None]] = []
        self._lock = threading.Lock()
        self._executor: weakref.ref[Executor] | None = None
        self._set_executor(executor)

    def __del__(self) -> None:
        if self._exception is not None and not self._exception_fetched:
            print(
                f'The following exception was never retrieved: {self._exception}', file=sys.stderr
            )

    def __await__(self) -> Generator[Any, None, T | None]:
        while not (self._done or self._cancelled):
            yield self
        return self.result()

    def cancel(self) -> None:
        """Ask for the work to be given up; without effect when it has ended."""
        with self._lock:
            if not self._done:
                self._cancelled = True
        self._announce()

    def cancelled(self) -> bool:
        """Return whether the work was given up."""
        return self._cancelled

    def done(self) -> bool:
        """Return whether there is a result or an exception."""
        return self._done

    def result(self) -> T | None:
        """Return the result, None while there is none.

        Raises:
            BaseException: the one that the work ended with.
        """
        exception = self.exception()
        if exception is not None:
            raise exception
        return self._result

    def exception(self) -> BaseException | None:
        """Return the exception that the work ended with, None if there is none."""
        self._exception_fetched = True
        return self._exception

    def set_result(self, result: T) -> None:
        """End with a result."""
        with self._lock:
            self._result = result
            self._done = True
            self._cancelled = False
        self._announce()

    def set_exception(self, exception: BaseException) -> None:
        """End with an exception, which `result` raises."""
        with self._lock:
            self._exception = exception
            self._exception_fetched = False
            self._done = True
            self._cancelled = False
        self._announce()

    def add_done_callback(self, callback: Callable[[Future[T]], Any]) -> None:
        """Call `callback(self)` when this has ended: by the executor if there is one.

        Where the future has ended already and has no executor, the call is made here and now.
        """
        with self._lock:
            if not self._done:
                self._callbacks.append(callback)
                return
            executor = self._get_executor()
        if executor is not None:
            executor.create_task(callback, self)
        else:
            callback(self)

    def remove_done_callback(self, callback: Callable[[Future[T]], Any]) -> bool:
        """Take a callback back that has not been called yet; return whether it was there."""
        with self._lock:
            if callback in self._callbacks:
                self._callbacks.remove(callback)
                return True
            return False

    def _add_waiter(self, wake: Callable[[], None]) -> None:
        """Call `wake` when this ends or is given up: at once, in whichever thread that happens.

        Adding the same one again changes nothing.
        """
        with self._lock:
            if not (self._done or self._cancelled):
                if wake not in self._waiters:
                    self._waiters.append(wake)
                return
        wake()

    def _announce(self) -> None:
        with self._lock:
            executor = self._get_executor()
            callbacks, self._callbacks = self._callbacks, []
            waiters, self._waiters = self._waiters, []
        for wake in waiters:
            wake()
        for callback in callbacks:
            if executor is not None:
                executor.create_task(callback, self)
                continue
            try:
                callback(self)
            except Exception as error:
                # The callbacks that follow must still be called.
                warnings.warn(f'Unhandled exception in done callback: {error}', stacklevel=2)

    def _get_executor(self) -> Executor | None:
        return None if self._executor is None else self._executor()

    def _set_executor(self, executor: Executor | None) -> None:
        with self._lock:
            self._executor = None if executor is None else weakref.ref(executor)


class Task(Future[T]):
    """A function or coroutine that an executor runs; made by `Executor.create_task`.

    Args:
        handler: A function, a coroutine function, or a coroutine.
        args: Positional arguments for the handler.
        kwargs: Keyword arguments for the handler.
        executor: The executor that runs it.
    """

    def __init__(
        self,
        handler: Callable[..., Any] | Coroutine[Any, Any, T],
        args: Iterable[Any] | None = None,
        kwargs: dict[str, Any] | None = None,
        executor: Executor | None = None,
    ) -> None:
        super().__init__(executor=executor)
        self._args = tuple(args or ())
        self._kwargs = dict(kwargs or {})
        self._handler: Callable[..., Any] | Coroutine[Any, Any, T] | None = handler
        if inspect.iscoroutinefunction(handler):
            self._handler = handler(*self._args, **self._kwargs)
        self._executing = False
        # Held while the task runs: a task never runs beside itself.
        self._task_lock = threading.Lock()

    def __call__(self) -> None:
        """Run the function to its end, or the coroutine to its next wait."""
        if self._done or not self._task_lock.acquire(blocking=False):
            return
        wait_for = None
        try:
            if self._done or self._cancelled:
                return
            self._executing = True
            if inspect.iscoroutine(self._handler):
                wait_for = self._step(self._handler)
            else:
                self._run()
        except BaseException:
            # KeyboardInterrupt and the like: who waits for the task learns that it is over.
            self.cancel()
            raise
        finally:
            self._executing = False
            self._task_lock.release()
        # Only now, as another thread may go on with the task at once.
        if wait_for is not None:
            wait_for(self._resume)

    def executing(self) -> bool:
        """Return whether the task runs at this moment."""
        return self._executing

    def _run(self) -> None:
        handler = self._handler
        assert callable(handler)
        try:
            result = handler(*self._args, **self._kwargs)
        except Exception as error:
            self._release()
            self.set_exception(error)
        else:
            self._release()
            self.set_result(result)

    def _step(
        self, coroutine: Coroutine[Any, Any, T]
    ) -> Callable[[Callable[[], None]], None] | None:
        """Go on with the coroutine; return what arranges its resumption unless it has ended."""
        try:
            awaited = coroutine.send(None)
        except StopIteration as stop:
            self._release()
            self.set_result(stop.value)
        except Exception as error:
            self._release()
            self.set_exception(error)
        else:
            return awaited._add_waiter if isinstance(awaited, Future) else _at_once
        return None

    def _resume(self) -> None:
        executor = self._get_executor()
        if executor is not None:
            executor._call_task_in_next_spin(self)

    def _release(self) -> None:
        self._handler = None
        self._args = ()
        self._kwargs = {}


def _at_once(resume: Callable[[], None]) -> None:
    resume()
