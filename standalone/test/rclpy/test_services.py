from __future__ import annotations

import threading

import pytest

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.exceptions import InvalidHandle
from rclpy.executors import MultiThreadedExecutor
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger

CLIENT = """
import sys, rclpy
from std_srvs.srv import SetBool
rclpy.init(args=[])
node = rclpy.create_node('client_' + sys.argv[1])
client = node.create_client(SetBool, '/echo')
assert client.wait_for_service(20.0)
answers = 0
for number in range(int(sys.argv[2])):
    request = SetBool.Request(data=number % 3 == 0)
    future = client.call_async(request)
    rclpy.spin_until_future_complete(node, future, timeout_sec=10.0)
    response = future.result()
    assert response is not None, f'call {number} was not answered'
    assert response.success == request.data, f'call {number} got the answer of another'
    answers += 1
print(answers)
"""


def echo(request, response):
    response.success = request.data
    response.message = 'on' if request.data else 'off'
    return response


def test_a_call_is_answered(node, executor):
    node.create_service(SetBool, 'echo', echo)
    client = node.create_client(SetBool, 'echo')
    assert client.wait_for_service(10.0)
    future = client.call_async(SetBool.Request(data=True))
    executor.spin_until_future_complete(future, 10.0)
    assert future.result() == SetBool.Response(success=True, message='on')


def test_a_blocking_call_is_answered_while_another_thread_spins(node, executor, in_background):
    node.create_service(SetBool, 'echo', echo)
    client = node.create_client(SetBool, 'echo')
    in_background(executor)
    assert client.wait_for_service(10.0)
    assert client.call(SetBool.Request(data=False), timeout_sec=10.0).message == 'off'


def test_a_blocking_call_gives_up_when_time_is_over(node, executor):
    client = node.create_client(SetBool, 'nobody')
    with pytest.raises(TimeoutError):
        client.call(SetBool.Request(), timeout_sec=0.05)


def test_waiting_for_a_service_that_is_not_there_returns_false(node):
    assert not node.create_client(Trigger, 'nobody').wait_for_service(0.05)


def test_waiting_for_a_service_ends_when_it_comes(node):
    client = node.create_client(SetBool, 'late')
    threading.Timer(0.1, lambda: node.create_service(SetBool, 'late', echo)).start()
    assert client.wait_for_service(10.0)


def test_a_request_of_another_type_is_refused(node):
    client = node.create_client(SetBool, 'echo')
    with pytest.raises(TypeError, match=r'Expected .*SetBool_Request.*, got .*String'):
        client.call_async(String())


def test_a_response_of_another_type_comes_out_of_spin(node, executor):
    node.create_service(SetBool, 'wrong', lambda request, response: Trigger.Response())
    client = node.create_client(SetBool, 'wrong')
    assert client.wait_for_service(10.0)
    future = client.call_async(SetBool.Request())
    with pytest.raises(TypeError, match=r'Expected .*SetBool_Response.*, got .*Trigger_Response'):
        executor.spin_until_future_complete(future, 10.0)


def test_an_error_of_the_callback_comes_out_of_spin(node, executor):
    def fail(request, response):
        raise ZeroDivisionError('in the callback')

    node.create_service(Trigger, 'fail', fail)
    client = node.create_client(Trigger, 'fail')
    assert client.wait_for_service(10.0)
    with pytest.raises(ZeroDivisionError, match='in the callback'):
        executor.spin_until_future_complete(client.call_async(Trigger.Request()), 10.0)


def test_a_coroutine_may_answer_with_what_another_service_says(node, executor):
    inner_group = ReentrantCallbackGroup()
    node.create_service(SetBool, 'inner', echo, callback_group=inner_group)
    inner = node.create_client(SetBool, 'inner', callback_group=inner_group)

    async def relay(request, response):
        answer = await inner.call_async(SetBool.Request(data=True))
        response.message = f'inner is {answer.message}'
        return response

    node.create_service(Trigger, 'outer', relay)
    outer = node.create_client(Trigger, 'outer', callback_group=inner_group)
    assert inner.wait_for_service(10.0)
    assert outer.wait_for_service(10.0)
    future = outer.call_async(Trigger.Request())
    executor.spin_until_future_complete(future, 10.0)
    assert future.result().message == 'inner is on'


def test_a_call_that_was_given_up_stays_unanswered(node, executor, until):
    served = []

    def serve(request, response):
        served.append(request.data)
        return response

    node.create_service(SetBool, 'echo', serve)
    client = node.create_client(SetBool, 'echo')
    assert client.wait_for_service(10.0)
    given_up = client.call_async(SetBool.Request(data=True))
    client.remove_pending_request(given_up)
    executor.spin_until_future_complete(client.call_async(SetBool.Request()), 10.0)
    assert served == [True, False]
    assert not given_up.done()


def test_a_service_may_be_destroyed_by_its_own_callback(node, executor):
    def answer(request, response):
        node.destroy_service(service)
        return response

    service = node.create_service(Trigger, 'once', answer)
    client = node.create_client(Trigger, 'once')
    assert client.wait_for_service(10.0)
    executor.spin_until_future_complete(client.call_async(Trigger.Request()), 0.2)
    assert service not in list(node.services)


def test_what_is_no_service_class_is_refused(node):
    with pytest.raises(RuntimeError, match='The service type provided is not valid'):
        node.create_client(String, 'x')


def test_a_destroyed_client_is_not_used(node):
    client = node.create_client(Trigger, 'x')
    assert node.destroy_client(client)
    with pytest.raises(InvalidHandle):
        client.call_async(Trigger.Request())


def test_a_server_that_comes_back_answers_the_client_that_waited(node, executor, program):
    server = """
import sys, rclpy
from std_srvs.srv import Trigger
rclpy.init(args=[])
node = rclpy.create_node('server')
def answer(request, response):
    response.message = sys.argv[1]
    return response
node.create_service(Trigger, '/again', answer)
rclpy.spin(node)
"""
    client = node.create_client(Trigger, '/again')
    answers = []
    for name in ('first', 'second'):
        process = program(server, name)
        assert client.wait_for_service(20.0)
        future = client.call_async(Trigger.Request())
        executor.spin_until_future_complete(future, 20.0)
        answers.append(future.result().message)
        process.terminate()
        process.wait(10.0)
        graph = node.context.participant.graph
        assert graph.wait_until(lambda: not client.service_is_ready(), 20.0)
    assert answers == ['first', 'second']


def test_a_client_that_dies_in_mid_call_leaves_the_server_serving(node, until, program):
    dying = program("""
import rclpy
from std_srvs.srv import Trigger
rclpy.init(args=[])
node = rclpy.create_node('dying')
client = node.create_client(Trigger, '/slow')
assert client.wait_for_service(20.0)
client.call(Trigger.Request())
""")
    calls = []

    def answer(request, response):
        if not calls:
            dying.kill()
            dying.wait(10.0)
        calls.append(True)
        return response

    node.create_service(Trigger, '/slow', answer)
    until(lambda: calls)
    survivor = node.create_client(Trigger, '/slow')
    future = survivor.call_async(Trigger.Request())
    until(future.done)
    assert calls == [True, True]


def test_a_thousand_calls_in_a_row_from_another_process_are_answered(node, until, program):
    served = []

    def serve(request, response):
        served.append(True)
        return echo(request, response)

    node.create_service(SetBool, '/echo', serve)
    client = program(CLIENT, 'one', '1000')
    until(lambda: client.poll() is not None)
    output, errors = client.communicate()
    assert (output.strip(), len(served)) == ('1000', 1000), errors


def test_eight_clients_at_once_get_their_own_answers(node, executor, program):
    executor.shutdown()
    served = []

    def serve(request, response):
        served.append(True)
        return echo(request, response)

    node.create_service(SetBool, '/echo', serve, callback_group=ReentrantCallbackGroup())
    with MultiThreadedExecutor(4) as threaded:
        threaded.add_node(node)
        clients = [program(CLIENT, str(number), '100') for number in range(8)]
        while any(client.poll() is None for client in clients):
            threaded.spin_once(timeout_sec=0.1)
    results = [client.communicate() for client in clients]
    assert [output.strip() for output, _ in results] == ['100'] * 8, results
    assert len(served) == 800
