from __future__ import annotations

import pytest

import rclpy
from rclpy.exceptions import NodeNameNonExistentError
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.topic_endpoint_info import TopicEndpointTypeEnum
from ros_standalone import interfaces
from std_msgs.msg import Int32
from std_srvs.srv import Trigger


def eventually(node, query, expected):
    """Wait until the graph has caught up with what this process did."""
    graph = node.context.participant.graph
    graph.wait_until(lambda: query() == expected, 10.0)
    assert query() == expected


def test_nodes_are_listed_with_their_namespaces(node):
    rclpy.create_node('b', namespace='/a')
    assert node.get_node_names_and_namespaces() == [('tested', '/'), ('b', '/a')]
    assert node.get_fully_qualified_node_names() == ['/tested', '/a/b']
    assert node.get_node_names_and_namespaces_with_enclaves()[0] == ('tested', '/', '/')


def test_a_topic_is_listed_with_its_type(node):
    node.create_publisher(Int32, 'numbers', 1)
    eventually(
        node,
        lambda: dict(node.get_topic_names_and_types()).get('/numbers'),
        ['std_msgs/msg/Int32'],
    )


def test_publishers_and_subscriptions_are_counted_by_expanded_name(node):
    node.create_publisher(Int32, '~/numbers', 1)
    node.create_subscription(Int32, '~/numbers', lambda _: None, 1)
    node.create_subscription(Int32, '~/numbers', lambda _: None, 1)
    eventually(
        node,
        lambda: (node.count_publishers('~/numbers'), node.count_subscribers('~/numbers')),
        (1, 2),
    )


def test_servers_and_clients_are_counted(node):
    node.create_service(Trigger, 'x', lambda _: None)
    node.create_client(Trigger, 'x')
    node.create_client(Trigger, 'x')
    eventually(node, lambda: (node.count_services('x'), node.count_clients('x')), (1, 2))


def test_what_a_node_has_is_listed_by_kind(node):
    other = rclpy.create_node('other', enable_rosout=False, start_parameter_services=False)
    other.create_subscription(Int32, 'in', lambda _: None, 1)
    other.create_publisher(Int32, 'out', 1)
    other.create_client(Trigger, 'asked')
    other.create_service(Trigger, 'offered', lambda _: None)
    eventually(
        node,
        lambda: node.get_subscriber_names_and_types_by_node('other', '/'),
        [('/in', ['std_msgs/msg/Int32'])],
    )
    eventually(
        node,
        lambda: node.get_client_names_and_types_by_node('other', '/'),
        [('/asked', ['std_srvs/srv/Trigger'])],
    )
    eventually(
        node,
        lambda: dict(node.get_service_names_and_types_by_node('other', '/')).get('/offered'),
        ['std_srvs/srv/Trigger'],
    )
    eventually(
        node,
        lambda: dict(node.get_publisher_names_and_types_by_node('other', '/')).get('/out'),
        ['std_msgs/msg/Int32'],
    )


def test_asking_about_a_node_that_is_not_there_is_an_error(node):
    with pytest.raises(NodeNameNonExistentError, match="'nobody'"):
        node.get_publisher_names_and_types_by_node('nobody', '/')


def test_an_endpoint_is_told_with_node_type_and_qos(node):
    latched = QoSProfile(depth=3, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_publisher(Int32, 'numbers', latched)
    eventually(node, lambda: len(node.get_publishers_info_by_topic('numbers')), 1)
    (info,) = node.get_publishers_info_by_topic('numbers')
    assert (info.node_name, info.node_namespace) == ('tested', '/')
    assert info.topic_type == 'std_msgs/msg/Int32'
    assert str(info.topic_type_hash) == interfaces.type_hash(Int32)
    assert info.endpoint_type is TopicEndpointTypeEnum.PUBLISHER
    assert len(info.endpoint_gid) == 16
    assert (info.qos_profile.depth, info.qos_profile.durability) == (
        3,
        DurabilityPolicy.TRANSIENT_LOCAL,
    )


def test_subscriptions_are_told_by_dds_name_if_asked_for(node):
    node.create_subscription(Int32, 'numbers', lambda _: None, 1)
    eventually(
        node, lambda: len(node.get_subscriptions_info_by_topic('rt/numbers', no_mangle=True)), 1
    )


def test_a_node_of_another_process_is_waited_for(node, program):
    program(
        'import rclpy, sys\n'
        'rclpy.init(args=[])\n'
        "rclpy.create_node('late', namespace='/a')\n"
        'sys.stdin.read()\n'
    )
    assert node.wait_for_node('/a/late', 20.0)


def test_waiting_for_a_node_that_never_comes_returns_false(node):
    assert not node.wait_for_node('nobody', 0.1)
