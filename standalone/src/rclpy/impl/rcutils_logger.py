"""Loggers: named sources of messages, with a level each and filters for each place of call."""

from __future__ import annotations

import sys
import threading
import time
from dataclasses import dataclass
from types import CodeType, FrameType
from typing import Any

from rclpy import _log_output
from rclpy.clock import Clock
from rclpy.constants import S_TO_NS
from rclpy.impl.logging_severity import LoggingSeverity

_FILTERS = {
    'throttle': ('throttle_duration_sec', 'throttle_time_source_type'),
    'skip_first': ('skip_first',),
    'once': ('once',),
}
_OPTIONS = [option for options in _FILTERS.values() for option in options]
_SYSTEM_CLOCK = Clock()


@dataclass
class _CallSite:
    """What one place of call asked for, and what its filters remember."""

    name: str
    severity: LoggingSeverity
    filters: list[str]
    options: dict[str, Any]
    last_logged: float = 0
    called: bool = False
    logged: bool = False

    def check_unchanged(
        self, name: str, severity: LoggingSeverity, filters: list[str], options: dict[str, Any]
    ) -> None:
        if severity != self.severity:
            raise ValueError('Logger severity cannot be changed between calls.')
        if name != self.name:
            raise ValueError('Logger name cannot be changed between calls.')
        if filters != self.filters:
            raise ValueError('Requested logging filters cannot be changed between calls.')
        if filters and options != self.options:
            raise ValueError('Logging filter parameters cannot be changed between calls.')

    def passes(self) -> bool:
        """Ask the filters in turn; the first that refuses ends it."""
        return all(getattr(self, f'_{name}')() for name in self.filters)

    def _throttle(self) -> bool:
        clock = self.options.get('throttle_time_source_type', _SYSTEM_CLOCK)
        now: int = clock.now().nanoseconds
        if now < self.last_logged + self.options['throttle_duration_sec'] * S_TO_NS:
            return False
        self.last_logged = now
        return True

    def _skip_first(self) -> bool:
        called, self.called = self.called, True
        return called

    def _once(self) -> bool:
        logged, self.logged = self.logged, True
        return not logged


class RcutilsLogger:
    """A logger.

    Args:
        name: Its name, parts separated by dots; a part's parent is what stands before it.
    """

    def __init__(self, name: str = '') -> None:
        self.name = name
        self._lock = threading.Lock()
        self._call_sites: dict[tuple[CodeType, int], _CallSite] = {}

    def get_child(self, name: str) -> RcutilsLogger:
        """The logger of this name below this one; ValueError for an empty name."""
        if not name:
            raise ValueError('Child logger name must not be empty.')
        return RcutilsLogger(f'{self.name}.{name}' if self.name else name)

    def set_level(self, level: LoggingSeverity) -> None:
        """Set the level below which messages are dropped."""
        _log_output.set_level(self.name, LoggingSeverity(level))

    def get_effective_level(self) -> LoggingSeverity:
        """The level that counts: this logger's or that of the nearest parent that has one."""
        return _log_output.effective_level(self.name)

    def is_enabled_for(self, severity: LoggingSeverity) -> bool:
        """Whether messages of a severity are not dropped."""
        return LoggingSeverity(severity) >= self.get_effective_level()

    def log(self, message: str, severity: LoggingSeverity, **kwargs: Any) -> bool:
        """Log a message.

        Args:
            message: The text.
            severity: Its severity, the same at every call from one place.
            **kwargs: `once=True` logs the first call from this place only, `skip_first=True` all
                but the first, `throttle_duration_sec=` [s] at most one in that time, measured by
                the Clock `throttle_time_source_type=`; `name=` another logger's name.

        Returns:
            Whether the message was logged.

        Raises:
            TypeError: For an unknown or missing option.
            ValueError: If a place changes its severity or options between calls.
        """
        severity = LoggingSeverity(severity)
        name = kwargs.pop('name', self.name)
        filters = _requested_filters(kwargs)
        frame = _caller()
        with self._lock:
            site = self._call_sites.get((frame.f_code, frame.f_lasti))
            if site is None:
                site = _CallSite(name, severity, filters, kwargs)
                self._call_sites[frame.f_code, frame.f_lasti] = site
            else:
                site.check_unchanged(name, severity, filters, kwargs)
            if not self.is_enabled_for(severity) or not site.passes():
                return False
        _log_output.emit(
            _log_output.LogRecord(
                stamp=time.time_ns(),
                severity=severity,
                name=name,
                message=str(message),
                file_name=frame.f_code.co_filename,
                function_name=frame.f_code.co_name,
                line_number=frame.f_lineno,
            )
        )
        return True

    def debug(self, message: str, **kwargs: Any) -> bool:
        """Log with severity DEBUG; see log."""
        return self.log(message, LoggingSeverity.DEBUG, **kwargs)

    def info(self, message: str, **kwargs: Any) -> bool:
        """Log with severity INFO; see log."""
        return self.log(message, LoggingSeverity.INFO, **kwargs)

    def warning(self, message: str, **kwargs: Any) -> bool:
        """Log with severity WARN; see log."""
        return self.log(message, LoggingSeverity.WARN, **kwargs)

    def warn(self, message: str, **kwargs: Any) -> bool:
        """Log with severity WARN; the older name of `warning`."""
        return self.log(message, LoggingSeverity.WARN, **kwargs)

    def error(self, message: str, **kwargs: Any) -> bool:
        """Log with severity ERROR; see log."""
        return self.log(message, LoggingSeverity.ERROR, **kwargs)

    def fatal(self, message: str, **kwargs: Any) -> bool:
        """Log with severity FATAL; see log."""
        return self.log(message, LoggingSeverity.FATAL, **kwargs)


def _requested_filters(options: dict[str, Any]) -> list[str]:
    for option in options:
        if option not in _OPTIONS:
            raise TypeError(
                f'parameter "{option}" is not one of the recognized logging options "{_OPTIONS}"'
            )
    filters = [name for name, own in _FILTERS.items() if any(options.get(key) for key in own)]
    if 'throttle' in filters:
        if options.get('throttle_duration_sec') is None:
            raise TypeError(
                'required parameter "throttle_duration_sec" not specified '
                'but is required for the the logging filter "throttle"'
            )
        clock = options.get('throttle_time_source_type', _SYSTEM_CLOCK)
        if not isinstance(clock, Clock):
            raise ValueError(
                f'Received throttle_time_source_type of "{clock}" is not a clock instance'
            )
    return filters


def _caller() -> FrameType:
    """The first frame outside this file."""
    frame = sys._getframe()
    while frame.f_code.co_filename == __file__ and frame.f_back is not None:
        frame = frame.f_back
    return frame
