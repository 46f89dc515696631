import array
import copy
import pickle
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

from builtin_interfaces.msg import Duration, Time
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import Point, Pose, PoseWithCovariance, Quaternion, Vector3
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, ParameterValue
from ros_standalone.interfaces import InterfaceNotFoundError, load, type_hash, type_name
from sensor_msgs.msg import NavSatStatus
from std_msgs.msg import Bool, Float32, Header, Int8, MultiArrayLayout, String, UInt8
from std_srvs.srv import Trigger, Trigger_Request
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from type_description_interfaces.srv import GetTypeDescription
from visualization_msgs.msg import Marker, MarkerArray


def test_fields_are_keyword_arguments() -> None:
    assert Point(x=1.0, z=3.0) == Point(x=1.0, y=0.0, z=3.0)


def test_unknown_arguments_are_named() -> None:
    with pytest.raises(AssertionError, match=r'Invalid arguments passed to constructor: q, w$'):
        Point(w=1.0, x=1.0, q=2.0)


def test_the_switch_for_checks_is_taken_as_an_argument() -> None:
    assert Point(x=1.0, check_fields=True).x == 1.0


def test_an_attribute_that_is_no_field_cannot_be_set() -> None:
    with pytest.raises(AttributeError):
        Point().w = 1.0


@pytest.mark.parametrize(
    ('message', 'field', 'value', 'text'),
    [
        (Point(), 'x', 1, "The 'x' field must be of type 'float'"),
        (Point(), 'x', np.float32(1), "The 'x' field must be of type 'float'"),
        (Time(), 'sec', 1.0, "The 'sec' field must be of type 'int'"),
        (
            Time(),
            'sec',
            2**31,
            "The 'sec' field must be an integer in [-2147483648, 2147483647]",
        ),
        (Int8(), 'data', -129, "The 'data' field must be an integer in [-128, 127]"),
        (UInt8(), 'data', -1, "The 'data' field must be an unsigned integer in [0, 255]"),
        (
            Float32(),
            'data',
            1e39,
            "The 'data' field must be a float in [-3.402823466e+38, 3.402823466e+38]",
        ),
        (Bool(), 'data', 1, "The 'data' field must be of type 'bool'"),
        (String(), 'data', b'x', "The 'data' field must be of type 'str'"),
        (
            Pose(),
            'position',
            Vector3(),
            "The 'position' field must be a sub message of type 'Point'",
        ),
        (
            DiagnosticStatus(),
            'level',
            0,
            "The 'level' field must be of type 'bytes' or 'ByteString' with length 1",
        ),
        (
            JointTrajectory(),
            'joint_names',
            'left',
            "The 'joint_names' field must be a set or sequence and each value of type 'str'",
        ),
        (
            JointTrajectory(),
            'points',
            [Point()],
            "The 'points' field must be a set or sequence and each value of type "
            "'JointTrajectoryPoint'",
        ),
        (
            ParameterValue(),
            'bool_array_value',
            [1],
            "The 'bool_array_value' field must be a set or sequence and each value of type 'bool'",
        ),
        (
            ParameterValue(),
            'integer_array_value',
            [2**63],
            "The 'integer_array_value' field must be a set or sequence and each value of type "
            "'int' and each integer in [-9223372036854775808, 9223372036854775807]",
        ),
        (
            ParameterValue(),
            'integer_array_value',
            array.array('d', [1.0]),
            "The 'integer_array_value' array.array() must have the type code of 'q'",
        ),
        (
            PoseWithCovariance(),
            'covariance',
            np.zeros(35),
            "The 'covariance' numpy.ndarray() must have a size of 36",
        ),
        (
            PoseWithCovariance(),
            'covariance',
            np.zeros(36, dtype=np.float32),
            "The 'covariance' numpy.ndarray() must have the dtype of 'numpy.float64'",
        ),
    ],
)
def test_a_wrong_value_is_refused_in_the_words_of_ros(
    message: Any, field: str, value: Any, text: str
) -> None:
    before = copy.deepcopy(message)
    with pytest.raises(AssertionError) as caught:
        setattr(message, field, value)
    assert str(caught.value) == text
    assert message == before


def test_integers_do_not_become_floats_by_assignment() -> None:
    with pytest.raises(
        AssertionError, match="'positions' field must be a set or sequence and each"
    ):
        JointTrajectoryPoint().positions = [1, 2]


def test_the_constructor_converts_numbers_of_a_sequence() -> None:
    point = JointTrajectoryPoint(positions=[1, 2], velocities=np.array([0.5, 0.25]))
    assert point.positions == array.array('d', [1.0, 2.0])
    assert point.velocities == array.array('d', [0.5, 0.25])


def test_the_constructor_names_the_field_of_what_is_no_number() -> None:
    with pytest.raises(AssertionError, match="'positions' field takes float64"):
        JointTrajectoryPoint(positions=['a'])


def test_infinite_and_undefined_floats_are_taken() -> None:
    values = [float('inf'), float('-inf'), float('nan')]
    point = JointTrajectoryPoint()
    point.positions = values
    assert repr(point.positions.tolist()) == repr(values)
    assert Float32(data=float('inf')).data == float('inf')


def test_the_greatest_single_precision_number_is_taken() -> None:
    greatest = float(np.finfo(np.float32).max)
    assert Float32(data=greatest).data == greatest


def test_numeric_sequences_are_arrays_and_arrays_numpy() -> None:
    assert isinstance(JointTrajectoryPoint().positions, array.array)
    assert isinstance(PoseWithCovariance().covariance, np.ndarray)


def test_an_array_given_is_kept_rather_than_copied() -> None:
    values = array.array('d', [1.0])
    point = JointTrajectoryPoint()
    point.positions = values
    assert point.positions is values


def test_a_bounded_sequence_takes_more_as_jazzy_does() -> None:
    descriptor = ParameterDescriptor(floating_point_range=[FloatingPointRange()] * 2)
    assert len(descriptor.floating_point_range) == 2


def test_a_bounded_sequence_is_checked_where_jazzy_is_told_to() -> None:
    code = (
        'from rcl_interfaces.msg import *\n'
        'try: ParameterDescriptor(integer_range=[IntegerRange()] * 2)\n'
        'except AssertionError as error: print(error)'
    )
    run = subprocess.run(
        [sys.executable, '-c', code],
        env={'PYTHONPATH': ':'.join(sys.path), 'ROS_PYTHON_CHECK_FIELDS': '1'},
        capture_output=True,
        text=True,
        timeout=30,
        check=True,
    )
    assert run.stdout.strip() == (
        "The 'integer_range' field must be a set or sequence with length <= 1 "
        "and each value of type 'IntegerRange'"
    )


def test_default_values_of_the_file_are_used() -> None:
    assert (Quaternion().x, Quaternion().w) == (0.0, 1.0)
    assert NavSatStatus().status == NavSatStatus.STATUS_UNKNOWN == -2
    assert GetTypeDescription.Request().include_type_sources is True


def test_default_values_are_not_shared() -> None:
    one, other = JointTrajectory(), JointTrajectory()
    one.joint_names.append('left')
    one.header.frame_id = 'palm'
    assert other == JointTrajectory()


def test_constants_are_on_class_and_message() -> None:
    assert Marker.DELETEALL == Marker().DELETEALL == 3
    assert (DiagnosticStatus.OK, DiagnosticStatus.STALE) == (b'\x00', b'\x03')


def test_repr_is_that_of_ros() -> None:
    assert repr(Trigger.Request()) == 'std_srvs.srv.Trigger_Request()'
    assert (
        repr(Trigger.Response(success=True, message='done'))
        == "std_srvs.srv.Trigger_Response(success=True, message='done')"
    )
    point = JointTrajectoryPoint(positions=[0.5], time_from_start=Duration(sec=1))
    assert repr(point) == (
        'trajectory_msgs.msg.JointTrajectoryPoint(positions=[0.5], velocities=[], '
        'accelerations=[], effort=[], '
        'time_from_start=builtin_interfaces.msg.Duration(sec=1, nanosec=0))'
    )
    assert repr(MultiArrayLayout()) == 'std_msgs.msg.MultiArrayLayout(dim=[], data_offset=0)'


def test_messages_are_equal_by_value_and_class() -> None:
    assert PoseWithCovariance() == PoseWithCovariance()
    changed = PoseWithCovariance()
    changed.covariance[7] = 1.0
    assert changed != PoseWithCovariance()
    assert Point() != Vector3()


def test_messages_are_not_hashable() -> None:
    with pytest.raises(TypeError):
        hash(Point())


@pytest.mark.parametrize(
    'message',
    [
        MarkerArray(markers=[Marker(id=7, ns='object', text='hello')]),
        PoseWithCovariance(),
        Trigger.Response(message='done'),
    ],
)
def test_messages_survive_pickle_and_copy(message: Any) -> None:
    assert pickle.loads(pickle.dumps(message)) == message
    deep = copy.deepcopy(message)
    assert deep == message
    assert deep is not message


def test_a_service_has_its_messages_and_no_instances() -> None:
    assert Trigger.Request is Trigger_Request
    assert set(Trigger.Event.get_fields_and_field_types()) == {'info', 'request', 'response'}
    with pytest.raises(NotImplementedError, match='Service classes can not be instantiated'):
        Trigger()


def test_a_class_is_known_by_its_name() -> None:
    assert load('std_msgs/msg/String') is String
    assert type_name(Trigger) == 'std_srvs/srv/Trigger'
    assert type_name(Trigger.Response) == 'std_srvs/srv/Trigger_Response'


def test_what_is_no_interface_has_no_name() -> None:
    with pytest.raises(TypeError, match=r'expected a message or service class, got <class .int.>'):
        type_name(int)
    with pytest.raises(TypeError, match='expected a message or service class, got std_msgs'):
        type_hash(String())


@pytest.mark.parametrize(
    ('name', 'text'),
    [
        ('std_msgs/msg/Strin', r"no interface 'std_msgs/msg/Strin'; std_msgs/msg has Bool, Byte"),
        ('no_msgs/msg/String', "no interface package 'no_msgs'; there are .*std_msgs"),
        ('std_msgs/String', "expected 'package/msg/Name' or .*, got 'std_msgs/String'"),
    ],
)
def test_an_unknown_interface_is_named_with_those_known(name: str, text: str) -> None:
    with pytest.raises(InterfaceNotFoundError, match=text):
        load(name)


def test_threads_get_the_same_class() -> None:
    names = ['sensor_msgs/msg/PointCloud2', 'sensor_msgs/msg/MultiDOFJointState'] * 20
    with ThreadPoolExecutor(8) as pool:
        classes = list(pool.map(load, names))
    assert len(set(classes)) == 2


def test_headers_take_time_messages() -> None:
    assert Header(stamp=Time(sec=1)).stamp.sec == 1
