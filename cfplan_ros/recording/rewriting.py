"""Copies what is intact of a run into a complete file, with what its preview lacks."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, BinaryIO

from cfplan_msgs.msg import ManipulationPlan
from mcap.records import Channel, Header, Message, Metadata
from rclpy.serialization import deserialize_message

from cfplan_core.errors import InvalidProblemError
from cfplan_core.model import Problem
from cfplan_core.model.loading import problem_from_mapping
from cfplan_ros.recording.intact import IntactRecords
from cfplan_ros.recording.message_writer import PROFILE, MessageWriter
from cfplan_ros.recording.provenance import RECORD
from cfplan_ros.recording.topics import PLAN, full_name, qos_by_topic

Preview = Callable[[Problem, Any, int], Iterable[tuple[int, str, Any]]]
"""What viewers are shown of a plan: takes the problem, the ``ManipulationPlan`` and the plan's
stamp in ns, gives log time in ns, topic and message, in the order of time."""

RECOVERY_RECORD = 'cfplan_recovery'

_NS_PER_S = 10**9


class Contents:
    """What a file holds as far as it is intact.

    The file is read once for this and once more by `rewrite`, so that it need not fit in memory.

    Attributes:
        profile: Of the file's header.
        metadata: The record that says how to run again; empty if there is none.
        node: Fully qualified name of the node that recorded.
        plan: The last plan, serialized; empty if there is none.
        times: Log times by topic, ns, of a run of cfplan.
        extent: How much of the file is intact.
    """

    def __init__(self, file: BinaryIO, path: Path) -> None:
        self._file = file
        self._path = path
        self.profile = PROFILE
        self.metadata: dict[str, str] = {}
        self.node = ''
        self.plan = b''
        self.times: dict[str, set[int]] = {}
        self.extent = self.records()
        channels: dict[int, str] = {}
        for record in self.extent:
            if isinstance(record, Header):
                self.profile = record.profile
            elif isinstance(record, Metadata) and record.name == RECORD:
                self.metadata = record.metadata
                self.node = record.metadata.get('node', '')
            elif isinstance(record, Channel):
                channels[record.id] = record.topic
            elif isinstance(record, Message):
                topic = channels[record.channel_id]
                if self.node:
                    self.times.setdefault(topic, set()).add(record.log_time)
                if topic == full_name(PLAN, self.node):
                    self.plan = record.data

    def records(self) -> IntactRecords:
        """Start to read the file from its beginning."""
        return IntactRecords(self._file, self._path)


def missing_preview(contents: Contents, preview: Preview) -> list[tuple[int, str, Any]]:
    """Messages that the preview of a run has and its file has not.

    Returns:
        Log time in ns, topic with its full name, and message, in the order of time; nothing
        for a run without a plan.

    Raises:
        KeyError: The file does not say which problem was solved.
        InvalidProblemError: What it says is no problem.
        Exception: Whatever `preview` raises.
    """
    if not contents.plan:
        return []
    plan = deserialize_message(contents.plan, ManipulationPlan)
    if not plan.joint_trajectory.points:
        return []
    reading = problem_from_mapping(json.loads(contents.metadata['problem']))
    if reading.problem is None or reading.findings:
        raise InvalidProblemError(reading.findings)
    stamp = plan.header.stamp
    return [
        (time_ns, name, message)
        for time_ns, topic, message in preview(
            reading.problem, plan, stamp.sec * _NS_PER_S + stamp.nanosec
        )
        if time_ns not in contents.times.get(name := full_name(topic, contents.node), ())
    ]


def rewrite(
    contents: Contents, added: Iterable[tuple[int, str, Any]], note: dict[str, str], out: BinaryIO
) -> None:
    """Write a complete file.

    Args:
        contents: What is copied.
        added: Log time, topic and message of what follows it.
        note: The metadata record that says what was recovered.
        out: Takes the file.
    """
    writer = MessageWriter(out, contents.profile)
    for record in contents.records():
        writer.copy(record)
    qos = qos_by_topic(contents.node)
    for time_ns, topic, message in added:
        writer.add(topic, message, time_ns, qos[topic])
    writer.add_metadata(RECOVERY_RECORD, note)
    writer.finish()
