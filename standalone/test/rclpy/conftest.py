from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

import rclpy
from rclpy.executors import Executor, ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node

TIMEOUT = 20.0


@pytest.fixture(autouse=True)
def domain(monkeypatch: pytest.MonkeyPatch) -> int:
    """A domain of this test run, with the discovery that users get by default."""
    domain_id = 1 + os.getpid() % 100
    monkeypatch.setenv('ROS_DOMAIN_ID', str(domain_id))
    for name in ('CYCLONEDDS_URI', 'ROS_AUTOMATIC_DISCOVERY_RANGE', 'ROS_STATIC_PEERS'):
        monkeypatch.delenv(name, raising=False)
    return domain_id


@pytest.fixture
def ros(domain: int) -> Iterator[None]:
    """The default context, initialised without arguments and signal handlers."""
    rclpy.init(args=[], signal_handler_options=rclpy.SignalHandlerOptions.NO)
    yield
    rclpy.try_shutdown()


@pytest.fixture
def node(ros: None) -> Node:
    return rclpy.create_node('tested')


@pytest.fixture
def executor(node: Node) -> Iterator[SingleThreadedExecutor]:
    """An executor that serves the node."""
    with SingleThreadedExecutor() as made:
        made.add_node(node)
        yield made


@pytest.fixture
def until(executor: SingleThreadedExecutor) -> Callable[[Callable[[], Any]], None]:
    """Spin until a predicate holds."""

    def spin(predicate: Callable[[], Any]) -> None:
        end = time.monotonic() + TIMEOUT
        while not predicate():
            assert time.monotonic() < end, 'waited in vain'
            executor.spin_once(timeout_sec=0.05)

    return spin


@pytest.fixture
def in_background() -> Iterator[Callable[[Executor], threading.Thread]]:
    """Spin an executor in a thread."""
    spinning: list[tuple[Executor, threading.Thread]] = []

    def start(executor: Executor) -> threading.Thread:
        def spin() -> None:
            with contextlib.suppress(ExternalShutdownException):
                executor.spin()

        thread = threading.Thread(target=spin)
        thread.start()
        spinning.append((executor, thread))
        return thread

    yield start
    for executor, thread in spinning:
        executor.shutdown(TIMEOUT)
        thread.join(TIMEOUT)
        assert not thread.is_alive()


@pytest.fixture
def program() -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Start a process that runs some Python code."""
    started: list[subprocess.Popen[str]] = []

    def start(code: str, *arguments: str) -> subprocess.Popen[str]:
        environment = {**os.environ, 'PYTHONPATH': os.pathsep.join(filter(None, sys.path))}
        started.append(
            subprocess.Popen(
                [sys.executable, '-c', code, *arguments],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
                env=environment,
            )
        )
        return started[-1]

    yield start
    for process in started:
        if process.poll() is None:
            process.kill()
        process.communicate()
