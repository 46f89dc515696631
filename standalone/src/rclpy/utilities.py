"""The default context and small conversions."""

from __future__ import annotations

import sys
import threading

from rclpy import _arguments
from rclpy.constants import S_TO_NS
from rclpy.context import Context

_default_context: Context | None = None
_lock = threading.Lock()


def get_default_context(*, shutting_down: bool = False) -> Context:
    """Return the context that is meant where none is given.

    Args:
        shutting_down: Forget it, so that the next call begins a new one.
    """
    global _default_context
    with _lock:
        context = _default_context or Context()
        _default_context = None if shutting_down else context
        return context


def ok(*, context: Context | None = None) -> bool:
    """Return whether the context is initialised and not shut down."""
    return (context or get_default_context()).ok()


def shutdown(*, context: Context | None = None) -> None:
    """Shut the context down; an error if that has happened already."""
    (context or get_default_context(shutting_down=True)).shutdown()


def try_shutdown(*, context: Context | None = None) -> None:
    """Shut the context down unless that has happened already."""
    if context is not None:
        context.try_shutdown()
    else:
        # Also one that a signal has ended is left and forgotten, so that init can follow.
        get_default_context(shutting_down=True).destroy()


def remove_ros_args(args: list[str] | None = None) -> list[str]:
    """Return the command line without what lies between --ros-args and its end."""
    return _arguments.remove_ros_args(list(sys.argv) if args is None else list(args))


def timeout_sec_to_nsec(timeout_sec: float | None) -> int:
    """Return a timeout in nanoseconds; -1 (wait for ever) for None and for negative ones.

    Raises:
        ValueError: if the number of nanoseconds does not fit 64 bits.
    """
    if timeout_sec is None or timeout_sec < 0:
        return -1
    nanoseconds = int(float(timeout_sec) * S_TO_NS)
    if nanoseconds >= 2**63:
        raise ValueError(f'a timeout must be below 2**63 nanoseconds, got {timeout_sec} seconds')
    return nanoseconds


def get_rmw_implementation_identifier() -> str:
    """Return the name of the ROS middleware whose wire protocol this is."""
    return 'rmw_cyclonedds_cpp'


def get_available_rmw_implementations() -> set[str]:
    """Return the names of the middlewares that can be used."""
    return {get_rmw_implementation_identifier()}
