from __future__ import annotations

import os
import signal
import time

import pytest

import rclpy
from rclpy.signals import SignalHandlerOptions
from std_srvs.srv import Trigger

SPIN = """
import sys, time, rclpy
from rclpy.executors import ExternalShutdownException
rclpy.init(args=[])
node = rclpy.create_node('signalled')
print('ready', flush=True)
try:
    rclpy.spin(node)
    print('returned')
except BaseException as error:
    # A thread of rclpy's shuts the context down at the same time.
    deadline = time.monotonic() + 10.0
    while rclpy.ok() and time.monotonic() < deadline:
        time.sleep(0.01)
    print(type(error).__name__, rclpy.ok())
"""


def end(process, number):
    """Send the signal when the program is ready; return output, errors and seconds until then."""
    assert process.stdout.readline() == 'ready\n'
    # What is printed comes just before the wait that the signal shall interrupt.
    time.sleep(0.3)
    start = time.monotonic()
    process.send_signal(number)
    output, errors = process.communicate(timeout=20.0)
    return output.strip(), errors, time.monotonic() - start


@pytest.mark.parametrize(
    ('number', 'outcome'),
    [
        (signal.SIGINT, 'KeyboardInterrupt False'),
        (signal.SIGTERM, 'ExternalShutdownException False'),
    ],
)
def test_a_signal_ends_an_idle_spin(program, number, outcome):
    process = program(SPIN)
    output, errors, _ = end(process, number)
    assert (output, errors, process.returncode) == (outcome, '', 0)


def test_a_spin_that_begins_after_the_signal_returns(program):
    process = program(
        SPIN.replace(
            'try:',
            'import os, signal\n'
            'os.kill(os.getpid(), signal.SIGTERM)\n'
            'while rclpy.ok():\n'
            '    pass\n'
            'try:',
        )
    )
    output, errors = process.communicate(timeout=20.0)
    assert (output, errors, process.returncode) == ('ready\nreturned\n', '', 0)


def test_a_signal_that_nobody_catches_ends_the_process_as_python_does(program):
    process = program(
        'import rclpy\n'
        'rclpy.init(args=[])\n'
        "node = rclpy.create_node('signalled')\n"
        "print('ready', flush=True)\n"
        'rclpy.spin(node)\n'
    )
    _, errors, _ = end(process, signal.SIGINT)
    assert process.returncode == -signal.SIGINT
    assert errors.rstrip().endswith('KeyboardInterrupt')


@pytest.mark.parametrize('executor', ['SingleThreadedExecutor', 'MultiThreadedExecutor'])
def test_sigterm_ends_a_spin_in_another_thread(program, executor):
    process = program(
        'import threading, rclpy\n'
        'from rclpy import executors\n'
        'rclpy.init(args=[])\n'
        f'executor = executors.{executor}(**dict(num_threads=2) '
        f'if {executor!r}[0] == "M" else {{}})\n'
        "executor.add_node(rclpy.create_node('signalled'))\n"
        'def spin():\n'
        '    try:\n'
        '        executor.spin()\n'
        '    except executors.ExternalShutdownException:\n'
        '        pass\n'
        "    print('thread ended', flush=True)\n"
        'thread = threading.Thread(target=spin)\n'
        'thread.start()\n'
        "print('ready', flush=True)\n"
        'thread.join()\n'
        'executor.shutdown()\n'
    )
    output, errors, _ = end(process, signal.SIGTERM)
    assert (output, errors, process.returncode) == ('thread ended', '', 0)


def test_sigint_ends_a_program_that_was_started_with_sigint_ignored(program):
    process = program('import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\n' + SPIN)
    output, _, _ = end(process, signal.SIGINT)
    assert output == 'ExternalShutdownException False'


def test_a_handler_that_was_there_before_is_called_too(program):
    process = program(
        'import signal\n'
        "signal.signal(signal.SIGTERM, lambda *_: print('mine', flush=True))\n" + SPIN
    )
    output, _, _ = end(process, signal.SIGTERM)
    assert output == 'mine\nExternalShutdownException False'


def test_a_handler_that_is_put_in_place_later_replaces_rclpys(program):
    process = program(
        SPIN.replace(
            'print(',
            'import os, signal\n'
            'signal.signal(signal.SIGTERM, lambda *_: os._exit(7 if rclpy.ok() else 8))\nprint(',
            1,
        )
    )
    end(process, signal.SIGTERM)
    assert process.returncode == 7


def test_without_handlers_sigterm_kills(program):
    code = SPIN.replace('args=[]', 'args=[], signal_handler_options=rclpy.SignalHandlerOptions.NO')
    process = program(code)
    end(process, signal.SIGTERM)
    assert process.returncode == -signal.SIGTERM


def test_a_signal_ends_the_wait_for_a_service(program):
    process = program(
        'import rclpy\n'
        'from std_srvs.srv import Trigger\n'
        'rclpy.init(args=[])\n'
        "client = rclpy.create_node('signalled').create_client(Trigger, 'nobody')\n"
        "print('ready', flush=True)\n"
        'print(client.wait_for_service())\n'
    )
    output, _, _ = end(process, signal.SIGTERM)
    assert (output, process.returncode) == ('False', 0)


def test_a_service_can_be_answered_after_the_signal(program, node, executor):
    server = program(
        'import rclpy, threading\n'
        'from std_srvs.srv import Trigger\n'
        'from rclpy.executors import ExternalShutdownException\n'
        'rclpy.init(args=[])\n'
        "node = rclpy.create_node('signalled')\n"
        'def answer(request, response):\n'
        "    print('ready', flush=True)\n"
        '    while rclpy.ok():\n'
        '        threading.Event().wait(0.01)\n'
        "    response.message = 'interrupted'\n"
        '    return response\n'
        "node.create_service(Trigger, '/slow', answer)\n"
        'try:\n'
        '    rclpy.spin(node)\n'
        'except ExternalShutdownException:\n'
        '    pass\n'
    )
    client = node.create_client(Trigger, '/slow')
    assert client.wait_for_service(20.0)
    future = client.call_async(Trigger.Request())
    _, errors, _ = end(server, signal.SIGTERM)
    executor.spin_until_future_complete(future, 10.0)
    assert (future.result().message, errors, server.returncode) == ('interrupted', '', 0)


def test_a_spin_in_the_main_thread_ends_within_milliseconds(program):
    process = program(
        SPIN.replace('import sys, rclpy', 'import sys, time, rclpy').replace(
            'print(type(error).__name__, rclpy.ok())', 'print(time.monotonic())'
        )
    )
    assert process.stdout.readline() == 'ready\n'
    time.sleep(0.3)
    sent = time.monotonic()
    process.send_signal(signal.SIGTERM)
    output, _ = process.communicate(timeout=20.0)
    assert float(output) - sent < 0.05


def test_shutdown_puts_the_handlers_back(domain):
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    rclpy.init(args=[])
    during = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    options = rclpy.signals.get_current_signal_handlers_options()
    rclpy.shutdown()
    after = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    assert options == SignalHandlerOptions.ALL
    assert before == after
    assert not set(before) & set(during)


def test_shutdown_leaves_the_wakeup_descriptor_to_who_had_it(domain):
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    previous = signal.set_wakeup_fd(writing)
    try:
        rclpy.init(args=[])
        rclpy.shutdown()
        assert signal.set_wakeup_fd(previous) == writing
    finally:
        signal.set_wakeup_fd(previous)
        os.close(reading)
        os.close(writing)
