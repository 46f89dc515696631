"""SIGINT and SIGTERM end the contexts of the process, also while a thread waits inside DDS.

Python runs signal handlers in the main thread only, and not while that thread waits in C code. The
interpreter's wakeup descriptor, read by a thread of its own, closes this gap: that thread shuts
the contexts down and wakes every executor, whereupon the main thread returns to Python.
"""

from __future__ import annotations

import os
import signal
import socket
import threading
import weakref
from enum import IntEnum
from types import FrameType
from typing import Any


class SignalHandlerOptions(IntEnum):
    """Which signals rclpy handles."""

    NO = 0
    SIGINT = 1
    SIGTERM = 2
    ALL = 3


_SIGNALS = {
    SignalHandlerOptions.NO: (),
    SignalHandlerOptions.SIGINT: (signal.SIGINT,),
    SignalHandlerOptions.SIGTERM: (signal.SIGTERM,),
    SignalHandlerOptions.ALL: (signal.SIGINT, signal.SIGTERM),
}
_HANDLED = b'\x00'
_STOP = b'\xff'


class _Watch:
    """The installed handlers, the wakeup descriptor and the thread that reads it."""

    def __init__(self) -> None:
        self.options = SignalHandlerOptions.NO
        self._originals: dict[int, Any] = {}
        self._sender: socket.socket | None = None
        self._previous_descriptor = -1

    def install(self, options: SignalHandlerOptions) -> None:
        if threading.current_thread() is not threading.main_thread():
            return  # Python lets only the main thread touch signal handlers
        self.ensure_wakeup()
        for number in _SIGNALS[options]:
            if number not in self._originals:
                self._originals[number] = signal.signal(number, self._handle)
        self.options = SignalHandlerOptions(self.options | options)

    def uninstall(self) -> None:
        self.options = SignalHandlerOptions.NO
        if threading.current_thread() is not threading.main_thread():
            return  # the handlers stay and, as nothing is left to shut down, only chain
        for number, original in self._originals.items():
            if signal.getsignal(number) == self._handle:
                signal.signal(number, original)
        self._originals.clear()
        if self._sender is not None:
            descriptor = signal.set_wakeup_fd(-1)
            if descriptor != self._sender.fileno():
                signal.set_wakeup_fd(descriptor)  # somebody else's by now
            elif self._previous_descriptor != -1:
                signal.set_wakeup_fd(self._previous_descriptor, warn_on_full_buffer=False)
            self._sender.send(_STOP)
            self._sender = None

    def ensure_wakeup(self) -> None:
        """Start the thread that reads the wakeup descriptor; for the main thread only."""
        if self._sender is not None:
            return
        receiver, self._sender = socket.socketpair()
        self._sender.setblocking(False)
        self._previous_descriptor = signal.set_wakeup_fd(
            self._sender.fileno(), warn_on_full_buffer=False
        )
        threading.Thread(
            target=self._watch,
            args=(receiver, self._sender, self._previous_descriptor),
            name='rclpy signals',
            daemon=True,
        ).start()

    def _handle(self, number: int, frame: FrameType | None) -> None:
        original = self._originals.get(number)
        try:
            if callable(original):
                original(number, frame)
            elif original == signal.SIG_DFL and self.options == SignalHandlerOptions.NO:
                signal.signal(number, signal.SIG_DFL)
                os.kill(os.getpid(), number)
        finally:
            if self._sender is not None:
                self._sender.send(_HANDLED)

    def _watch(self, receiver: socket.socket, sender: socket.socket, previous: int) -> None:
        # The sender is an argument to live, with its descriptor, as long as this thread.
        with receiver, sender:
            while True:
                received = receiver.recv(64)
                if _STOP in received:
                    return
                if any(self._ends_contexts(number) for number in received):
                    for context in _contexts.snapshot():
                        context._interrupt()
                for executor in _executors.snapshot():
                    executor.wake()
                if previous != -1:
                    os.write(previous, received.replace(_HANDLED, b''))

    def _ends_contexts(self, number: int) -> bool:
        if number == _HANDLED[0]:
            return self.options != SignalHandlerOptions.NO
        return (
            number in self._originals
            and self.options != SignalHandlerOptions.NO
            and signal.getsignal(number) == self._handle
        )


class _Tracked:
    """Objects that the signal thread goes through, for as long as they live."""

    def __init__(self) -> None:
        self._objects: weakref.WeakSet[Any] = weakref.WeakSet()
        self._lock = threading.Lock()

    def add(self, item: Any) -> None:
        with self._lock:
            self._objects.add(item)

    def snapshot(self) -> list[Any]:
        with self._lock:
            return list(self._objects)


_watch = _Watch()
_contexts = _Tracked()
_executors = _Tracked()


def install_signal_handlers(options: SignalHandlerOptions = SignalHandlerOptions.ALL) -> None:
    """Have the signals end every context; without effect outside the main thread."""
    _watch.install(SignalHandlerOptions(options))


def uninstall_signal_handlers() -> None:
    """Put the handlers back that were there before."""
    _watch.uninstall()


def get_current_signal_handlers_options() -> SignalHandlerOptions:
    """Return which signals are handled at present."""
    return _watch.options


def _track_context(context: Any) -> None:
    _contexts.add(context)


def _track_executor(executor: Any) -> None:
    _executors.add(executor)


def _make_wait_interruptible() -> None:
    """See to it that a signal wakes the executors, if this is the main thread."""
    if threading.current_thread() is threading.main_thread():
        _watch.ensure_wakeup()
