"""Random messages through a second implementation of CDR, that of rosbags."""

import array
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from ros_standalone.interfaces import (
    Message,
    definition_text,
    deserialize,
    interface_names,
    load,
    package_names,
    serialize,
    type_hash,
    type_name,
)
from ros_standalone.interfaces.definitions import FieldType
from ros_standalone.interfaces.field_checks import TYPE_CODES, integer_range

_NAMES = [
    'cfplan_msgs/msg/Grasp',
    'cfplan_msgs/msg/ManipulationPlan',
    'diagnostic_msgs/msg/DiagnosticArray',
    'geometry_msgs/msg/PoseWithCovarianceStamped',
    'rcl_interfaces/msg/ParameterEvent',
    'rmw_dds_common/msg/ParticipantEntitiesInfo',
    'sensor_msgs/msg/BatteryState',
    'sensor_msgs/msg/CameraInfo',
    'sensor_msgs/msg/MultiEchoLaserScan',
    'sensor_msgs/msg/PointCloud2',
    'std_msgs/msg/ByteMultiArray',
    'std_msgs/msg/Empty',
    'std_msgs/msg/Int16MultiArray',
    'trajectory_msgs/msg/JointTrajectory',
    'type_description_interfaces/msg/TypeDescription',
    'visualization_msgs/msg/InteractiveMarkerUpdate',
]
# rosbags describes a char as IDL's char. The .msg files of ROS 2 mean uint8 by it, as the golden
# hash of every service shows, whose event has a char[16].
_WITH_CHAR = {
    'rmw_dds_common/msg/Gid',
    'rmw_dds_common/msg/NodeEntitiesInfo',
    'rmw_dds_common/msg/ParticipantEntitiesInfo',
    'service_msgs/msg/ServiceEventInfo',
    'std_msgs/msg/Char',
}


@cache
def _store() -> Typestore:
    store = get_typestore(Stores.ROS2_JAZZY)
    types: dict[str, Any] = {}
    for name in interface_names('cfplan_msgs', 'msg'):
        full_name = f'cfplan_msgs/msg/{name}'
        types.update(get_types_from_msg(definition_text(full_name), full_name))
    store.register(types)
    return store


def _all_message_names() -> list[str]:
    return [
        f'{package}/msg/{name}'
        for package in package_names()
        for name in interface_names(package, 'msg')
    ]


def _element(kind: FieldType) -> st.SearchStrategy[Any]:
    if kind.is_message:
        return _messages(kind.base)
    if kind.base == 'string':
        return st.text(st.characters(codec='utf-8'), max_size=min(kind.string_bound or 9, 9))
    if kind.base == 'bool':
        return st.booleans()
    if kind.base == 'byte':
        return st.binary(min_size=1, max_size=1)
    if kind.base.startswith('float'):
        width = 32 if kind.base == 'float32' else 64
        return st.floats(width=width, allow_nan=False)
    return st.integers(*integer_range(kind.base))


def _value(kind: FieldType) -> st.SearchStrategy[Any]:
    if kind.is_single:
        return _element(kind)
    if not kind.is_array:
        return st.lists(_element(kind), max_size=min(kind.size or 3, 3))
    assert kind.size is not None
    values = st.lists(_element(kind), min_size=kind.size, max_size=kind.size)
    if kind.base in TYPE_CODES:
        return values.map(lambda numbers: np.array(numbers, dtype=kind.base))
    return values


@cache
def _messages(name: str) -> st.SearchStrategy[Any]:
    cls = load(name)
    return st.builds(cls, **{f.name: _value(f.type) for f in cls._definition.fields})


def _assert_same(ours: Any, theirs: Any) -> None:
    if isinstance(ours, Message):
        for name in ours.get_fields_and_field_types():
            _assert_same(getattr(ours, name), getattr(theirs, name))
    elif isinstance(ours, (array.array, np.ndarray)):
        np.testing.assert_array_equal(ours, theirs)
    elif isinstance(ours, list):
        assert len(ours) == len(theirs)
        for our, their in zip(ours, theirs, strict=True):
            _assert_same(our, their)
    elif isinstance(ours, bytes):
        assert ours[0] == int(theirs) % 256
    else:
        assert ours == theirs


_quick = settings(
    max_examples=12,
    database=None,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)


@pytest.mark.parametrize('name', _NAMES)
@_quick
@given(data=st.data())
def test_rosbags_reads_the_same_values(name: str, data: st.DataObject) -> None:
    message = data.draw(_messages(name))
    _assert_same(message, _store().deserialize_cdr(serialize(message), name))


@pytest.mark.parametrize('name', _NAMES)
@_quick
@given(data=st.data())
def test_rosbags_writes_the_same_bytes(name: str, data: st.DataObject) -> None:
    message = data.draw(_messages(name))
    theirs = _store().deserialize_cdr(serialize(message), name)
    assert bytes(_store().serialize_cdr(theirs, name)) == serialize(message)


@pytest.mark.parametrize('name', _NAMES)
@_quick
@given(data=st.data())
def test_what_is_written_is_read_back(name: str, data: st.DataObject) -> None:
    message = data.draw(_messages(name))
    assert deserialize(serialize(message), load(name)) == message


@pytest.mark.parametrize('name', _NAMES)
@_quick
@given(data=st.data())
def test_big_endian_data_is_read(name: str, data: st.DataObject) -> None:
    message = data.draw(_messages(name))
    theirs = _store().deserialize_cdr(serialize(message), name)
    big_endian = bytes(_store().serialize_cdr(theirs, name, little_endian=False))
    assert deserialize(big_endian, load(name)) == message


@pytest.mark.parametrize('name', sorted({*_all_message_names()} - _WITH_CHAR))
def test_type_hash_is_that_of_rosbags(name: str) -> None:
    assert type_hash(load(name)) == _store().hash_rihs01(name)


@pytest.mark.parametrize(
    'name', [n for n in _all_message_names() if not n.startswith('cfplan_msgs/')]
)
def test_constants_are_those_of_rosbags(name: str) -> None:
    constants, _ = get_typestore(Stores.ROS2_JAZZY).fielddefs[name]
    theirs = {name: value for name, _, value in constants}
    ours = {
        name: value[0] if isinstance(value, bytes) else value
        for name, value in ((c.name, c.value) for c in load(name)._definition.constants)
    }
    assert ours == theirs


@pytest.mark.parametrize('name', _all_message_names())
def test_every_message_has_its_default_written_and_read(name: str) -> None:
    message = load(name)()
    assert type_name(type(message)) == name
    assert deserialize(serialize(message), load(name)) == message
