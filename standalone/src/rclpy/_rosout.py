"""Log messages on /rosout."""

from __future__ import annotations

import contextlib
from collections.abc import Callable

from rcl_interfaces.msg import Log
from rclpy import _log_output
from rclpy.exceptions import InvalidHandle, RCLError
from rclpy.qos import qos_profile_rosout_default
from rclpy.time import Time

__all__ = ['ROSOUT_TOPIC', 'Rosout', 'log_message', 'qos_profile_rosout_default']

ROSOUT_TOPIC = '/rosout'


def log_message(record: _log_output.LogRecord) -> Log:
    """A log message as rcl_interfaces/Log."""
    return Log(
        stamp=Time(nanoseconds=record.stamp).to_msg(),
        level=int(record.severity),
        name=record.name,
        msg=record.message,
        file=record.file_name,
        function=record.function_name,
        line=record.line_number,
    )


class Rosout:
    """Publishes what a node's logger and its children log.

    Args:
        logger_name: The node's logger.
        publish: Publishes a Log on the node's /rosout publisher.
    """

    def __init__(self, logger_name: str, publish: Callable[[Log], None]) -> None:
        self._logger_name = logger_name
        self._publish = publish
        self._open = True
        _log_output.add_sink(self._take)

    def close(self) -> None:
        """Publish no more; the publisher goes with its node."""
        if self._open:
            self._open = False
            _log_output.remove_sink(self._take)

    def _take(self, record: _log_output.LogRecord) -> None:
        name = record.name
        if name == self._logger_name or name.startswith(f'{self._logger_name}.'):
            # A node may be destroyed while another thread logs.
            with contextlib.suppress(InvalidHandle, RCLError):
                self._publish(log_message(record))
