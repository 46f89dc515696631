import time

import numpy as np
import pytest

from geometry_msgs.msg import Point, Polygon, Vector3
from ros_standalone.interfaces import SerializationError, deserialize, serialize
from std_msgs.msg import ByteMultiArray, Empty, Float64MultiArray, Header, String
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from visualization_msgs.msg import Marker


def test_a_message_without_fields_is_one_byte() -> None:
    assert serialize(Empty()) == b'\0\1\0\0\0'
    assert deserialize(b'\0\1\0\0\0', Empty) == Empty()


@pytest.mark.parametrize('data_type', [bytes, bytearray, memoryview])
def test_bytes_like_objects_are_read(data_type: type) -> None:
    assert deserialize(data_type(serialize(String(data='x'))), String) == String(data='x')


@pytest.mark.parametrize(
    ('header', 'text'),
    [
        (b'', 'got no bytes'),
        (b'\0\1\0', 'got 00 01 00'),
        (b'\0\7\0\0', 'got 00 07 00 00, XCDR2'),
        (b'\0\3\0\0', 'got 00 03 00 00, a parameter list'),
        (b'\xab\1\0\0', 'got ab 01 00 00'),
    ],
)
def test_another_encapsulation_is_named(header: bytes, text: str) -> None:
    with pytest.raises(SerializationError, match=rf'expected a header of plain CDR.*{text}$'):
        deserialize(header, Point)


def test_an_absurd_length_is_refused_at_once() -> None:
    start = time.monotonic()
    with pytest.raises(SerializationError, match='ends too early, after 8 bytes'):
        deserialize(b'\0\1\0\0\xff\xff\xff\xff', Polygon)
    assert time.monotonic() - start < 1.0


def test_text_that_is_not_utf8_is_read_with_replacements() -> None:
    assert deserialize(b'\0\1\0\0\2\0\0\0\xff\0', String).data == '\ufffd'


def test_an_empty_string_without_terminator_is_read() -> None:
    assert deserialize(b'\0\1\0\0\0\0\0\0', String).data == ''


def test_a_value_changed_past_the_checks_is_named() -> None:
    trajectory = JointTrajectory(points=[JointTrajectoryPoint()])
    trajectory.points[0].time_from_start._sec = 'soon'
    with pytest.raises(
        SerializationError,
        match=r'cannot serialize trajectory_msgs/msg/JointTrajectory: '
        r"points\[0\].time_from_start.sec: The 'sec' field must be of type 'int'",
    ):
        serialize(trajectory)


def test_a_wrong_message_appended_is_named() -> None:
    marker = Marker()
    marker.points.append(Vector3())
    with pytest.raises(
        SerializationError,
        match=r"'points' holds a Vector3; expected geometry_msgs.msg.Point",
    ):
        serialize(marker)


def test_a_wrong_string_appended_is_named() -> None:
    trajectory = JointTrajectory()
    trajectory.joint_names.append(3)
    with pytest.raises(SerializationError, match="joint_names: The 'joint_names' field must be"):
        serialize(trajectory)


def test_bytes_of_a_wrong_length_appended_are_named() -> None:
    message = ByteMultiArray(data=[b'a'])
    message.data.append(b'bc')
    with pytest.raises(SerializationError, match="'data' holds 3 values; expected 2"):
        serialize(message)


def test_what_is_no_message_is_refused() -> None:
    with pytest.raises(TypeError, match=r'expected a message class, got <class .int.>'):
        serialize(3)
    with pytest.raises(TypeError, match=r'expected a message class, got <class .std_srvs'):
        deserialize(b'\0\1\0\0', Trigger)


def test_reading_copies_what_it_keeps() -> None:
    data = bytearray(serialize(Float64MultiArray(data=[1.0])))
    message = deserialize(data, Float64MultiArray)
    data[-8:] = bytes(8)
    assert message.data.tolist() == [1.0]


def test_text_keeps_its_characters() -> None:
    text = 'Grüße 手 \N{SNOWMAN} a\0b'
    assert deserialize(serialize(Header(frame_id=text)), Header).frame_id == text


def test_a_megabyte_takes_milliseconds() -> None:
    message = Float64MultiArray(data=np.arange(131072.0))
    assert _best_time(lambda: serialize(message)) < 0.01
    data = serialize(message)
    assert _best_time(lambda: deserialize(data, Float64MultiArray)) < 0.01


def test_a_long_trajectory_takes_a_few_milliseconds() -> None:
    point = JointTrajectoryPoint(positions=[1.0, 2.0], velocities=[0.0, 0.0])
    message = JointTrajectory(joint_names=['left', 'right'], points=[point] * 200)
    assert _best_time(lambda: serialize(message)) < 0.005
    data = serialize(message)
    assert _best_time(lambda: deserialize(data, JointTrajectory)) < 0.005


def _best_time(call) -> float:  # type: ignore[no-untyped-def]
    """Shortest of several runs [s], which a busy machine disturbs least."""
    times = []
    for _ in range(20):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return min(times)
