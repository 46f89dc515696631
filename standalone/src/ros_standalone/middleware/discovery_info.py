"""ROS's own discovery message: which nodes a participant holds and which endpoints are theirs.

The message is rmw_dds_common/msg/ParticipantEntitiesInfo of Jazzy, on DDS topic
``ros_discovery_info``. Its layout never changes within a release, so it is packed here.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass

TOPIC = 'ros_discovery_info'
TYPE_NAME = 'rmw_dds_common/msg/ParticipantEntitiesInfo'
TYPE_HASH = 'RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e'

_HEADER = bytes((0, 1, 0, 0))
_GID = 16


@dataclass(frozen=True)
class NodeEntities:
    """A node and the identifiers (16 bytes each) of its readers and writers."""

    namespace: str
    name: str
    readers: tuple[bytes, ...] = ()
    writers: tuple[bytes, ...] = ()


def pack_entities(participant: bytes, nodes: Sequence[NodeEntities]) -> bytes:
    """The message as CDR bytes with header.

    Args:
        participant: Identifier of the participant, 16 bytes.
        nodes: Its nodes.
    """
    out = bytearray(participant)
    _add_count(out, len(nodes))
    for node in nodes:
        for text in (node.namespace, node.name):
            data = text.encode() + b'\0'
            _add_count(out, len(data))
            out += data
        for gids in (node.readers, node.writers):
            _add_count(out, len(gids))
            out += b''.join(gids)
    return _HEADER + bytes(out)


def parse_entities(payload: bytes) -> tuple[bytes, tuple[NodeEntities, ...]]:
    """The participant and the nodes of a message.

    Raises:
        ValueError: The bytes are not such a message.
    """
    reader = _Reader(payload)
    participant = reader.take(_GID)
    nodes = []
    for _ in range(reader.count()):
        namespace, name = reader.text(), reader.text()
        gids = [tuple(reader.take(_GID) for _ in range(reader.count())) for _ in range(2)]
        nodes.append(NodeEntities(namespace, name, gids[0], gids[1]))
    return participant, tuple(nodes)


def _add_count(out: bytearray, count: int) -> None:
    out += bytes(-len(out) % 4)
    out += struct.pack('<I', count)


class _Reader:
    """Reads CDR of either byte order from the front."""

    def __init__(self, payload: bytes) -> None:
        if len(payload) < 4 or payload[0] != 0 or payload[1] not in (0, 1):
            raise ValueError('a discovery message must start with a CDR header')
        self._data = memoryview(payload)[4:]
        self._order = '<' if payload[1] else '>'
        self._at = 0

    def take(self, size: int) -> bytes:
        end = self._at + size
        if end > len(self._data):
            raise ValueError(f'a discovery message ends at byte {len(self._data)} of {end}')
        data = bytes(self._data[self._at : end])
        self._at = end
        return data

    def count(self) -> int:
        self._at += -self._at % 4
        value: int = struct.unpack(self._order + 'I', self.take(4))[0]
        return value

    def text(self) -> str:
        return self.take(self.count()).rstrip(b'\0').decode('utf-8', 'replace')
