"""Publishers."""

from __future__ import annotations

from types import TracebackType
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from rclpy.constants import S_TO_NS
from rclpy.duration import Duration
from rclpy.exceptions import InvalidHandle, RCLError
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from ros_standalone.middleware.errors import ClosedError

if TYPE_CHECKING:
    from rclpy.callback_groups import CallbackGroup
    from rclpy.context import Context
    from ros_standalone.middleware import Writer

MessageT = TypeVar('MessageT')
_FOR_EVER = Duration(nanoseconds=-1)
_LONG_SEC = 1e9


class Publisher(Generic[MessageT]):
    """Sends messages on a topic; made by `Node.create_publisher`.

    Args:
        writer: The middleware's writer.
        msg_type: The message class.
        topic: The topic as it was given.
        topic_name: The full name after expansion and remapping.
        qos_profile: The quality of service that is offered.
        callback_group: The group that event callbacks would belong to.
        context: The context of the node.
    """

    def __init__(
        self,
        writer: Writer,
        msg_type: type[MessageT],
        topic: str,
        topic_name: str,
        qos_profile: QoSProfile,
        callback_group: CallbackGroup | None,
        context: Context,
    ) -> None:
        self._writer = writer
        self._topic_name = topic_name
        self._context = context
        self._destroyed = False
        self.msg_type = msg_type
        self.topic = topic
        self.qos_profile = qos_profile
        self.callback_group = callback_group
        self.event_handlers: list[Any] = []

    @property
    def topic_name(self) -> str:
        """The full name of the topic."""
        return self._topic_name

    def publish(self, msg: MessageT | bytes) -> None:
        """Send a message, or the CDR bytes of one.

        Raises:
            TypeError: if it is neither of the publisher's type nor bytes.
            RCLError: if the context was shut down.
            InvalidHandle: if the publisher was destroyed.
        """
        self._check()
        if isinstance(msg, self.msg_type):
            data = serialize_message(msg)
        elif isinstance(msg, bytes):
            data = msg
        else:
            raise TypeError(f'Expected {self.msg_type}, got {type(msg)}')
        if not self._context.ok():
            raise RCLError("Failed to publish: publisher's context is invalid")
        try:
            self._writer.publish(data)
        except ClosedError:
            # Another thread has destroyed the publisher since.
            raise InvalidHandle(
                'cannot use Destroyable because destruction was requested'
            ) from None

    def get_subscription_count(self) -> int:
        """Return how many subscriptions receive what is published."""
        self._check()
        return self._writer.matched_count()

    def assert_liveliness(self) -> None:
        """Say that the publisher is alive, for the liveliness MANUAL_BY_TOPIC."""
        self._check()
        self._writer.assert_liveliness()

    def wait_for_all_acked(self, timeout: Duration = _FOR_EVER) -> bool:
        """Wait until every matched reliable subscription has what was published.

        Args:
            timeout: How long at most; negative means without limit.

        Returns:
            Whether all have it.
        """
        self._check()
        return self._writer.wait_for_acks(_seconds(timeout))

    def destroy(self) -> None:
        """Leave the topic; prefer `Node.destroy_publisher`."""
        if not self._destroyed:
            self._destroyed = True
            self._writer.close()

    def _check(self) -> None:
        if self._destroyed:
            raise InvalidHandle('cannot use Destroyable because destruction was requested')

    def __enter__(self) -> Publisher[MessageT]:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.destroy()


def _seconds(timeout: Duration) -> float:
    return _LONG_SEC if timeout.nanoseconds < 0 else timeout.nanoseconds / S_TO_NS
