"""What all executors share: the wait for work, and the bookkeeping of what runs."""

from __future__ import annotations

import functools
import threading
import time
from collections import deque
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING, Any

from rclpy import signals
from rclpy.context import Context
from rclpy.exceptions import NotInitializedException
from rclpy.task import Future, Task
from rclpy.utilities import get_default_context, timeout_sec_to_nsec
from ros_standalone.middleware import ClosedError, GuardCondition, WaitSet

if TYPE_CHECKING:
    from typing_extensions import Self

    from rclpy.node import Node


class TimeoutException(Exception):
    """Nothing was ready in time."""


class ShutdownException(Exception):
    """The executor was shut down."""


class ExternalShutdownException(Exception):
    """The context was shut down, by a signal or by another thread."""


class ConditionReachedException(Exception):
    """What the wait was to end for has come true."""


class Executor:
    """What all executors share: the nodes, the tasks and the wait for work.

    A subclass of a user's own defines `spin_once`, which gets its work from
    `wait_for_ready_callbacks`.

    Args:
        context: The context of the nodes; None for the default one.

    Raises:
        NotInitializedException: if the context is not initialised.
    """

    def __init__(self, *, context: Context | None = None) -> None:
        self._context = get_default_context() if context is None else context
        if self._context._participant is None:
            raise NotInitializedException('cannot create executor')
        self._nodes: list[Node] = []
        self._nodes_lock = threading.RLock()
        self._ready_tasks: deque[Task[Any]] = deque()
        # How many of them go before the entities are looked at again.
        self._task_quota = 0
        self._tasks_lock = threading.Lock()
        self._ready_entities: deque[tuple[Any, Node]] = deque()
        # Tasks that entities caused belong to a node and hold their callback group.
        self._origins: dict[Task[Any], tuple[Any, Node]] = {}
        self._guard = GuardCondition(self._context.participant)
        self._wait_set = WaitSet(self._context.participant)
        self._wait_lock = threading.Lock()
        self._waiting_thread = 0
        # The threads that run a callback at this moment.
        self._running: list[int] = []
        self._running_changed = threading.Condition()
        self._is_shutdown = False
        signals._track_executor(self)
        self._context.on_shutdown(self.wake)

    @property
    def context(self) -> Context:
        """The context of the nodes."""
        return self._context

    def create_task(self, callback: Callable[..., Any], *args: Any, **kwargs: Any) -> Task[Any]:
        """Have `callback(*args, **kwargs)` run, a function or a coroutine function.

        Returns:
            The future of its result.
        """
        task: Task[Any] = Task(callback, args, kwargs, executor=self)
        self._call_task_in_next_spin(task)
        return task

    def create_future(self) -> Future[Any]:
        """Return a future whose done callbacks this executor runs."""
        return Future(executor=self)

    def add_node(self, node: Node) -> bool:
        """Serve a node from now on; return False if that is so already."""
        with self._nodes_lock:
            if node in self._nodes:
                return False
            self._nodes.append(node)
            node.executor = self
        self.wake()
        return True

    def remove_node(self, node: Node) -> None:
        """Do not serve the node any more."""
        with self._nodes_lock:
            if node not in self._nodes:
                return
            self._nodes.remove(node)
        self.wake()

    def get_nodes(self) -> list[Node]:
        """Return the nodes that are served."""
        with self._nodes_lock:
            return list(self._nodes)

    def wake(self) -> None:
        """Have the waiting thread look anew at what there is to wait for."""
        self._guard.trigger()

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        """Run no more callbacks and wait for those that run.

        Args:
            timeout_sec: How long to wait at most; None and negative mean as long as it takes.

        Returns:
            Whether all callbacks have ended; False leaves the executor to a later call.
        """
        self._is_shutdown = True
        self.wake()
        timeout = None if timeout_sec is None or timeout_sec < 0 else timeout_sec
        caller = threading.get_ident()
        with self._running_changed:
            if not self._running_changed.wait_for(
                lambda: all(thread == caller for thread in self._running), timeout
            ):
                return False
        with self._nodes_lock:
            self._nodes.clear()
        with self._wait_lock:
            self._wait_set.close()
        self._guard.close()
        return True

    def spin(self) -> None:
        """Run callbacks until the executor or the context is shut down."""
        while self._context.ok() and not self._is_shutdown:
            self.spin_once()

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Wait for one callback and run it.

        Args:
            timeout_sec: How long to wait at most [s]; None and negative mean for ever.

        Raises:
            ExternalShutdownException: if the context is shut down.
            Exception: what the callback raised.
        """
        raise NotImplementedError

    def spin_until_future_complete(
        self, future: Future[Any], timeout_sec: float | None = None
    ) -> None:
        """Run callbacks until the future is done or cancelled, or the time is over.

        Args:
            future: What to wait for.
            timeout_sec: How long at most [s]; None and negative mean for ever.
        """
        future._add_waiter(self.wake)
        timeout_nsec = timeout_sec_to_nsec(timeout_sec)
        end = None if timeout_nsec < 0 else time.monotonic_ns() + timeout_nsec
        while (
            self._context.ok()
            and not future.done()
            and not future.cancelled()
            and not self._is_shutdown
        ):
            left = None if end is None else max(0, end - time.monotonic_ns()) * 1e-9
            self.spin_once_until_future_complete(future, left)
            if end is not None and time.monotonic_ns() >= end:
                return

    def spin_once_until_future_complete(
        self, future: Future[Any], timeout_sec: float | None = None
    ) -> None:
        """Wait for one callback and run it, unless the future is done before.

        Args:
            future: What ends the wait.
            timeout_sec: How long to wait at most [s]; None and negative mean for ever.
        """
        raise NotImplementedError

    def can_execute(self, entity: Any) -> bool:
        """Return whether the callback group lets a callback of the entity begin."""
        group = entity.callback_group
        return group is not None and group.can_execute(entity)

    def wait_for_ready_callbacks(
        self,
        timeout_sec: float | None = None,
        nodes: list[Node] | None = None,
        condition: Callable[[], bool] = lambda: False,
    ) -> tuple[Task[Any], Any, Node | None]:
        """Wait for something to do.

        Args:
            timeout_sec: How long at most [s]; None and negative mean for ever.
            nodes: The nodes to look at; None for all.
            condition: Ends the wait when it has become true and the executor was woken.

        Returns:
            A task to be called once, with the entity and the node that it is for, if any.

        Raises:
            TimeoutException: if nothing was ready in time.
            ShutdownException: if the executor is shut down.
            ExternalShutdownException: if the context is shut down.
            ConditionReachedException: if the condition is true.
        """
        timeout_nsec = timeout_sec_to_nsec(timeout_sec)
        end = None if timeout_nsec < 0 else time.monotonic_ns() + timeout_nsec
        has_waited = False
        while True:
            if self._is_shutdown:
                raise ShutdownException()
            if condition():
                raise ConditionReachedException()
            chosen = self.get_nodes() if nodes is None else nodes
            work = self._next_task(chosen) or self._next_entity(chosen)
            if work is not None:
                return work
            if not self._context.ok():
                raise ExternalShutdownException()
            left = None if end is None else max(0, end - time.monotonic_ns())
            if left == 0 and has_waited:
                raise TimeoutException()
            self._wait(chosen, left)
            has_waited = True

    def _wait(self, nodes: list[Node], timeout_nsec: int | None) -> None:
        """Wait until the nodes have something to do, and note what it is."""
        signals._make_wait_interruptible()
        self._waiting_thread = threading.get_ident()
        due: list[tuple[Any, Node]] = []
        waited: dict[Any, tuple[Any, Node]] = {}
        for node in nodes:
            for entity in node._entities():
                if not self.can_execute(entity):
                    continue
                if entity._source is not None:
                    waited[entity._source] = (entity, node)
                    continue
                due_in = entity._due_in_ns()
                if due_in is not None and due_in <= 0:
                    due.append((entity, node))
                elif due_in is not None and (timeout_nsec is None or due_in < timeout_nsec):
                    timeout_nsec = due_in
        if due or self._has_ready_task(nodes):
            timeout_nsec = 0
        seconds = None if timeout_nsec is None else timeout_nsec * 1e-9
        with self._wait_lock:
            if self._is_shutdown:
                return
            arrived = self._wait_set.wait([self._guard, *waited], seconds)
        self._task_quota = len(self._ready_tasks)
        self._ready_entities.extend(due)
        self._ready_entities.extend(
            origin for source, origin in waited.items() if source in arrived
        )

    def _has_ready_task(self, nodes: list[Node]) -> bool:
        with self._tasks_lock:
            return any(self._is_task_of(task, nodes) for task in self._ready_tasks)

    def _is_task_of(self, task: Task[Any], nodes: list[Node]) -> bool:
        origin = self._origins.get(task)
        return origin is None or origin[1] in nodes

    def _next_task(self, nodes: list[Node]) -> tuple[Task[Any], Any, Node | None] | None:
        with self._tasks_lock:
            while self._task_quota > 0 and self._ready_tasks:
                self._task_quota -= 1
                task = self._ready_tasks.popleft()
                if task.done() or task.cancelled():
                    continue
                if self._is_task_of(task, nodes):
                    return task, *self._origins.get(task, (None, None))
                self._ready_tasks.append(task)
        return None

    def _next_entity(self, nodes: list[Node]) -> tuple[Task[Any], Any, Node | None] | None:
        while self._ready_entities:
            entity, node = self._ready_entities.popleft()
            group = entity.callback_group
            if node not in nodes or not group.beginning_execution(entity):
                continue
            try:
                job = entity._take_job(self)
            except ClosedError:
                job = None
            except BaseException:
                group.ending_execution(entity)
                raise
            if job is None:
                group.ending_execution(entity)
                continue
            task: Task[Any] = Task(job, executor=self)
            with self._tasks_lock:
                self._origins[task] = (entity, node)
            task._add_waiter(functools.partial(self._finish, task))
            return task, entity, node
        return None

    def _finish(self, task: Task[Any]) -> None:
        """Free the callback group of the entity whose task has ended."""
        with self._tasks_lock:
            entity, _ = self._origins.pop(task)
        entity.callback_group.ending_execution(entity)
        if threading.get_ident() != self._waiting_thread:
            self.wake()

    def _run(self, task: Task[Any]) -> None:
        thread = threading.get_ident()
        with self._running_changed:
            self._running.append(thread)
        try:
            task()
        finally:
            with self._running_changed:
                self._running.remove(thread)
                self._running_changed.notify_all()

    def _call_task_in_next_spin(self, task: Task[Any]) -> None:
        with self._tasks_lock:
            self._ready_tasks.append(task)
        self.wake()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.shutdown()
