"""Messages to bytes (CDR with its 4-byte header) and back."""

from __future__ import annotations

from typing import Any, TypeVar

from rclpy.logging import get_logger
from ros_standalone import interfaces

MessageT = TypeVar('MessageT')


def serialize_message(message: Any) -> bytes:
    """Return the CDR bytes of a message, as they go over the wire."""
    return bytes(interfaces.serialize(message))


def deserialize_message(serialized_message: bytes, message_type: type[MessageT]) -> MessageT:
    """Return the message of type `message_type` that the CDR bytes hold."""
    message: MessageT = interfaces.deserialize(serialized_message, message_type)
    return message


def deserialize_or_drop(data: bytes, message_type: type[MessageT], where: str) -> MessageT | None:
    """Return the message, or None after logging why the bytes that came are none.

    Args:
        data: CDR bytes.
        message_type: The message class.
        where: The topic or service, for the log.
    """
    try:
        return deserialize_message(data, message_type)
    except interfaces.SerializationError as error:
        get_logger('rclpy').error(f'{where}: dropped {len(data)} bytes that came: {error}')
        return None
