"""Subscriptions."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from enum import Enum
from types import TracebackType
from typing import TYPE_CHECKING, Any, Generic, TypedDict, TypeVar

from rclpy.exceptions import InvalidHandle
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_or_drop

if TYPE_CHECKING:
    from rclpy._executor import Executor
    from rclpy.callback_groups import CallbackGroup
    from ros_standalone.middleware import Reader

MessageT = TypeVar('MessageT')


class MessageInfo(TypedDict):
    """What is known of a message beside its content: times in nanoseconds since the epoch."""

    source_timestamp: int
    received_timestamp: int
    publication_sequence_number: int | None
    reception_sequence_number: int | None


class Subscription(Generic[MessageT]):
    """Receives the messages of a topic; made by `Node.create_subscription`.

    Args:
        reader: The middleware's reader.
        msg_type: The message class.
        topic: The topic as it was given.
        topic_name: The full name after expansion and remapping.
        callback: Called with the message, or with the message and its MessageInfo.
        callback_group: The group that the callback belongs to.
        qos_profile: The quality of service that is asked for.
        raw: Give the callback the CDR bytes instead of the message.

    Raises:
        RuntimeError: if the callback takes neither one nor two arguments.
    """

    class CallbackType(Enum):
        """What the callback takes."""

        MessageOnly = 0
        WithMessageInfo = 1

    def __init__(
        self,
        reader: Reader,
        msg_type: type[MessageT],
        topic: str,
        topic_name: str,
        callback: Callable[..., Any],
        callback_group: CallbackGroup,
        qos_profile: QoSProfile,
        raw: bool,
    ) -> None:
        self.callback = callback
        self._reader = reader
        self._topic_name = topic_name
        self._destroyed = False
        self.msg_type = msg_type
        self.topic = topic
        self.callback_group = callback_group
        self.qos_profile = qos_profile
        self.raw = raw
        self.event_handlers: list[Any] = []

    @property
    def topic_name(self) -> str:
        """The full name of the topic."""
        return self._topic_name

    @property
    def callback(self) -> Callable[..., Any]:
        """What is called with each message."""
        return self._callback

    @callback.setter
    def callback(self, value: Callable[..., Any]) -> None:
        self._callback_type = callback_type(value)
        self._callback = value

    def get_publisher_count(self) -> int:
        """Return how many publishers this receives from."""
        self._check()
        return self._reader.matched_count()

    def destroy(self) -> None:
        """Leave the topic; prefer `Node.destroy_subscription`."""
        if not self._destroyed:
            self._destroyed = True
            self._reader.close()

    @property
    def _source(self) -> Reader:
        return self._reader

    def _take_job(self, executor: Executor) -> Callable[[], Any] | None:
        """Return the call of the callback for the next message, None if there is none."""
        arguments = self._take()
        return None if arguments is None else functools.partial(self.callback, *arguments)

    def _take(self) -> tuple[Any, ...] | None:
        """Return the callback's arguments for the next message, None if there is no message."""
        sample = None if self._destroyed else self._reader.take()
        if sample is None:
            return None
        data, info = sample
        message: Any = data
        if not self.raw:
            message = deserialize_or_drop(data, self.msg_type, self._topic_name)
            if message is None:
                return None
        if self._callback_type is Subscription.CallbackType.MessageOnly:
            return (message,)
        return message, MessageInfo(
            source_timestamp=info.source_timestamp,
            received_timestamp=info.received_timestamp,
            publication_sequence_number=info.publication_sequence_number,
            reception_sequence_number=None,
        )

    def _check(self) -> None:
        if self._destroyed:
            raise InvalidHandle('cannot use Destroyable because destruction was requested')

    def __enter__(self) -> Subscription[MessageT]:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.destroy()


def callback_type(callback: Callable[..., Any]) -> Subscription.CallbackType:
    """Return whether a callback takes the message only or its MessageInfo too.

    Raises:
        RuntimeError: if it takes neither one nor two arguments.
    """
    signature = inspect.signature(callback)
    for kind, arguments in (
        (Subscription.CallbackType.MessageOnly, (None,)),
        (Subscription.CallbackType.WithMessageInfo, (None, None)),
    ):
        try:
            signature.bind(*arguments)
        except TypeError:
            continue
        return kind
    raise RuntimeError(
        'Subscription.__init__(): callback should be either be callable with one argument'
        '(to get only the message) or two (to get message and message info)'
    )
