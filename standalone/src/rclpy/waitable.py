"""Waitables: not covered, as they are built on handles of ROS's C library."""

from __future__ import annotations

from typing import Any


class Waitable:
    """Something of a user's own for the executor to wait on: not part of this runtime."""

    def __init__(self, callback_group: Any) -> None:
        raise NotImplementedError(
            'rclpy.waitable.Waitable is not part of the standalone rclpy; use '
            'Node.create_guard_condition to have a callback run from another thread'
        )
