from __future__ import annotations

import time

import pytest

AT_ONCE_S = 2.0
LEASE_S = 15.0


def test_client_finds_a_server_that_starts_later(spawn):
    (client,) = spawn('client')
    client.tell('connect', '/echo')
    (server,) = spawn('server')
    server.serve('/echo')
    assert client.answer() is True
    assert client.call('/echo', 'x', 10) == 10


def test_server_is_found_by_a_client_that_starts_later(spawn):
    (server,) = spawn('server')
    server.serve('/echo')
    (client,) = spawn('client')
    assert client.connect('/echo')
    assert client.call('/echo', 'x', 10) == 10


@pytest.mark.parametrize('publisher_first', [True, False])
def test_volatile_topic_is_matched_in_either_order_of_start(spawn, publisher_first):
    names = ('publisher', 'subscriber') if publisher_first else ('subscriber', 'publisher')
    workers = {}
    for name in names:
        (workers[name],) = spawn(name)
        if name == 'publisher':
            workers[name].advertise('/numbers')
        else:
            workers[name].count('/numbers')
    assert workers['publisher'].wait_subscribed('/numbers')
    workers['publisher'].publish_numbers('/numbers', 10, 0.0)
    assert workers['subscriber'].counted('/numbers', 10) == list(range(10))


@pytest.mark.parametrize('publisher_first', [True, False])
def test_latched_message_arrives_in_either_order_of_start(spawn, publisher_first):
    names = ('publisher', 'subscriber') if publisher_first else ('subscriber', 'publisher')
    workers = {}
    for name in names:
        (workers[name],) = spawn(name)
        if name == 'publisher':
            workers[name].say('/words', 'early')
        else:
            workers[name].listen('/words')
    assert workers['subscriber'].heard('/words', 1) == ['early']


def test_destroyed_node_is_off_the_graph_at_once(spawn):
    watcher, leaving = spawn('watcher', 'leaving')
    assert watcher.wait_node_count(2)
    leaving.destroy_node()
    assert_gone(watcher, AT_ONCE_S)


def test_node_of_a_process_that_ends_is_off_the_graph_at_once(spawn):
    watcher, leaving = spawn('watcher', 'leaving')
    assert watcher.wait_node_count(2)
    leaving.leave()
    assert_gone(watcher, AT_ONCE_S)


def test_node_of_a_killed_process_is_off_the_graph_within_its_lease(spawn):
    watcher, leaving = spawn('watcher', 'leaving')
    assert watcher.wait_node_count(2)
    leaving.kill()
    assert_gone(watcher, LEASE_S)


def assert_gone(watcher, limit):
    start = time.monotonic()
    assert watcher.wait_node_count(1)
    assert time.monotonic() - start < limit


def test_thirty_nodes_of_one_process_are_seen_and_each_serves(spawn):
    watcher, host = spawn('watcher', 'host')
    host.add_nodes('many', 30)
    assert watcher.wait_node_count(32)
    for index in range(30):
        assert watcher.connect(f'/many_{index}/echo')
        assert watcher.call(f'/many_{index}/echo', f'{index}', 2) == 2


def test_ten_processes_at_once_all_find_one_another(spawn):
    names = [f'node_{index}' for index in range(10)]
    workers = spawn(*names)
    for worker, name in zip(workers, names, strict=True):
        worker.tell('say', '/words', name)
        worker.tell('listen', '/words')
    for worker in workers:
        worker.answer()
        worker.answer()
    for worker in workers:
        assert worker.heard('/words', 10) == names
        assert worker.wait_node_count(10)
        assert worker.nodes() == names
