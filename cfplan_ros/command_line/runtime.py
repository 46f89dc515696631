"""What the commands that talk ROS need from the installation."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from cfplan_core.errors import CfplanError


@contextmanager
def needs_rclpy() -> Iterator[None]:
    """Turn a failed import of rclpy or of the messages into an error that says what to do.

    Raises:
        CfplanError: A module that the node and its clients need is not installed.
    """
    try:
        yield
    except ImportError as error:
        raise CfplanError(
            f'this command needs rclpy and cfplan_msgs: {error}; '
            'the section ROS 2 of the README says how to install them'
        ) from error
