from __future__ import annotations

import pytest

import rclpy
from rclpy.duration import Duration
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.exceptions import InvalidHandle, RCLError, UnsupportedEventTypeError
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import Int32, String, UInt8MultiArray
from std_srvs.srv import Trigger


def test_a_callback_gets_every_message_in_order(node, until):
    got = []
    node.create_subscription(Int32, 'numbers', got.append, 10)
    publisher = node.create_publisher(Int32, 'numbers', 10)
    until(publisher.get_subscription_count)
    for number in range(5):
        publisher.publish(Int32(data=number))
    until(lambda: len(got) == 5)
    assert [message.data for message in got] == list(range(5))


def test_a_callback_of_two_arguments_gets_the_times_of_the_message(node, until):
    got = []
    node.create_subscription(Int32, 'numbers', lambda message, info: got.append(info), 10)
    publisher = node.create_publisher(Int32, 'numbers', 10)
    until(publisher.get_subscription_count)
    before = node.get_clock().now().nanoseconds
    publisher.publish(Int32())
    until(lambda: got)
    after = node.get_clock().now().nanoseconds
    assert before <= got[0]['source_timestamp'] <= got[0]['received_timestamp'] <= after


@pytest.mark.parametrize('callback', [lambda: None, lambda a, b, c: None])
def test_a_callback_of_no_or_three_arguments_is_refused(node, callback):
    with pytest.raises(RuntimeError, match='callable with one argument'):
        node.create_subscription(Int32, 'numbers', callback, 10)


def test_a_raw_subscription_gets_the_bytes_that_the_serializer_makes(node, until):
    got = []
    node.create_subscription(String, 'texts', got.append, 10, raw=True)
    publisher = node.create_publisher(String, 'texts', 10)
    until(publisher.get_subscription_count)
    message = String(data='the cat')
    publisher.publish(message)
    until(lambda: got)
    assert got[0][: len(serialize_message(message))] == serialize_message(message)
    assert deserialize_message(got[0], String) == message


def test_a_message_of_a_megabyte_arrives_from_another_process(node, until, program):
    got = []
    node.create_subscription(UInt8MultiArray, '/large', got.append, 1)
    program("""
import sys, rclpy
from std_msgs.msg import UInt8MultiArray
rclpy.init(args=[])
node = rclpy.create_node('large')
publisher = node.create_publisher(UInt8MultiArray, '/large', 1)
while not publisher.get_subscription_count():
    rclpy.spin_once(node, timeout_sec=0.02)
publisher.publish(UInt8MultiArray(data=bytes(range(256)) * 4096))
publisher.wait_for_all_acked()
sys.stdin.read()
""")
    until(lambda: got)
    assert bytes(got[0].data) == bytes(range(256)) * 4096


def test_bytes_are_published_as_they_are(node, until):
    got = []
    node.create_subscription(String, 'texts', got.append, 10)
    publisher = node.create_publisher(String, 'texts', 10)
    until(publisher.get_subscription_count)
    publisher.publish(serialize_message(String(data='raw')))
    until(lambda: got)
    assert got[0].data == 'raw'


def test_bytes_that_are_no_message_are_dropped_and_reported(node, until, capfd):
    got = []
    node.create_subscription(String, 'texts', got.append, 10)
    publisher = node.create_publisher(String, 'texts', 10)
    until(publisher.get_subscription_count)
    publisher.publish(bytes((0, 1, 0, 0, 255, 0, 0, 0)))
    publisher.publish(String(data='sound'))
    until(lambda: got)
    assert got[0].data == 'sound'
    assert '/texts: dropped 8 bytes' in capfd.readouterr().err


def test_a_message_of_another_type_is_refused(node):
    publisher = node.create_publisher(Int32, 'numbers', 10)
    with pytest.raises(TypeError, match=r'Expected .*Int32.*, got .*String'):
        publisher.publish(String())


def test_a_coroutine_function_is_a_callback(node, until):
    got = []

    async def callback(message):
        got.append(message)

    node.create_subscription(Int32, 'numbers', callback, 10)
    publisher = node.create_publisher(Int32, 'numbers', 10)
    until(publisher.get_subscription_count)
    publisher.publish(Int32(data=3))
    until(lambda: got)
    assert got[0].data == 3


def test_a_latched_message_reaches_a_late_subscription(node, until):
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    publisher = node.create_publisher(Int32, 'numbers', latched)
    publisher.publish(Int32(data=8))
    got = []
    node.create_subscription(Int32, 'numbers', got.append, latched)
    until(lambda: got)
    assert got[0].data == 8


def test_all_is_acknowledged_when_nobody_listens(node):
    publisher = node.create_publisher(Int32, 'numbers', 10)
    publisher.publish(Int32())
    assert publisher.wait_for_all_acked(Duration(seconds=1.0))


def test_a_subscription_counts_its_publishers(node, until):
    subscription = node.create_subscription(Int32, 'numbers', lambda _: None, 10)
    node.create_publisher(Int32, 'numbers', 10)
    node.create_publisher(Int32, 'numbers', 10)
    until(lambda: subscription.get_publisher_count() == 2)


def test_publishing_after_a_shutdown_is_an_error(node):
    publisher = node.create_publisher(Int32, 'numbers', 10)
    rclpy.get_default_context()._interrupt()
    with pytest.raises(RCLError, match="publisher's context is invalid"):
        publisher.publish(Int32())


def test_a_destroyed_publisher_is_not_used(node):
    publisher = node.create_publisher(Int32, 'numbers', 10)
    assert node.destroy_publisher(publisher)
    with pytest.raises(InvalidHandle):
        publisher.publish(Int32())


def test_a_destroyed_subscription_gets_nothing_more(node, until):
    got, kept = [], []
    subscription = node.create_subscription(Int32, 'numbers', got.append, 10)
    node.create_subscription(Int32, 'numbers', kept.append, 10)
    publisher = node.create_publisher(Int32, 'numbers', 10)
    until(lambda: publisher.get_subscription_count() == 2)
    node.destroy_subscription(subscription)
    publisher.publish(Int32())
    until(lambda: kept)
    assert got == []


def test_names_are_full_names_after_expansion(node):
    names = [node.create_publisher(Int32, topic, 1).topic_name for topic in ('a', '/b', '~/c')]
    assert names == ['/a', '/b', '/tested/c']


@pytest.mark.parametrize('wrong', [Trigger, int, None])
def test_what_is_no_message_class_is_refused(node, wrong):
    with pytest.raises(RuntimeError, match='The message type provided is not valid'):
        node.create_publisher(wrong, 'x', 10)


def test_a_negative_depth_is_refused(node):
    with pytest.raises(ValueError, match='history depth must be greater than or equal to zero'):
        node.create_publisher(Int32, 'numbers', -1)


def test_a_profile_must_be_a_profile_or_a_depth(node):
    with pytest.raises(TypeError, match="Expected QoSProfile or int, but received <class 'str'>"):
        node.create_publisher(Int32, 'numbers', 'reliable')


@pytest.mark.parametrize('events', [PublisherEventCallbacks, SubscriptionEventCallbacks])
def test_a_qos_event_callback_is_refused_by_name(events):
    with pytest.raises(UnsupportedEventTypeError, match=r'not part of .* asked for: deadline'):
        events(deadline=print)
