from __future__ import annotations

import random
import threading

import pytest

from rclpy.qos import QoSProfile
from std_msgs.msg import Int64, UInt8MultiArray

TIMEOUT = 30.0


@pytest.fixture
def spinning(executor):
    """The node's callbacks run in a thread."""
    thread = threading.Thread(target=executor.spin)
    thread.start()
    yield
    executor.shutdown(TIMEOUT)
    thread.join(TIMEOUT)
    assert not thread.is_alive()


def test_message_of_a_megabyte_comes_back_byte_for_byte(spawn, node, spinning):
    (mirror,) = spawn('mirror')
    mirror.send_back('/there', '/back')
    arrived = threading.Event()
    received = []

    def note(message):
        received.append(bytes(message.data))
        arrived.set()

    node.create_subscription(UInt8MultiArray, '/back', note, 10)
    publisher = node.create_publisher(UInt8MultiArray, '/there', 10)
    graph = node.context.participant.graph
    assert graph.wait_until(lambda: publisher.get_subscription_count() == 1, TIMEOUT)
    assert mirror.wait_subscribed('/back')
    sent = [random.Random(seed).randbytes(1_000_000 + seed) for seed in range(5)]
    for data in sent:
        arrived.clear()
        publisher.publish(UInt8MultiArray(data=data))
        assert arrived.wait(TIMEOUT)
    assert received == sent


def test_reliable_subscription_loses_nothing_of_a_publisher_at_one_kilohertz(spawn):
    publisher, subscriber = spawn('publisher', 'subscriber')
    publisher.advertise('/numbers', 1000)
    subscriber.count('/numbers', 1000)
    assert publisher.wait_subscribed('/numbers')
    seconds = publisher.publish_numbers('/numbers', 3000, 0.001)
    assert subscriber.counted('/numbers', 3000) == list(range(3000))
    assert seconds >= 2.999


def test_slow_subscription_that_keeps_the_last_gets_the_newest(spawn, node, spinning):
    (publisher,) = spawn('publisher')
    publisher.advertise('/numbers', 1)
    first, go_on, newest = threading.Event(), threading.Event(), threading.Event()
    received = []

    def note_slowly(message):
        received.append(message.data)
        first.set()
        assert go_on.wait(TIMEOUT)
        if message.data == 99:
            newest.set()

    node.create_subscription(Int64, '/numbers', note_slowly, QoSProfile(depth=1))
    assert publisher.wait_subscribed('/numbers')
    publisher.publish_numbers('/numbers', 1, 0.0)
    assert first.wait(TIMEOUT)
    publisher.publish_numbers('/numbers', 100, 0.0)
    go_on.set()
    assert newest.wait(TIMEOUT)
    assert received == [0, 99]
