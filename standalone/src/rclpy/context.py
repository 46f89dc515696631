"""What lies between init and shutdown: arguments, the DDS participant, and the nodes on it."""

from __future__ import annotations

import sys
import threading
import weakref
from collections.abc import Callable
from inspect import ismethod
from types import TracebackType
from typing import TYPE_CHECKING, Any

from rclpy import _arguments, _log_output, signals
from rclpy.exceptions import RCLError
from rclpy.logging import set_logger_level
from ros_standalone.middleware import Participant

if TYPE_CHECKING:
    from rclpy.node import Node


class Context:
    """One life of rclpy: initialised once, shut down once, not used again."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._participant: Participant | None = None
        self._arguments: _arguments.Arguments | None = None
        self._domain_id = 0
        self._ended = threading.Event()
        self._callbacks: list[weakref.WeakMethod[Callable[[], Any]] | Callable[[], Any]] = []
        self._nodes: list[weakref.ref[Node]] = []

    def init(
        self,
        args: list[str] | None = None,
        *,
        initialize_logging: bool = True,
        domain_id: int | None = None,
    ) -> None:
        """Read the arguments and join the DDS domain.

        Args:
            args: Command line, the program's name first; None takes the process's own.
            initialize_logging: Apply the log levels among the arguments.
            domain_id: DDS domain; None takes ROS_DOMAIN_ID, or 0.

        Raises:
            RuntimeError: if the domain id is negative or the context was initialised before.
            UnknownROSArgsError: if the arguments hold a ROS argument that there is not.
        """
        with self._lock:
            if domain_id is not None and domain_id < 0:
                raise RuntimeError(f'Domain id ({domain_id}) should not be lower than zero.')
            if self._participant is not None:
                raise RuntimeError('Context.init() must only be called once')
            arguments = _arguments.parse(list(sys.argv) if args is None else list(args))
            participant = Participant(domain_id, enclave=arguments.enclave)
            # Also at the interpreter's end, so that the nodes leave the graph at once.
            weakref.finalize(self, participant.close)
            self._participant, self._arguments = participant, arguments
            self._domain_id = participant.domain_id
            if initialize_logging:
                _apply_logging(arguments)
            signals._track_context(self)

    @property
    def participant(self) -> Participant:
        """The DDS participant; RuntimeError before init."""
        if self._participant is None:
            raise RuntimeError('Context must be initialized before it can be used')
        return self._participant

    @property
    def arguments(self) -> _arguments.Arguments:
        """The parsed command line; RuntimeError before init."""
        if self._arguments is None:
            raise RuntimeError('Context must be initialized before it can be used')
        return self._arguments

    def ok(self) -> bool:
        """Return whether the context is initialised and neither shut down nor interrupted."""
        return self._participant is not None and not self._ended.is_set()

    def get_domain_id(self) -> int:
        """Return the DDS domain; RuntimeError before init."""
        if self._participant is None:
            raise RuntimeError('Context must be initialized before it can have a domain id')
        return self._domain_id

    def track_node(self, node: Node) -> None:
        """Destroy this node at shutdown, if it lives until then."""
        with self._lock:
            self._nodes.append(weakref.ref(node))

    def untrack_node(self, node: Node) -> None:
        """Forget a node that was destroyed before the shutdown."""
        with self._lock:
            self._nodes = [reference for reference in self._nodes if reference() is not node]

    def shutdown(self) -> None:
        """Destroy the nodes, leave the domain and call what `on_shutdown` was given.

        Raises:
            RuntimeError: before init.
            RCLError: if a signal or an earlier call has shut it down.
        """
        if self._participant is None:
            raise RuntimeError('Context must be initialized before it can be shutdown')
        with self._lock:
            was_ok = self.ok()
            self._end()
        if not was_ok:
            raise RCLError('failed to shutdown: rcl_shutdown already called on the given context')

    def try_shutdown(self) -> None:
        """Shut down if that has not happened yet."""
        with self._lock:
            if self.ok():
                self._end()

    def destroy(self) -> None:
        """Shut down if need be and leave the domain."""
        if self._participant is not None:
            with self._lock:
                self._end()

    def on_shutdown(self, callback: Callable[[], Any]) -> None:
        """Call `callback` at shutdown; at once if that is past. Methods are held weakly."""
        if not callable(callback):
            raise TypeError(f'callback should be a callable, got {type(callback)}')
        with self._lock:
            if not self._ended.is_set():
                self._callbacks.append(
                    weakref.WeakMethod(callback) if ismethod(callback) else callback
                )
                return
        callback()

    def _interrupt(self) -> None:
        """Make the context not ok, as a signal does: everything else is left as it is."""
        self._ended.set()

    def _wait_for_end(self, timeout_sec: float) -> bool:
        """Wait that long unless the context ends; return whether it has ended."""
        return self._ended.wait(timeout_sec)

    def _end(self) -> None:
        for reference in list(self._nodes):
            node = reference()
            if node is not None:
                node.destroy_node()
        self._ended.set()
        callbacks, self._callbacks = self._callbacks, []
        for entry in callbacks:
            callback = entry() if isinstance(entry, weakref.WeakMethod) else entry
            if callback is not None:
                callback()
        if self._participant is not None:
            self._participant.close()

    def __enter__(self) -> Context:
        if self._participant is None:
            raise RuntimeError(
                'init() must be called on this Context before using it with a context manager'
            )
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.try_shutdown()


def _apply_logging(arguments: _arguments.Arguments) -> None:
    _log_output.enable_console(arguments.stdout_logs)
    if arguments.log_level is not None:
        set_logger_level('', arguments.log_level)
    for name, level in arguments.logger_levels.items():
        set_logger_level(name, level)
