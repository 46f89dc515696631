"""What writers, readers and guard conditions have in common: a handle that can be closed."""

from __future__ import annotations

import threading
from collections.abc import Callable

from ros_standalone.middleware.errors import ClosedError


class Entity:
    """Something of DDS's that is used by a handle until it is closed, from any thread.

    Args:
        what: What it is, for the messages of errors.
        on_close: Called once, when it has been closed.
    """

    def __init__(self, what: str, on_close: Callable[[], None]) -> None:
        self._what = what
        self._on_close = on_close
        self._open = True
        self._closing = threading.Lock()

    @property
    def is_open(self) -> bool:
        """Whether it has not been closed."""
        return self._open

    def close(self) -> None:
        """End it; a second call does nothing."""
        with self._closing:
            if not self._open:
                return
            self._open = False
        self._delete()
        self._on_close()

    def _delete(self) -> None:
        """Delete what DDS holds of it."""
        raise NotImplementedError

    def _require_open(self) -> None:
        if not self._open:
            raise ClosedError(f'{self._what} has been closed')

    def _wait_handle(self) -> int | None:
        """The DDS condition that says that it has something, None for what cannot be awaited."""
        return None
