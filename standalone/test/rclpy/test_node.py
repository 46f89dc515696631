from __future__ import annotations

import pytest

import rclpy
from rcl_interfaces.msg import Log
from rclpy.exceptions import (
    InvalidHandle,
    InvalidNamespaceException,
    InvalidNodeNameException,
    InvalidTopicNameException,
    RCLInvalidROSArgsError,
)
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_rosout_default
from std_msgs.msg import Int32
from std_srvs.srv import Trigger


@pytest.mark.parametrize(
    ('namespace', 'full_name'), [(None, '/a'), ('/b', '/b/a'), ('b/c', '/b/c/a')]
)
def test_the_full_name_is_namespace_and_name(ros, namespace, full_name):
    node = rclpy.create_node('a', namespace=namespace)
    assert node.get_fully_qualified_name() == full_name


def test_the_logger_has_the_full_name_with_dots(ros):
    assert rclpy.create_node('a', namespace='/b/c').get_logger().name == 'b.c.a'


def test_arguments_of_the_process_rename_the_node(domain):
    with rclpy.init(args=['program', '--ros-args', '-r', '__node:=new', '-r', '__ns:=/space']):
        assert rclpy.create_node('old').get_fully_qualified_name() == '/space/new'


def test_a_node_may_ignore_the_arguments_of_the_process(domain):
    with rclpy.init(args=['program', '--ros-args', '-r', '__node:=new']):
        node = rclpy.create_node('old', use_global_arguments=False)
        assert node.get_name() == 'old'


def test_arguments_of_the_node_come_before_those_of_the_process(domain):
    with rclpy.init(args=['program', '--ros-args', '-r', 'x:=/a', '-p', 'speed:=1']):
        node = rclpy.create_node('n', cli_args=['--ros-args', '-r', 'x:=/b', '-p', 'speed:=2'])
        assert node.create_publisher(Int32, 'x', 1).topic_name == '/b'
        assert node.declare_parameter('speed', 0).value == 2


def test_the_constructors_overrides_come_before_all_arguments(domain):
    with rclpy.init(args=['program', '--ros-args', '-p', 'speed:=1']):
        node = rclpy.create_node('n', parameter_overrides=[Parameter('speed', value=3)])
        assert node.declare_parameter('speed', 0).value == 3


def test_overrides_are_declared_if_asked_for(domain):
    with rclpy.init(args=['program', '--ros-args', '-p', 'a.b:=text']):
        node = rclpy.create_node('n', automatically_declare_parameters_from_overrides=True)
        assert node.get_parameter('a.b').value == 'text'


def test_a_malformed_argument_of_a_node_is_refused(ros):
    with pytest.raises(RCLInvalidROSArgsError):
        rclpy.create_node('n', cli_args=['--ros-args', '-r', 'nonsense'])


def test_invalid_names_are_refused(ros):
    with pytest.raises(InvalidNodeNameException):
        rclpy.create_node('a b')
    with pytest.raises(InvalidNamespaceException):
        rclpy.create_node('a', namespace='/b b')
    with pytest.raises(InvalidTopicNameException):
        rclpy.create_node('a').create_publisher(Int32, '1 2', 1)


def test_a_node_that_could_not_be_made_is_not_in_the_graph(ros):
    with pytest.raises(Exception, match='use_sim_time'):
        rclpy.create_node(
            'failed', parameter_overrides=[Parameter('use_sim_time', value='perhaps')]
        )
    assert rclpy.create_node('asking').get_node_names() == ['asking']


def test_names_are_resolved_with_and_without_remapping(domain):
    with rclpy.init(args=['program', '--ros-args', '-r', '~/a:=/elsewhere']):
        node = rclpy.create_node('n')
        assert node.resolve_topic_name('~/a') == '/elsewhere'
        assert node.resolve_topic_name('~/a', only_expand=True) == '/n/a'
        assert node.resolve_service_name('b') == '/b'


def test_what_a_node_logs_is_published(node, until):
    got = []
    node.create_subscription(Log, '/rosout', got.append, qos_profile_rosout_default)
    node.get_logger().warning('look')
    until(lambda: got)
    assert (got[0].name, got[0].msg, got[0].level) == ('tested', 'look', 30)


def test_a_node_without_rosout_has_no_publisher_for_it(ros):
    node = rclpy.create_node('quiet', enable_rosout=False)
    assert '/rosout' not in [publisher.topic_name for publisher in node.publishers]


def test_a_node_without_parameter_services_offers_none(ros):
    node = rclpy.create_node('closed', start_parameter_services=False)
    assert [service.service_name for service in node.services] == ['/closed/get_type_description']


def test_a_destroyed_node_creates_nothing(node):
    node.destroy_node()
    with pytest.raises(InvalidHandle):
        node.create_publisher(Int32, 'x', 1)
    with pytest.raises(InvalidHandle):
        node.create_timer(1.0, None)


def test_destroying_a_node_destroys_what_it_has(node):
    publisher = node.create_publisher(Int32, 'x', 1)
    client = node.create_client(Trigger, 'y')
    node.destroy_node()
    with pytest.raises(InvalidHandle):
        publisher.publish(Int32())
    with pytest.raises(InvalidHandle):
        client.service_is_ready()


def test_a_node_is_destroyed_at_the_end_of_a_with_block(ros):
    with rclpy.create_node('brief') as node:
        pass
    with pytest.raises(InvalidHandle):
        node.create_guard_condition(None)


def test_only_what_belongs_to_a_node_is_destroyed_by_it(node):
    other = rclpy.create_node('other')
    assert not other.destroy_publisher(node.create_publisher(Int32, 'x', 1))


def test_assigning_an_executor_moves_the_node(node, executor):
    with SingleThreadedExecutor() as other:
        node.executor = other
        assert (executor.get_nodes(), other.get_nodes()) == ([], [node])


def test_what_is_not_covered_says_so(ros):
    with pytest.raises(NotImplementedError, match='not part of the standalone rclpy'):
        rclpy.create_node('n', enable_logger_service=True)
    with pytest.raises(AttributeError, match='not part of the standalone rclpy'):
        rclpy.no_such_name  # noqa: B018
    with pytest.raises(ImportError, match='not part of the standalone rclpy'):
        __import__('rclpy.action')
    with pytest.raises(ImportError, match=r'rclpy\.experimental.* is not part of the standalone'):
        __import__('rclpy.experimental.events_executor')
    with pytest.raises(ImportError, match='EventsExecutor'):
        from rclpy.executors import EventsExecutor  # noqa: F401
    with pytest.raises(AttributeError, match='EventsExecutor is not part of the standalone rclpy'):
        rclpy.executors.EventsExecutor  # noqa: B018
