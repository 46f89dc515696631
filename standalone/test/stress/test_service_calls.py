from __future__ import annotations

import threading
from collections import Counter

import pytest

import rclpy
from rcl_interfaces.srv import GetParameters
from rclpy.executors import MultiThreadedExecutor
from rclpy.qos import HistoryPolicy, QoSProfile

TIMEOUT = 30.0
MEGABYTE = 1_000_000


@pytest.fixture
def replies(node):
    """Counts the replies that are on the wire, by the request that each of them names."""
    qos = QoSProfile(history=HistoryPolicy.KEEP_ALL, avoid_ros_namespace_conventions=True)
    participant = node.context.participant
    reader = participant.create_reader(
        participant.add_node('spy', '/'),
        'rr/echoReply',
        'rcl_interfaces/srv/GetParameters_Response',
        '',
        qos,
    )
    return reader


def count(reader):
    return Counter(payload[4:20] for payload, _ in reader.take_all())


def test_thousand_calls_in_a_row_are_each_answered_once(spawn, node, replies):
    server, caller = spawn('server', 'caller')
    server.serve('/echo')
    assert node.context.participant.graph.wait_until(replies.matched_count, TIMEOUT)
    assert caller.connect('/echo')
    assert caller.call('/echo', 'call', 1000) == 1000
    assert server.served() == [1000, 1000]
    assert sorted(count(replies).values()) == [1] * 1000


def test_eight_processes_at_once_get_each_their_own_answers_once(spawn, node, replies):
    server, *callers = spawn('server', *(f'caller_{index}' for index in range(8)))
    server.serve('/echo')
    assert node.context.participant.graph.wait_until(replies.matched_count, TIMEOUT)
    assert all(caller.connect('/echo') for caller in callers)
    for index, caller in enumerate(callers):
        caller.tell('call', '/echo', f'caller_{index}', 250)
    assert [caller.answer() for caller in callers] == [250] * 8
    assert server.served() == [2000, 2000]
    assert sorted(count(replies).values()) == [1] * 2000


def test_eight_threads_of_one_process_get_each_their_own_answers_once(spawn, node):
    (server,) = spawn('server')
    server.serve('/echo')
    nodes = [rclpy.create_node(f'caller_{index}') for index in range(8)]
    clients = [made.create_client(GetParameters, '/echo') for made in nodes]
    executor = MultiThreadedExecutor(4)
    for made in nodes:
        executor.add_node(made)
    spinning = threading.Thread(target=executor.spin)
    spinning.start()
    right = Counter()

    def call(index):
        for number in range(250):
            key = f'{index}-{number}'
            response = clients[index].call(GetParameters.Request(names=[key]), timeout_sec=TIMEOUT)
            right[index] += response.values[0].string_value == key

    try:
        assert all(client.wait_for_service(TIMEOUT) for client in clients)
        callers = [threading.Thread(target=call, args=(index,)) for index in range(8)]
        for caller in callers:
            caller.start()
        for caller in callers:
            caller.join(TIMEOUT)
    finally:
        executor.shutdown(TIMEOUT)
        spinning.join(TIMEOUT)
    assert not spinning.is_alive()
    assert right == dict.fromkeys(range(8), 250)
    assert server.served() == [2000, 2000]


def test_megabyte_of_request_comes_back_as_response(spawn):
    server, caller = spawn('server', 'caller')
    server.serve('/echo')
    assert caller.connect('/echo')
    assert caller.call_text('/echo', MEGABYTE)
