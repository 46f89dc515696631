from __future__ import annotations

import signal
import threading
import time

import pytest

from ros_standalone.middleware import ClosedError, WaitSet

TRIGGER = 'std_srvs/srv/Trigger'
HASH = 'RIHS01_test'
HEADER = bytes((0, 1, 0, 0))


def make_client(participant, service, qos):
    node = participant.add_node('caller', '/')
    return participant.create_client(node, service, TRIGGER, HASH, qos)


def make_server(participant, service, qos):
    node = participant.add_node('server', '/')
    return participant.create_server(node, service, TRIGGER, HASH, qos)


def take(participant, entity, timeout_s=10.0):
    waitset = WaitSet(participant)
    end = time.monotonic() + timeout_s
    try:
        while (taken := entity.take()) is None and time.monotonic() < end:
            waitset.wait([entity], end - time.monotonic())
        return taken
    finally:
        waitset.close()


def text(cdr):
    return cdr[4:].rstrip(b'\0').decode()


def ready(participant, client):
    return participant.graph.wait_until(client.is_ready, 10.0)


def test_reply_of_another_process_carries_the_number_of_its_request(participant, spawn, volatile):
    client = make_client(participant, '/echo', volatile)
    spawn().server('/echo', '!')
    assert ready(participant, client)
    numbers = [client.send(HEADER + word) for word in (b'one', b'two')]
    answers = dict(take(participant, client) for _ in numbers)
    assert {number: text(cdr) for number, cdr in answers.items()} == {
        numbers[0]: 'one!',
        numbers[1]: 'two!',
    }


def test_server_gets_the_request_without_the_client_identifier(make_participant, volatile):
    here, there = make_participant(), make_participant()
    server = make_server(there, '/echo', volatile)
    client = make_client(here, '/echo', volatile)
    assert ready(here, client)
    client.send(HEADER + b'\x07')
    _, request = take(there, server)
    assert request == HEADER + b'\x07\0\0\0'


def test_thousand_calls_in_a_row_are_all_answered_once(participant, spawn):
    spawn('server').server('/echo', '!')
    caller = spawn('caller')
    caller.client('/echo')
    assert caller.wait_ready('/echo')
    answers = caller.call_many('/echo', 'x', 1000)
    assert answers == [f'x{index}!' for index in range(1000)]


def test_burst_of_requests_is_answered_whole_while_another_client_listens(
    participant, spawn, volatile
):
    spawn('server').server('/echo', '!')
    client, listener = (make_client(participant, '/echo', volatile) for _ in range(2))
    assert ready(participant, client)
    numbers = [client.send(HEADER + str(index).encode()) for index in range(300)]
    answered = []
    while (taken := take(participant, client, 3.0)) is not None and len(answered) < 300:
        answered.append(taken[0])
    assert sorted(answered) == numbers
    assert listener.take() is None


def test_clients_at_once_get_their_own_answers_alone(spawn):
    spawn('server').server('/echo', '!')
    callers = [spawn(f'caller_{index}') for index in range(3)]
    for caller in callers:
        caller.client('/echo')
    assert all(caller.wait_ready('/echo') for caller in callers)
    for index, caller in enumerate(callers):
        caller.tell('call_many', '/echo', f'{index}-', 100)
    for index, caller in enumerate(callers):
        assert caller.answer() == [f'{index}-{count}!' for count in range(100)]


def test_two_clients_of_one_process_get_their_own_answers_alone(make_participant, volatile):
    here, there = make_participant(), make_participant()
    server = make_server(there, '/echo', volatile)
    clients = [make_client(here, '/echo', volatile) for _ in range(2)]
    assert all(ready(here, client) for client in clients)
    clients[1].send(HEADER + b'second')
    request_id, request = take(there, server)
    assert server.send(request_id, request)
    assert text(take(here, clients[1])[1]) == 'second'
    assert take(here, clients[0], 0.2) is None


def test_client_is_not_ready_without_a_server(participant, volatile):
    assert not make_client(participant, '/echo', volatile).is_ready()


def test_client_is_not_ready_with_halves_of_two_servers(make_participant, volatile):
    here, there = make_participant(), make_participant()
    client = make_client(here, '/echo', volatile)
    first, second = (make_server(there, '/echo', volatile) for _ in range(2))
    assert ready(here, client)
    first._reader.close()
    second._writer.close()
    assert here.graph.wait_until(lambda: not client.is_ready(), 10.0)


def test_client_is_no_longer_ready_when_its_server_closes(participant, spawn, volatile):
    client = make_client(participant, '/echo', volatile)
    server = spawn()
    server.server('/echo', '!')
    assert ready(participant, client)
    server.leave()
    assert participant.graph.wait_until(lambda: not client.is_ready(), 3.0)


def test_waiting_client_is_answered_by_a_server_that_starts_again(participant, spawn, volatile):
    client = make_client(participant, '/echo', volatile)
    first = spawn()
    first.server('/echo', ' of the first')
    assert ready(participant, client)
    first.leave()
    assert participant.graph.wait_until(lambda: not client.is_ready(), 3.0)
    spawn().server('/echo', ' of the second')
    assert ready(participant, client)
    client.send(HEADER + b'answer')
    assert text(take(participant, client)[1]) == 'answer of the second'


def test_client_that_dies_in_mid_call_does_not_stop_the_server(participant, spawn, volatile):
    server = make_server(participant, '/echo', volatile)
    doomed = spawn('doomed')
    doomed.client('/echo')
    assert doomed.wait_ready('/echo')
    doomed.send('/echo', 'last words')
    request_id, request = take(participant, server)
    doomed.kill()
    before = time.monotonic()
    assert server.send(request_id, request)
    assert time.monotonic() - before < 2.0

    survivor = spawn('survivor')
    survivor.client('/echo')
    assert survivor.wait_ready('/echo')
    survivor.tell('call_many', '/echo', 'next', 1)
    request_id, request = take(participant, server)
    assert server.send(request_id, request)
    assert survivor.answer() == ['next0']


def test_client_that_hangs_does_not_stop_the_server(make_participant, spawn, volatile):
    here, there = make_participant(), make_participant()
    server = make_server(there, '/echo', volatile)
    client = make_client(here, '/echo', volatile)
    assert ready(here, client)
    hanging = spawn('hanging')
    hanging.client('/echo')
    assert hanging.wait_ready('/echo')
    hanging.process.send_signal(signal.SIGSTOP)
    before = time.monotonic()
    for _ in range(20):
        number = client.send(HEADER + b'word')
        request_id, _ = take(there, server)
        assert server.send(request_id, HEADER + bytes(200_000))
        assert take(here, client)[0] == number
    assert time.monotonic() - before < 5.0


def test_client_that_left_is_no_error_for_the_server(participant, spawn, volatile):
    server = make_server(participant, '/echo', volatile)
    caller = spawn('caller')
    caller.client('/echo')
    assert caller.wait_ready('/echo')
    caller.send('/echo', 'bye')
    request_id, request = take(participant, server)
    caller.leave()
    assert participant.graph.wait_until(
        lambda: participant.graph.count_clients('/echo') == 0, 10.0
    )
    assert server.send(request_id, request)


def test_large_request_comes_back_whole(make_participant, volatile):
    here, there = make_participant(), make_participant()
    server = make_server(there, '/echo', volatile)
    client = make_client(here, '/echo', volatile)
    assert ready(here, client)
    request = HEADER + bytes(range(256)) * 4096
    sender = threading.Thread(target=client.send, args=(request,))
    sender.start()
    request_id, received = take(there, server)
    sender.join(10.0)
    assert server.send(request_id, received)
    assert take(here, client)[1] == request


def test_big_endian_payload_is_refused(participant, volatile):
    client = make_client(participant, '/echo', volatile)
    with pytest.raises(ValueError, match='little-endian'):
        client.send(bytes((0, 0, 0, 0, 1)))


def test_closed_client_says_so(participant, volatile):
    client = make_client(participant, '/echo', volatile)
    client.close()
    with pytest.raises(ClosedError, match='the client of /echo has been closed'):
        client.send(HEADER + b'late')
