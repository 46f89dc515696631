"""What DDS itself tells of participants, writers and readers, on its builtin topics."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from dataclasses import dataclass

from ros_standalone.middleware import library
from ros_standalone.middleware.qos import DdsQos, read_qos, read_user_data
from ros_standalone.middleware.user_data import parse_user_data

_BATCH = 64
_BUILTIN_TYPES = b'org::eclipse::cyclonedds::builtin::'


@dataclass(frozen=True)
class Endpoint:
    """A writer or reader of any process, in DDS's names; identifiers have 16 bytes."""

    gid: bytes
    participant: bytes
    topic: str
    type_name: str
    qos: DdsQos
    user_data: dict[str, str]


class BuiltinReader:
    """Reads one builtin topic.

    Args:
        participant: DDS handle of the participant.
        topic: One of the BUILTIN_* topics of `library`.
    """

    def __init__(self, participant: int, topic: int) -> None:
        self.handle = library.check(
            library.create_reader(participant, topic, None, None), 'read a builtin topic'
        )
        self.condition = library.check(
            library.create_read_condition(self.handle, library.ANY_STATE),
            'create a condition for a builtin topic',
        )

    def take_endpoints(self) -> Iterator[tuple[bytes, Endpoint | None]]:
        """Changes since the last call: an identifier with what is there now, None if it went."""
        for pointer, alive in self._take():
            sample = library.BuiltinEndpoint.from_address(pointer)
            gid = bytes(sample.key.bytes)
            if not alive:
                yield gid, None
                continue
            # The readers of the builtin topics themselves are no part of the graph.
            if sample.type_name.startswith(_BUILTIN_TYPES):
                continue
            yield (
                gid,
                Endpoint(
                    gid,
                    bytes(sample.participant_key.bytes),
                    sample.topic_name.decode('utf-8', 'replace'),
                    sample.type_name.decode('utf-8', 'replace'),
                    read_qos(sample.qos),
                    parse_user_data(read_user_data(sample.qos)),
                ),
            )

    def take_participants(self) -> Iterator[tuple[bytes, dict[str, str] | None]]:
        """Changes since the last call: an identifier with its user data, None if it went."""
        for pointer, alive in self._take():
            sample = library.BuiltinParticipant.from_address(pointer)
            user_data = parse_user_data(read_user_data(sample.qos)) if alive else None
            yield bytes(sample.key.bytes), user_data

    def _take(self) -> Iterator[tuple[int, bool]]:
        while True:
            pointers = (ctypes.c_void_p * _BATCH)()
            infos = (library.SampleInfo * _BATCH)()
            count = library.take(self.handle, pointers, infos, _BATCH, _BATCH)
            # A reader that is being closed has nothing more to tell.
            if count <= 0:
                return
            try:
                for pointer, info in zip(pointers[:count], infos[:count], strict=True):
                    alive = bool(info.valid_data) and info.instance_state == library.ALIVE
                    yield int(pointer or 0), alive
            finally:
                library.return_loan(self.handle, pointers, count)
