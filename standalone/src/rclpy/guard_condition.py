"""A callback that any thread can have run by the executor."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rclpy.exceptions import InvalidHandle

if TYPE_CHECKING:
    from rclpy._executor import Executor
    from rclpy.callback_groups import CallbackGroup
    from rclpy.context import Context


class GuardCondition:
    """Runs its callback once after it was triggered, however often that was.

    Args:
        callback: Function or coroutine function without arguments; None only wakes the executor.
        callback_group: The group that the callback belongs to.
        context: The context of the node.
        wake: Wakes the executor of the node.
    """

    def __init__(
        self,
        callback: Callable[[], Any] | None,
        callback_group: CallbackGroup | None,
        context: Context | None = None,
        *,
        wake: Callable[[], None] | None = None,
    ) -> None:
        self.callback = callback
        self.callback_group = callback_group
        self.context = context
        self._wake = wake
        self._triggered = threading.Event()
        self._destroyed = False

    def trigger(self) -> None:
        """Have the executor run the callback.

        Raises:
            InvalidHandle: if the guard condition was destroyed.
        """
        if self._destroyed:
            raise InvalidHandle('cannot use Destroyable because destruction was requested')
        self._triggered.set()
        if self._wake is not None:
            self._wake()

    def destroy(self) -> None:
        """End its use; a pending trigger is dropped."""
        self._destroyed = True
        self._triggered.clear()

    _source = None

    def _due_in_ns(self) -> int | None:
        return 0 if self._triggered.is_set() else None

    def _take_job(self, executor: Executor) -> Callable[[], Any] | None:
        if not self._triggered.is_set():
            return None
        self._triggered.clear()
        return self.callback or (lambda: None)
