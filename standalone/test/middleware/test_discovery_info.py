from __future__ import annotations

import struct

import numpy
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_typestore

from ros_standalone.middleware.discovery_info import NodeEntities, pack_entities, parse_entities

STORE = get_typestore(Stores.ROS2_JAZZY)
GIDS = st.binary(min_size=16, max_size=16)
NAMES = st.text(st.characters(codec='ascii', exclude_characters='\0'), max_size=12)
NODES = st.builds(
    NodeEntities,
    NAMES,
    NAMES,
    st.lists(GIDS, max_size=3).map(tuple),
    st.lists(GIDS, max_size=3).map(tuple),
)


@settings(deadline=None)
@given(participant=GIDS, nodes=st.lists(NODES, max_size=3))
def test_message_comes_back(participant, nodes):
    assert parse_entities(pack_entities(participant, nodes)) == (participant, tuple(nodes))


def make(name, **fields):
    return STORE.types[f'rmw_dds_common/msg/{name}'](**fields)


def gid(data):
    return make('Gid', data=numpy.frombuffer(data, dtype=numpy.uint8))


@settings(deadline=None)
@given(participant=GIDS, nodes=st.lists(NODES, max_size=3))
def test_bytes_are_those_of_another_serializer(participant, nodes):
    message = make(
        'ParticipantEntitiesInfo',
        gid=gid(participant),
        node_entities_info_seq=[
            make(
                'NodeEntitiesInfo',
                node_namespace=node.namespace,
                node_name=node.name,
                reader_gid_seq=[gid(data) for data in node.readers],
                writer_gid_seq=[gid(data) for data in node.writers],
            )
            for node in nodes
        ],
    )
    expected = bytes(STORE.serialize_cdr(message, 'rmw_dds_common/msg/ParticipantEntitiesInfo'))
    packed = pack_entities(participant, nodes)
    assert packed == expected[: len(packed)]
    assert not any(expected[len(packed) :])


def test_big_endian_message_is_read():
    payload = bytes((0, 0, 0, 0)) + bytes(16) + struct.pack('>I', 1)
    payload += struct.pack('>I', 2) + b'/\0' + bytes(2)
    payload += struct.pack('>I', 2) + b'n\0' + bytes(2) + struct.pack('>II', 0, 0)
    assert parse_entities(payload) == (bytes(16), (NodeEntities('/', 'n'),))


@given(cut=st.integers(0, 60))
def test_cut_message_is_an_error(cut):
    payload = pack_entities(bytes(16), [NodeEntities('/hand', 'golden', (bytes(16),))])
    with pytest.raises(ValueError, match='a discovery message'):
        parse_entities(payload[:cut])
