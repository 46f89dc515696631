"""Writes ROS messages into an MCAP stream in the layout of rosbag2."""

from __future__ import annotations

from typing import IO, Any

from mcap.records import Attachment, Channel, McapRecord, Message, Metadata, Schema
from mcap.writer import CompressionType, Writer
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message

from cfplan_core import __version__
from cfplan_ros.recording.qos_metadata import offered_qos_profiles
from cfplan_ros.recording.schemas import ENCODING, schema_of

PROFILE = 'ros2'


class MessageWriter:
    """Schemas and channels are written when their first message is.

    Args:
        stream: Takes the bytes; what it raises goes through every method.
        profile: Of the file's header.
    """

    def __init__(self, stream: IO[bytes], profile: str = PROFILE) -> None:
        self._writer: Any = Writer(stream, compression=CompressionType.ZSTD, enable_data_crcs=True)
        self._writer.start(profile=profile, library=f'cfplan {__version__}')
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._copied_schemas = {0: 0}
        self._copied_channels: dict[int, int] = {}

    def add_metadata(self, name: str, values: dict[str, str]) -> None:
        """Add a record of names and values."""
        self._writer.add_metadata(name, values)

    def add(self, topic: str, message: Any, time_ns: int, qos: QoSProfile) -> None:
        """Add a message.

        Args:
            topic: Name from the root.
            message: Of the same type as all others of the topic.
            time_ns: Log and publish time, ns since the epoch.
            qos: What the topic's publisher offers; read at the topic's first message.
        """
        channel = self._channels.get(topic)
        if channel is None:
            channel = self._channels[topic] = self._register(topic, type(message), qos)
        self._writer.add_message(channel, time_ns, serialize_message(message), time_ns)

    def copy(self, record: McapRecord) -> None:
        """Add what another file holds, record by record in its order."""
        if isinstance(record, Message):
            self._writer.add_message(
                self._copied_channels[record.channel_id],
                record.log_time,
                record.data,
                record.publish_time,
                record.sequence,
            )
        elif isinstance(record, Schema) and record.id not in self._copied_schemas:
            copied = self._writer.register_schema(record.name, record.encoding, record.data)
            self._copied_schemas[record.id] = copied
            self._schemas.setdefault(record.name, copied)
        elif isinstance(record, Channel) and record.id not in self._copied_channels:
            copied = self._writer.register_channel(
                record.topic,
                record.message_encoding,
                self._copied_schemas[record.schema_id],
                record.metadata,
            )
            self._copied_channels[record.id] = copied
            self._channels.setdefault(record.topic, copied)
        elif isinstance(record, Metadata):
            self._writer.add_metadata(record.name, record.metadata)
        elif isinstance(record, Attachment):
            self._writer.add_attachment(
                record.create_time, record.log_time, record.name, record.media_type, record.data
            )

    def flush(self) -> None:
        """End the chunk, so that all that was added can be read once the stream is flushed."""
        self._writer.flush()

    def finish(self) -> None:
        """Write the index and flush the stream; nothing can be added any more."""
        self._writer.finish()
        self._writer.flush()

    def _register(self, topic: str, message_class: type[Any], qos: QoSProfile) -> int:
        schema = schema_of(message_class)
        if schema.name not in self._schemas:
            self._schemas[schema.name] = self._writer.register_schema(
                schema.name, ENCODING, schema.text.encode()
            )
        channel: int = self._writer.register_channel(
            topic,
            'cdr',
            self._schemas[schema.name],
            {
                'offered_qos_profiles': offered_qos_profiles(qos),
                'topic_type_hash': schema.type_hash,
            },
        )
        return channel
