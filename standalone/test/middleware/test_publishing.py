from __future__ import annotations

import itertools
import time

import pytest

from rclpy.qos import QoSProfile, ReliabilityPolicy
from ros_standalone.middleware import ClosedError, WaitSet

STRING = 'std_msgs/msg/String'
HASH = 'RIHS01_test'
HEADER = bytes((0, 1, 0, 0))


def make(participant, kind, topic, qos, type_name=STRING):
    node = participant.add_node('tester', '/')
    create = participant.create_writer if kind == 'writer' else participant.create_reader
    return create(node, topic, type_name, HASH, qos)


def matched(participant, endpoint, count=1):
    return participant.graph.wait_until(lambda: endpoint.matched_count() == count, 10.0)


def receive(participant, reader, timeout_s=10.0):
    waitset = WaitSet(participant)
    try:
        ready = waitset.wait([reader], timeout_s)
        return reader.take() if ready else None
    finally:
        waitset.close()


def text(message):
    return message[0][4:].rstrip(b'\0').decode()


def test_message_reaches_another_process(participant, spawn, volatile):
    reader = make(participant, 'reader', '/chatter', volatile)
    peer = spawn()
    peer.writer('/chatter', False, 10)
    assert peer.wait_matched('/chatter', 1)
    peer.publish('/chatter', 'hello')
    assert text(receive(participant, reader)) == 'hello'


def test_messages_arrive_in_order_and_once(participant, spawn, volatile):
    reader = make(participant, 'reader', '/chatter', QoSProfile(depth=200))
    peer = spawn()
    peer.writer('/chatter', False, 200)
    assert peer.wait_matched('/chatter', 1)
    for index in range(100):
        peer.publish('/chatter', str(index))
    received = [text(receive(participant, reader)) for _ in range(100)]
    assert received == [str(index) for index in range(100)]
    assert reader.take() is None


def test_latched_message_reaches_a_late_reader(participant, spawn, latched):
    peer = spawn()
    peer.writer('/state', True, 10)
    peer.publish('/state', 'early')
    reader = make(participant, 'reader', '/state', latched)
    assert text(receive(participant, reader)) == 'early'


def test_latched_writer_keeps_its_depth_of_messages(participant, spawn, latched):
    peer = spawn()
    peer.writer('/state', True, 2)
    for word in ('one', 'two', 'three'):
        peer.publish('/state', word)
    reader = make(participant, 'reader', '/state', latched)
    assert [text(receive(participant, reader)) for _ in range(2)] == ['two', 'three']


@pytest.mark.parametrize('latched_writer', [False, True])
def test_volatile_reader_does_not_get_what_came_before_it(
    participant, spawn, volatile, latched_writer
):
    peer = spawn()
    peer.writer('/state', latched_writer, 10)
    peer.publish('/state', 'early')
    reader = make(participant, 'reader', '/state', volatile)
    assert matched(participant, reader)
    assert peer.wait_matched('/state', 1)
    peer.publish('/state', 'late')
    assert text(receive(participant, reader)) == 'late'


def test_latched_reader_refuses_a_volatile_writer(participant, spawn, latched):
    reader = make(participant, 'reader', '/state', latched)
    peer = spawn()
    peer.writer('/state', False, 10)
    assert participant.graph.wait_until(lambda: reader.incompatible_qos()[0] == 1, 10.0)
    assert reader.matched_count() == 0


def test_reader_of_another_type_is_not_matched(participant, spawn, volatile):
    reader = make(participant, 'reader', '/chatter', volatile, 'std_msgs/msg/Bool')
    peer = spawn()
    peer.writer('/chatter', False, 10)
    assert participant.graph.wait_until(
        lambda: participant.graph.count_publishers('/chatter') == 1, 10.0
    )
    assert reader.matched_count() == 0


@pytest.mark.parametrize('size', [1 << 20, 10 << 20])
def test_large_message_arrives_whole(participant, spawn, volatile, size):
    reader = make(participant, 'reader', '/large', volatile)
    peer = spawn()
    peer.writer('/large', False, 10)
    assert peer.wait_matched('/large', 1)
    peer.publish_bytes('/large', size)
    payload, _ = receive(participant, reader, 30.0)
    pattern = bytes(range(251))
    assert payload[4:size] == b''.join(itertools.repeat(pattern, size // 251 + 1))[: size - 4]


@pytest.mark.parametrize('length', [5, 6, 7, 8, 9])
def test_payload_is_filled_up_with_zeros_to_whole_words(make_participant, volatile, length):
    here, there = make_participant(), make_participant()
    writer = make(here, 'writer', '/words', volatile)
    reader = make(there, 'reader', '/words', volatile)
    assert matched(here, writer)
    payload = HEADER + bytes(range(1, length - 3))
    writer.publish(payload)
    assert receive(there, reader)[0] == payload + bytes(-length % 4)


def test_reader_gets_what_its_own_participant_writes(participant, volatile):
    writer = make(participant, 'writer', '/own', volatile)
    reader = make(participant, 'reader', '/own', volatile)
    writer.publish(HEADER + b'self')
    assert text(receive(participant, reader)) == 'self'


def test_source_time_is_the_time_of_publishing(participant, volatile):
    writer = make(participant, 'writer', '/own', volatile)
    reader = make(participant, 'reader', '/own', volatile)
    before = time.time_ns()
    writer.publish(HEADER + b'self')
    _, info = receive(participant, reader)
    assert before <= info.source_timestamp <= info.received_timestamp <= time.time_ns()


def test_acknowledged_once_every_reader_has_the_message(participant, spawn, volatile):
    writer = make(participant, 'writer', '/chatter', volatile)
    peer = spawn()
    peer.reader('/chatter', False, 10)
    assert matched(participant, writer)
    writer.publish(HEADER + b'confirmed')
    assert writer.wait_for_acks(10.0)


def test_best_available_reader_takes_what_a_weaker_writer_offers(participant, spawn):
    weak = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    writer = make(participant, 'writer', '/weak', weak)
    wish = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_AVAILABLE)
    make(participant, 'reader', '/weak', wish)
    assert matched(participant, writer)


def test_payload_without_content_is_refused(participant, volatile):
    writer = make(participant, 'writer', '/chatter', volatile)
    with pytest.raises(ValueError, match='at least 5 bytes, got 4'):
        writer.publish(HEADER)


def test_closed_writer_says_so(participant, volatile):
    writer = make(participant, 'writer', '/chatter', volatile)
    writer.close()
    writer.close()
    with pytest.raises(ClosedError, match='writer on rt/chatter has been closed'):
        writer.publish(HEADER + b'late')


def test_two_types_on_one_topic_of_a_process_stay_apart(participant, volatile):
    strings = make(participant, 'writer', '/chatter', volatile)
    bools = make(participant, 'reader', '/chatter', volatile, 'std_msgs/msg/Bool')
    assert participant.graph.topic_names_and_types() == [
        ('/chatter', ['std_msgs/msg/Bool', 'std_msgs/msg/String'])
    ]
    assert (strings.matched_count(), bools.matched_count()) == (0, 0)


def test_topic_can_change_its_type_once_it_is_unused(participant, volatile):
    make(participant, 'writer', '/chatter', volatile).close()
    writer = make(participant, 'writer', '/chatter', volatile, 'std_msgs/msg/Bool')
    reader = make(participant, 'reader', '/chatter', volatile, 'std_msgs/msg/Bool')
    writer.publish(HEADER + b'1')
    assert text(receive(participant, reader)) == '1'
