"""QoS event callbacks: not covered. Asking for one raises; passing none is fine."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.exceptions import UnsupportedEventTypeError


class PublisherEventCallbacks:
    """The QoS events of a publisher; only the empty set of callbacks is accepted.

    Args:
        deadline: Called when the offered deadline is missed.
        liveliness: Called when the publisher lost its liveliness.
        incompatible_qos: Called when a subscription asks for more than is offered.
        incompatible_type: Called when a subscription has another type.
        matched: Called when a subscription comes or goes.
        use_default_callbacks: Log incompatible QoS in ROS; here it changes nothing.

    Raises:
        UnsupportedEventTypeError: if a callback is given.
    """

    def __init__(
        self,
        *,
        deadline: Callable[[Any], None] | None = None,
        liveliness: Callable[[Any], None] | None = None,
        incompatible_qos: Callable[[Any], None] | None = None,
        incompatible_type: Callable[[Any], None] | None = None,
        matched: Callable[[Any], None] | None = None,
        use_default_callbacks: bool = True,
    ) -> None:
        _refuse(
            deadline=deadline,
            liveliness=liveliness,
            incompatible_qos=incompatible_qos,
            incompatible_type=incompatible_type,
            matched=matched,
        )
        self.use_default_callbacks = use_default_callbacks


class SubscriptionEventCallbacks:
    """The QoS events of a subscription; only the empty set of callbacks is accepted.

    Args:
        deadline: Called when the requested deadline is missed.
        liveliness: Called when a publisher's liveliness changes.
        message_lost: Called when a message was lost.
        incompatible_qos: Called when a publisher offers less than is asked for.
        incompatible_type: Called when a publisher has another type.
        matched: Called when a publisher comes or goes.
        use_default_callbacks: Log incompatible QoS in ROS; here it changes nothing.

    Raises:
        UnsupportedEventTypeError: if a callback is given.
    """

    def __init__(
        self,
        *,
        deadline: Callable[[Any], None] | None = None,
        liveliness: Callable[[Any], None] | None = None,
        message_lost: Callable[[Any], None] | None = None,
        incompatible_qos: Callable[[Any], None] | None = None,
        incompatible_type: Callable[[Any], None] | None = None,
        matched: Callable[[Any], None] | None = None,
        use_default_callbacks: bool = True,
    ) -> None:
        _refuse(
            deadline=deadline,
            liveliness=liveliness,
            message_lost=message_lost,
            incompatible_qos=incompatible_qos,
            incompatible_type=incompatible_type,
            matched=matched,
        )
        self.use_default_callbacks = use_default_callbacks


def _refuse(**callbacks: Callable[[Any], None] | None) -> None:
    asked = [name for name, callback in callbacks.items() if callback is not None]
    if asked:
        raise UnsupportedEventTypeError(
            f'QoS events are not part of the standalone rclpy, asked for: {", ".join(asked)}'
        )
