"""Logging as ROS does it: by severity, to the console and to /rosout."""

from __future__ import annotations

from rclpy import _log_output
from rclpy.impl.logging_severity import LoggingSeverity
from rclpy.impl.rcutils_logger import RcutilsLogger

__all__ = [
    'LoggingSeverity',
    'RcutilsLogger',
    'clear_config',
    'get_logger',
    'get_logger_effective_level',
    'get_logger_level',
    'get_logging_severity_from_string',
    'initialize',
    'set_logger_level',
    'shutdown',
]


def get_logger(name: str) -> RcutilsLogger:
    """The logger of a name; ValueError for an empty one."""
    if not name:
        raise ValueError('Logger name must not be empty.')
    return RcutilsLogger(name)


def initialize() -> None:
    """Start from ROS's defaults: level INFO, console on."""
    _log_output.reset()


def shutdown() -> None:
    """Return to ROS's defaults."""
    _log_output.reset()


def clear_config() -> None:
    """Return to ROS's defaults."""
    _log_output.reset()


def set_logger_level(
    name: str, level: LoggingSeverity | int, detailed_error: bool = False
) -> None:
    """Set a logger's level; UNSET gives it its parent's again.

    Args:
        name: The logger.
        level: The level.
        detailed_error: Accepted as in rclpy; errors here always name the level.

    Raises:
        ValueError: If the level is none of LoggingSeverity.
    """
    _log_output.set_level(name, LoggingSeverity(level))


def get_logger_level(name: str) -> LoggingSeverity:
    """The level that counts for a logger."""
    return _log_output.effective_level(name)


def get_logger_effective_level(name: str) -> LoggingSeverity:
    """The level that counts for a logger."""
    return _log_output.effective_level(name)


def get_logging_severity_from_string(log_severity: str) -> LoggingSeverity:
    """The severity of a name in any case; RuntimeError for another name."""
    try:
        return LoggingSeverity[log_severity.upper()]
    except KeyError:
        raise RuntimeError(
            f'Failed to get log severity from name: {log_severity}, expected one of '
            + ', '.join(LoggingSeverity.__members__)
        ) from None
