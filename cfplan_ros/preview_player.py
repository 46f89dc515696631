"""Plays a plan in time, on a thread of its own."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from typing import Any

# A simulated clock may stand still or run ahead: it is looked at this often, s.
_LONGEST_WAIT = 0.05


class PreviewPlayer:
    """Publishes messages when their time has come.

    Args:
        publish: Called with topic and message from the player's thread.
        now: Time, ns, on the clock of the messages.
        failed: Called with what kept the player from going on.
    """

    def __init__(
        self,
        publish: Callable[[str, Any], None],
        now: Callable[[], int],
        failed: Callable[[Exception], None],
    ) -> None:
        self._publish = publish
        self._now = now
        self._failed = failed
        self._stop = threading.Event()
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None

    @property
    def playing(self) -> bool:
        """True while a plan is being played."""
        thread = self._thread
        return thread is not None and thread.is_alive()

    def play(self, messages: Iterable[tuple[int, str, Any]]) -> bool:
        """Begin to play; tell whether the player was free.

        Args:
            messages: Time, ns, topic and message, in the order of time. Iterated on the player's
                thread, so that it may compute them.
        """
        with self._lock:
            if self.playing or self._stop.is_set():
                return False
            self._thread = threading.Thread(
                target=self._run, args=(messages,), name='preview', daemon=True
            )
            self._thread.start()
            return True

    def close(self, timeout: float) -> None:
        """Stop playing and wait up to `timeout` s until nothing is published any more."""
        with self._lock:
            self._stop.set()
        if self._thread is not None:
            self._thread.join(timeout)

    def _run(self, messages: Iterable[tuple[int, str, Any]]) -> None:
        try:
            for due, topic, message in messages:
                while (wait := 1e-9 * (due - self._now())) > 0.0:
                    if self._stop.wait(min(wait, _LONGEST_WAIT)):
                        return
                if self._stop.is_set():
                    return
                self._publish(topic, message)
        except Exception as error:
            self._failed(error)
