from __future__ import annotations

import time

import pytest

TIMEOUT = 20.0
MEGABYTE = 1_000_000
LEASE_S = 3.0


@pytest.fixture
def short_lease(monkeypatch):
    """Let the dead be forgotten sooner than after Cyclone's 10 s."""
    monkeypatch.setenv(
        'CYCLONEDDS_URI',
        '<CycloneDDS><Domain>'
        '<General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces>'
        '<AllowMulticast>false</AllowMulticast></General>'
        '<Discovery><Peers><Peer Address="127.0.0.1"/></Peers>'
        '<ParticipantIndex>auto</ParticipantIndex>'
        '<MaxAutoParticipantIndex>100</MaxAutoParticipantIndex>'
        # Often enough for the living to be known as such on a busy machine.
        f'<LeaseDuration>{LEASE_S} s</LeaseDuration><SPDPInterval>0.3 s</SPDPInterval>'
        '</Discovery>'
        '</Domain></CycloneDDS>',
    )


@pytest.fixture
def exact_memory(monkeypatch):
    """Have the C library return at once what is freed of large blocks."""
    monkeypatch.setenv('MALLOC_MMAP_THRESHOLD_', '65536')


def serve_and_kill_clients(spawn, server, bystander, count, size):
    """Kill clients that wait for an answer; each time, a bystander's calls must be answered."""
    victims = spawn(*(f'victim_{index}' for index in range(count)))
    for victim in victims:
        assert victim.connect('/held')
        held = server.held_requests()
        victim.send_text('/held', size)
        assert server.wait_held(held + 1)
        victim.kill()
        server.release()
        for _ in range(3):
            assert bystander.call_text('/echo', size)


def start_server(spawn):
    server, bystander = spawn('server', 'bystander')
    server.serve('/echo')
    server.serve_when_released('/held')
    assert bystander.connect('/echo')
    return server, bystander


def test_clients_killed_in_mid_call_leave_the_server_serving(spawn):
    server, bystander = start_server(spawn)
    serve_and_kill_clients(spawn, server, bystander, 12, 100)
    assert server.served()[0] == 12 + 12 * 3


def test_clients_killed_in_mid_call_cost_the_server_nothing_that_lasts(
    spawn, short_lease, exact_memory
):
    server, bystander = start_server(spawn)
    serve_and_kill_clients(spawn, server, bystander, 2, MEGABYTE)
    assert server.wait_node_count(2)
    before = server.descriptors(), server.threads(), server.memory()
    serve_and_kill_clients(spawn, server, bystander, 8, MEGABYTE)
    assert server.wait_node_count(2)
    assert (server.descriptors(), server.threads()) == before[:2]
    # Eight lost replies and those that waited behind them would be 32 MB.
    end = time.monotonic() + TIMEOUT
    while server.memory() > before[2] + 8.0:
        assert time.monotonic() < end, f'{server.memory()} MB, before {before[2]} MB'
        assert bystander.call('/echo', 'x', 1) == 1


def test_client_that_waits_is_served_by_the_server_that_starts_again(spawn, short_lease):
    server, client = spawn('server', 'client')
    server.serve_when_released('/echo')
    assert client.connect('/echo')
    client.send('/echo', 'to the first')
    assert server.wait_held(1)
    server.kill()
    assert client.wait_unready('/echo')
    client.tell('wait_ready', '/echo')
    (second,) = spawn('server')
    second.serve('/echo')
    assert client.answer() is True
    assert client.call('/echo', 'to the second', 10) == 10
    assert client.answered() == [False]
    assert second.served() == [10, 10]


def test_pending_request_to_a_dead_server_is_forgotten_on_demand(spawn):
    first, client = spawn('first', 'client')
    first.serve_when_released('/echo')
    assert client.connect('/echo')
    client.send('/echo', 'to the first')
    assert first.wait_held(1)
    first.kill()
    (second,) = spawn('second')
    second.serve('/echo')
    assert client.wait_service_of('second', '/echo')
    assert client.pending('/echo') == 1
    assert client.call('/echo', 'to the second', 10) == 10
    assert client.pending('/echo') == 1
    client.forget('/echo')
    assert client.pending('/echo') == 0
    assert client.answered() == [False]
    assert client.call('/echo', 'after that', 10) == 10
