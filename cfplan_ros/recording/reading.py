"""Says what a run file holds, be it complete or not."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from cfplan_msgs.srv import PlanManipulation
from mcap.records import Channel, Header, Message, Metadata, Schema
from rclpy.serialization import deserialize_message

from cfplan_ros.recording.intact import IntactRecords
from cfplan_ros.recording.provenance import RECORD
from cfplan_ros.recording.rewriting import RECOVERY_RECORD
from cfplan_ros.recording.run_file import lock
from cfplan_ros.recording.schemas import message_class_of, schema_of
from cfplan_ros.recording.topics import REQUEST, RESPONSE, full_name

# Numbers and names of rmw's policies, as rosbag2 has written them.
_DURABILITY = {1: 'latched', 2: 'volatile', 'transient_local': 'latched', 'volatile': 'volatile'}
_RELIABILITY = {
    1: 'reliable',
    2: 'best effort',
    'reliable': 'reliable',
    'best_effort': 'best effort',
}


@dataclass(frozen=True)
class TopicSummary:
    """A topic of a file.

    Attributes:
        name: From the root.
        type_name: E.g. ``sensor_msgs/msg/JointState``.
        qos: Reliability, and in a second line durability and depth; empty if the file does not
            say.
        count: Number of messages.
        first_ns: Smallest log time, ns; 0 without messages.
        last_ns: Largest log time, ns; 0 without messages.
    """

    name: str
    type_name: str
    qos: str
    count: int
    first_ns: int
    last_ns: int


@dataclass(frozen=True)
class RunSummary:
    """What a file holds.

    Attributes:
        size: Bytes.
        profile: Of the MCAP header, ``ros2`` for a run.
        complete: False if its writer did not get to its end, or has not yet, or if anything is
            damaged.
        in_use: True if its writer is at work.
        damage: What is damaged, or was lost, but for a torn end, in words.
        written: How many messages the file says were written, those torn off its end apart.
        metadata: The record ``cfplan``, see `provenance`; empty for a foreign recording.
        recovery: The record ``cfplan_recovery``: how many messages were kept, lost and added;
            empty for a file that was not recovered.
        topics: By name.
        request: The ``PlanManipulation.Request``, or None.
        response: The ``PlanManipulation.Response``, or None.
        unknown_types: Types of request or response that are not those installed; the message
            is None then.
    """

    size: int
    profile: str
    complete: bool
    in_use: bool
    damage: tuple[str, ...]
    written: int
    metadata: dict[str, str]
    recovery: dict[str, str]
    topics: tuple[TopicSummary, ...]
    request: Any | None
    response: Any | None
    unknown_types: tuple[str, ...]

    @property
    def count(self) -> int:
        """Number of messages."""
        return sum(topic.count for topic in self.topics)

    @property
    def span_ns(self) -> tuple[int, int]:
        """Smallest and largest log time of all messages, ns; zeros if there are none."""
        filled = [topic for topic in self.topics if topic.count]
        if not filled:
            return 0, 0
        return min(topic.first_ns for topic in filled), max(topic.last_ns for topic in filled)


def read_run(path: Path) -> RunSummary:
    """Read a file, as far as it is intact.

    Raises:
        NotMcapError: The file is something else.
        OSError: It cannot be read.
    """
    profile = ''
    metadata: dict[str, str] = {}
    recovery: dict[str, str] = {}
    schemas: dict[int, str] = {}
    channels: dict[int, Channel] = {}
    times: dict[int, list[int]] = {}
    called: dict[str, Message] = {}
    request = response = ''
    in_use = _in_use(path)
    with path.open('rb') as file:
        records = IntactRecords(file, path)
        for record in records:
            if isinstance(record, Header):
                profile = record.profile
            elif isinstance(record, Metadata) and record.name == RECORD:
                metadata = record.metadata
                node = metadata.get('node', '')
                request, response = full_name(REQUEST, node), full_name(RESPONSE, node)
            elif isinstance(record, Metadata) and record.name == RECOVERY_RECORD:
                recovery = record.metadata
            elif isinstance(record, Schema):
                schemas[record.id] = record.name
            elif isinstance(record, Channel):
                channels[record.id] = record
            elif isinstance(record, Message):
                times.setdefault(record.channel_id, []).append(record.log_time)
                topic = channels[record.channel_id].topic
                if topic in (request, response):
                    called[topic] = record
    topics = [
        TopicSummary(
            channel.topic,
            schemas.get(channel.schema_id, ''),
            _qos_in_words(channel.metadata.get('offered_qos_profiles', '')),
            len(times.get(channel.id, ())),
            min(times.get(channel.id, (0,))),
            max(times.get(channel.id, (0,))),
        )
        for channel in channels.values()
    ]
    decoded = {
        topic: _decoded(record, channels[record.channel_id]) for topic, record in called.items()
    }
    return RunSummary(
        records.size,
        profile,
        records.complete,
        in_use,
        records.damage,
        records.written,
        metadata,
        recovery,
        tuple(sorted(topics, key=lambda topic: topic.name)),
        decoded.get(request),
        decoded.get(response),
        tuple(
            schemas[channels[record.channel_id].schema_id]
            for topic, record in called.items()
            if decoded[topic] is None
        ),
    )


def read_messages(path: Path) -> Iterator[tuple[str, int, Any]]:
    """Read topic, log time in ns and message, in the order of the file, as far as it is intact.

    Raises:
        NotMcapError: The file is something else.
        LookupError: A type is not installed.
    """
    schemas: dict[int, str] = {}
    channels: dict[int, Channel] = {}
    with path.open('rb') as file:
        for record in IntactRecords(file, path):
            if isinstance(record, Schema):
                schemas[record.id] = record.name
            elif isinstance(record, Channel):
                channels[record.id] = record
            elif isinstance(record, Message):
                channel = channels[record.channel_id]
                message_class = message_class_of(schemas[channel.schema_id])
                message = deserialize_message(record.data, message_class)
                yield channel.topic, record.log_time, message


def _in_use(path: Path) -> bool:
    # The lock goes with this file object at once: others may want to recover the file.
    with path.open('rb') as file:
        return lock(file.fileno()) is False


def _decoded(record: Message, channel: Channel) -> Any | None:
    """The message of a service call, or None if its type has changed since."""
    half = (
        PlanManipulation.Request if channel.topic.endswith(REQUEST) else PlanManipulation.Response
    )
    if channel.metadata.get('topic_type_hash') != schema_of(half).type_hash:
        return None
    return deserialize_message(record.data, half)


def _qos_in_words(text: str) -> str:
    try:
        profile = yaml.safe_load(text)[0]
        reliability = _RELIABILITY.get(profile['reliability'], '')
        durability = _DURABILITY.get(profile['durability'], '')
        return f'{reliability}\n{durability}, {profile["depth"]}'
    except (yaml.YAMLError, LookupError, TypeError):
        return ''
