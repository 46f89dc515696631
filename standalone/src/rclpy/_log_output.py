"""Where log messages go: levels by logger, the console in ROS's format, and further sinks."""

from __future__ import annotations

import contextlib
import os
import re
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TextIO

from rclpy.impl.logging_severity import LoggingSeverity

_DEFAULT_FORMAT = '[{severity}] [{time}] [{name}]: {message}'
_COLOURS = {
    LoggingSeverity.DEBUG: '\033[32m',
    LoggingSeverity.INFO: '\033[0m',
    LoggingSeverity.WARN: '\033[33m',
    LoggingSeverity.ERROR: '\033[31m',
    LoggingSeverity.FATAL: '\033[31m',
}
_COLOUR_END = '\033[0m'


@dataclass(frozen=True)
class LogRecord:
    """One log message.

    Attributes:
        stamp: When it was logged, nanoseconds since the epoch.
        severity: Its severity.
        name: Its logger's name.
        message: Its text.
        file_name: Path of the file that logged it.
        function_name: The function that logged it.
        line_number: The line that logged it.
    """

    stamp: int
    severity: LoggingSeverity
    name: str
    message: str
    file_name: str
    function_name: str
    line_number: int


Sink = Callable[[LogRecord], None]

_lock = threading.RLock()
_levels: dict[str, LoggingSeverity] = {}
_sinks: list[Sink] = []
_in_sink = threading.local()
_default_level = LoggingSeverity.INFO
_console_enabled = True


def set_level(name: str, level: LoggingSeverity) -> None:
    """Set a logger's level; UNSET makes it its parent's again, '' names the default level."""
    global _default_level
    with _lock:
        if name == '':
            _default_level = level or LoggingSeverity.INFO
        elif level is LoggingSeverity.UNSET:
            _levels.pop(name, None)
        else:
            _levels[name] = level


def effective_level(name: str) -> LoggingSeverity:
    """A logger's level: its own, else that of the nearest parent that has one."""
    with _lock:
        while name:
            if name in _levels:
                return _levels[name]
            name = name.rpartition('.')[0]
        return _default_level


def reset() -> None:
    """Forget all levels and switch the console on."""
    global _console_enabled
    with _lock:
        _levels.clear()
        set_level('', LoggingSeverity.UNSET)
        _console_enabled = True


def enable_console(enabled: bool) -> None:
    """Switch the console on or off."""
    global _console_enabled
    _console_enabled = enabled


def add_sink(sink: Sink) -> None:
    """Give every further message to a sink, too."""
    with _lock:
        _sinks.append(sink)


def remove_sink(sink: Sink) -> None:
    """Give a sink no more messages."""
    with _lock:
        _sinks.remove(sink)


def emit(record: LogRecord) -> None:
    """Send a message to the console and the sinks, whatever its level."""
    if _console_enabled:
        _write(record)
    if getattr(_in_sink, 'active', False):
        # What a sink itself logs stays on the console.
        return
    with _lock:
        sinks = list(_sinks)
    _in_sink.active = True
    try:
        for sink in sinks:
            sink(record)
    finally:
        _in_sink.active = False


def _write(record: LogRecord) -> None:
    stream = sys.stdout if os.environ.get('RCUTILS_LOGGING_USE_STDOUT') == '1' else sys.stderr
    text = format_record(record, os.environ.get('RCUTILS_CONSOLE_OUTPUT_FORMAT'))
    # A console that is gone must not end the program.
    with _lock, contextlib.suppress(OSError, ValueError, AttributeError):
        if _colourful(stream):
            text = f'{_COLOURS[record.severity]}{text}{_COLOUR_END}'
        stream.write(f'{text}\n')
        stream.flush()


def _colourful(stream: TextIO) -> bool:
    wanted = os.environ.get('RCUTILS_COLORIZED_OUTPUT')
    return wanted == '1' if wanted in ('0', '1') else stream.isatty()


def format_record(record: LogRecord, output_format: str | None = None) -> str:
    r"""The console's line for a message.

    Args:
        record: The message.
        output_format: Text with tokens in braces, as RCUTILS_CONSOLE_OUTPUT_FORMAT holds it;
            ROS's default when None or empty. `\n` and `\t` in it mean line end and tab.
    """
    seconds, nanoseconds = divmod(record.stamp, 1_000_000_000)
    tokens = {
        'severity': record.severity.name,
        'name': record.name,
        'message': record.message,
        'function_name': record.function_name,
        'file_name': record.file_name,
        'short_file_name': os.path.basename(record.file_name),
        'line_number': str(record.line_number),
        'time': f'{seconds}.{nanoseconds:09}',
        'time_as_nanoseconds': str(record.stamp),
        'date_time_with_ms': (
            time.strftime('%Y-%m-%d %H:%M:%S', time.localtime(seconds))
            + f'.{nanoseconds // 1_000_000:03}'
        ),
    }
    text = (output_format or _DEFAULT_FORMAT).replace('\\n', '\n').replace('\\t', '\t')
    return re.sub(r'\{(\w+)\}', lambda match: tokens.get(match[1], match[0]), text)
