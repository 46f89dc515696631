from __future__ import annotations

LARGE = 300_000
LEASE_S = 15.0


def test_clients_killed_in_mid_call_leave_the_server_serving(spawn):
    server, bystander = spawn('server', 'bystander')
    server.serve('/echo')
    server.serve_when_released('/held')
    assert bystander.connect('/echo')
    for number, victim in enumerate(spawn(*(f'victim_{index}' for index in range(12)))):
        assert victim.connect('/held')
        victim.send('/held', f'{number}')
        assert server.wait_held(number + 1)
        victim.kill()
        server.release()
        assert bystander.call('/echo', f'beside-{number}', 5) == 5
    assert server.served() == [12 + 12 * 5] * 2


def test_replies_to_killed_clients_cost_the_server_neither_descriptors_nor_memory(spawn):
    server, bystander = spawn('server', 'bystander')
    server.serve('/echo')
    server.serve_when_released('/held')
    assert bystander.connect('/echo')
    assert bystander.call_large('/echo', LARGE)
    before = []
    for number, victim in enumerate(spawn(*(f'victim_{index}' for index in range(12)))):
        assert victim.connect('/held')
        victim.send_large('/held', LARGE)
        assert server.wait_held(number + 1)
        victim.kill()
        server.release()
        assert bystander.call_large('/echo', LARGE)
        before.append((server.descriptors(), server.threads(), server.memory()))
    print(before)
    assert 0


def test_client_of_a_server_that_was_killed_is_served_by_the_next_one(spawn):
    first, client = spawn('first', 'client')
    first.serve_when_released('/echo')
    assert client.connect('/echo')
    client.send('/echo', 'to the first')
    assert first.wait_held(1)
    first.kill()
    (second,) = spawn('second')
    second.serve('/echo')
    assert 'second' in client.nodes(2)
    assert client.connect('/echo')
    assert client.call('/echo', 'to the second', 10) == 10
    assert client.answered() == [False]
    assert client.forget('/echo') == 0
    assert client.call('/echo', 'after that', 10) == 10
    assert second.served() == [20, 20]
