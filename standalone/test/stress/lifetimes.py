"""Another process of the stress tests: begins and ends rclpy many times; prints what that cost.

The arguments are the name of a function of this module, 'busy' or 'idle', which is what its node
is meanwhile, and the number of times. A hang ends it with the stacks of all threads.
"""

from __future__ import annotations

import contextlib
import faulthandler
import json
import os
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import rclpy
from rclpy.executors import (
    Executor,
    ExternalShutdownException,
    MultiThreadedExecutor,
    SingleThreadedExecutor,
)
from rclpy.node import Node
from std_msgs.msg import Int64
from std_srvs.srv import Trigger

WAIT = 10.0
HANG = 50.0
WARM_UP = 10
THREADS_AT_REST = 2  # this one and faulthandler's


def make_node(idle: bool, on_event: Callable[..., Any]) -> Node:
    """A node that has something to do all the time, or only once."""
    node = rclpy.create_node('node')
    node.create_service(Trigger, 'trigger', lambda _, response: response)
    node.create_client(Trigger, 'trigger')
    if idle:
        node.create_guard_condition(on_event).trigger()
        return node
    publisher = node.create_publisher(Int64, 'numbers', 10)
    node.create_subscription(Int64, 'numbers', lambda _: on_event(), 10)

    def publish() -> None:
        # A shutdown destroys the publisher, also while another thread is about to use it.
        with contextlib.suppress(RuntimeError):
            publisher.publish(Int64(data=1))

    node.create_timer(0.001, publish)
    return node


def used() -> dict[str, float]:
    """Open descriptors, threads and memory [MB] of this process, once its threads have ended."""
    ending = [thread for thread in threading.enumerate() if thread is not threading.main_thread()]
    for thread in ending:
        thread.join(WAIT)
    # The system may count a thread for a moment that Python has done with.
    end = time.monotonic() + WAIT
    while len(os.listdir('/proc/self/task')) > THREADS_AT_REST and time.monotonic() < end:
        time.sleep(0.001)
    pages = int(Path('/proc/self/statm').read_text().split()[1])
    return {
        'descriptors': len(os.listdir('/proc/self/fd')),
        'threads': len(os.listdir('/proc/self/task')),
        'memory': pages * os.sysconf('SC_PAGE_SIZE') / 1e6,
    }


def use_once(idle: bool) -> None:
    happened = threading.Event()
    rclpy.init(args=[])
    node = make_node(idle, happened.set)
    while not happened.is_set():
        rclpy.spin_once(node, timeout_sec=WAIT)
    rclpy.shutdown()


def shut_down_a_context_that_a_thread_spins(idle: bool) -> None:
    rclpy.init(args=[])
    shut_down_while(idle, rclpy.spin, rclpy.shutdown)


def shut_down_a_context_that_a_pool_spins(idle: bool) -> None:
    rclpy.init(args=[])
    executor = MultiThreadedExecutor(4)
    shut_down_while(idle, executor_spin(executor), rclpy.shutdown)
    assert executor.shutdown(WAIT)


def shut_down_an_executor_that_a_thread_spins(idle: bool) -> None:
    rclpy.init(args=[])
    executor = SingleThreadedExecutor()
    shut_down_while(idle, executor_spin(executor), lambda: executor.shutdown(WAIT))
    rclpy.shutdown()


def shut_down_an_executor_that_a_pool_spins(idle: bool) -> None:
    rclpy.init(args=[])
    executor = MultiThreadedExecutor(4)
    shut_down_while(idle, executor_spin(executor), lambda: executor.shutdown(WAIT))
    rclpy.shutdown()


def executor_spin(executor: Executor) -> Callable[[Node], None]:
    def spin(node: Node) -> None:
        executor.add_node(node)
        executor.spin()

    return spin


def shut_down_while(
    idle: bool, spin: Callable[[Node], None], shut_down: Callable[[], Any]
) -> None:
    happened = threading.Event()
    node = make_node(idle, happened.set)

    def spin_to_the_end() -> None:
        with contextlib.suppress(ExternalShutdownException):
            spin(node)

    thread = threading.Thread(target=spin_to_the_end)
    thread.start()
    assert happened.wait(WAIT)
    shut_down()
    thread.join(WAIT)
    assert not thread.is_alive()


def main() -> None:
    faulthandler.dump_traceback_later(HANG, exit=True)
    live, idle, count = globals()[sys.argv[1]], sys.argv[2] == 'idle', int(sys.argv[3])
    for _ in range(WARM_UP):
        live(idle)
    before = used()
    for _ in range(count):
        live(idle)
    print(json.dumps([before, used()]))


if __name__ == '__main__':
    main()
