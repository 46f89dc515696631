"""Waiting until something arrives."""

from __future__ import annotations

import ctypes
import threading
import time
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from ros_standalone.middleware import library
from ros_standalone.middleware.entities import Entity

if TYPE_CHECKING:
    from ros_standalone.middleware.participant import Participant

_LONGEST_UNINTERRUPTED_S = 0.1


class GuardCondition(Entity):
    """Wakes a waiting thread by hand; the wait that it ends resets it.

    Args:
        participant: Whose wait sets it can be waited for in.
    """

    def __init__(self, participant: Participant) -> None:
        super().__init__('the guard condition', lambda: participant.forget(self))
        self._handle = participant.create_guard_condition()
        participant.remember(self)

    def trigger(self) -> None:
        """Wake who waits for it, or who will next; nothing happens once it is closed."""
        library.set_guard_condition(self._handle, True)

    def reset(self) -> None:
        """Take back a trigger that nobody waited for."""
        library.take_guard_condition(self._handle, ctypes.c_bool())

    def _delete(self) -> None:
        library.delete(self._handle)

    def _wait_handle(self) -> int | None:
        return self._handle


class WaitSet(Entity):
    """Waits until one of several entities has something.

    One thread waits at a time; entities may be closed by others meanwhile, which wakes it.

    Args:
        participant: Whose entities are waited for.
    """

    def __init__(self, participant: Participant) -> None:
        super().__init__('the wait set', lambda: participant.forget(self))
        self._handle = participant.create_waitset()
        self._interrupt = participant.create_guard_condition()
        library.check(
            library.waitset_attach(self._handle, self._interrupt, 0), 'attach to a wait set'
        )
        self._attached: set[int] = set()
        self._waiting = threading.Lock()
        participant.remember(self)

    def wait(self, entities: Iterable[Entity], timeout_s: float | None) -> set[Entity]:
        """Wait until an entity has something to take, or was triggered.

        Args:
            entities: Readers, servers, clients and guard conditions; closed ones are passed over.
            timeout_s: Seconds to wait at most; None waits without end.

        Returns:
            Those that are ready; none when time is over, or when an entity or this wait set was
            closed meanwhile.
        """
        end = None if timeout_s is None else time.monotonic() + max(timeout_s, 0.0)
        with self._waiting:
            wanted = _by_handle(entities)
            self._attach(wanted)
            # Python runs the handlers of signals only between calls, and only in this thread.
            stepwise = threading.current_thread() is threading.main_thread()
            slots = (ctypes.c_ssize_t * (len(self._attached) + 1))()
            while self.is_open:
                left = None if end is None else max(end - time.monotonic(), 0.0)
                step = left
                if stepwise and (left is None or left > _LONGEST_UNINTERRUPTED_S):
                    step = _LONGEST_UNINTERRUPTED_S
                duration = library.INFINITE if step is None else int(step * 1e9)
                count = library.waitset_wait(self._handle, slots, len(slots), duration)
                if count or left == 0.0 or step == left:
                    return self._ready(wanted, slots[: max(count, 0)])
            return set()

    def interrupt(self) -> None:
        """End the wait that runs now, or else the next one."""
        library.set_guard_condition(self._interrupt, True)

    def _attach(self, wanted: dict[int, Entity]) -> None:
        for handle in self._attached - wanted.keys():
            # A closed entity has detached itself.
            library.waitset_detach(self._handle, handle)
        for handle in wanted.keys() - self._attached:
            library.waitset_attach(self._handle, handle, handle)
        self._attached = set(wanted)

    def _ready(self, wanted: dict[int, Entity], triggered: list[int]) -> set[Entity]:
        ready = set()
        for handle in triggered:
            if handle == 0:
                library.take_guard_condition(self._interrupt, ctypes.c_bool())
                continue
            entity = wanted[handle]
            if isinstance(entity, GuardCondition):
                entity.reset()
            if entity.is_open:
                ready.add(entity)
        return ready

    def _delete(self) -> None:
        self.interrupt()
        library.delete(self._handle)
        library.delete(self._interrupt)


def wait_until(predicate: Callable[[], bool], condition: threading.Condition, end: float) -> bool:
    """Wait until a predicate holds; it is asked again at every change and every 20 ms.

    Args:
        predicate: What shall be.
        condition: Notified at changes.
        end: When to give up, on the monotonic clock.
    """
    while not predicate():
        left = end - time.monotonic()
        if left <= 0:
            return False
        with condition:
            condition.wait(min(left, 0.02))
    return True


def _by_handle(entities: Iterable[Entity]) -> dict[int, Entity]:
    wanted = {}
    for entity in entities:
        handle = entity._wait_handle()
        if entity.is_open and handle is not None:
            wanted[handle] = entity
    return wanted
