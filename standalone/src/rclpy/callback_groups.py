"""Which callbacks of a node may run at the same time."""

from __future__ import annotations

import threading
import weakref
from typing import Any


class CallbackGroup:
    """The base of the groups: it knows its members and asks the subclass who may run."""

    def __init__(self) -> None:
        self.entities: weakref.WeakSet[Any] = weakref.WeakSet()

    def add_entity(self, entity: Any) -> None:
        """Make an entity (subscription, timer, ...) a member."""
        self.entities.add(entity)

    def has_entity(self, entity: Any) -> bool:
        """Return whether the entity is a member."""
        return entity in self.entities

    def can_execute(self, entity: Any) -> bool:
        """Return whether a callback of the entity could begin now."""
        raise NotImplementedError

    def beginning_execution(self, entity: Any) -> bool:
        """Take the right to run a callback of the entity; False if it cannot be had now."""
        raise NotImplementedError

    def ending_execution(self, entity: Any) -> None:
        """Give back the right that `beginning_execution` took."""
        raise NotImplementedError


class ReentrantCallbackGroup(CallbackGroup):
    """Callbacks run at any time, also beside themselves."""

    def can_execute(self, entity: Any) -> bool:
        """Return True."""
        return True

    def beginning_execution(self, entity: Any) -> bool:
        """Return True."""
        return True

    def ending_execution(self, entity: Any) -> None:
        """Do nothing."""


class MutuallyExclusiveCallbackGroup(CallbackGroup):
    """One callback runs at a time."""

    def __init__(self) -> None:
        super().__init__()
        self._active_entity: Any = None
        self._lock = threading.Lock()

    def can_execute(self, entity: Any) -> bool:
        """Return whether no callback of the group runs."""
        with self._lock:
            assert self.has_entity(entity)
            return self._active_entity is None

    def beginning_execution(self, entity: Any) -> bool:
        """Take the group for the entity; False if another callback runs."""
        with self._lock:
            assert self.has_entity(entity)
            if self._active_entity is not None:
                return False
            self._active_entity = entity
            return True

    def ending_execution(self, entity: Any) -> None:
        """Free the group."""
        with self._lock:
            assert self._active_entity is entity
            self._active_entity = None
