from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from queue import Empty, Queue
from typing import Any

import pytest

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

TIMEOUT = 60.0
FIRST_PORT, PORTS_PER_DOMAIN = 7410, 250


@pytest.fixture(scope='session')
def free_domain() -> Iterator[int]:
    """A domain in which nobody is on this machine, kept for this test run.

    The first participant of a domain listens on a port of its own. Who has that port has the
    domain: the participants of the tests take the next ports.
    """
    for domain_id in (1 + (os.getpid() + step) % 100 for step in range(100)):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as holder:
            try:
                holder.bind(('', FIRST_PORT + PORTS_PER_DOMAIN * domain_id))
            except OSError:
                continue
            yield domain_id
            return
    pytest.fail('every domain from 1 to 100 is in use on this machine')


@pytest.fixture(autouse=True)
def domain(free_domain: int, monkeypatch: pytest.MonkeyPatch) -> int:
    """The domain of this test run, with the discovery that users get by default."""
    monkeypatch.setenv('ROS_DOMAIN_ID', str(free_domain))
    for name in ('CYCLONEDDS_URI', 'ROS_AUTOMATIC_DISCOVERY_RANGE', 'ROS_STATIC_PEERS'):
        monkeypatch.delenv(name, raising=False)
    return free_domain


class WorkerProcess:
    """A process that runs worker.py; calling a method of it runs the worker's of that name."""

    def __init__(self, name: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, str(Path(__file__).with_name('worker.py')), name],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, 'PYTHONPATH': os.pathsep.join(filter(None, sys.path))},
        )
        self._lines: Queue[str] = Queue()
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self._lines.put(line)

    def __getattr__(self, method: str) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            self.tell(method, *arguments)
            return self.answer()

        return call

    def tell(self, method: str, *arguments: Any) -> None:
        """Have a method run; `answer` waits for what it returns."""
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps([method, *arguments]) + '\n')
        self.process.stdin.flush()

    def answer(self) -> Any:
        try:
            return json.loads(self._lines.get(timeout=TIMEOUT))
        except Empty:
            raise AssertionError(f'the worker said nothing ({self.process.poll()=})') from None

    def leave(self) -> None:
        """End the process as it should end."""
        assert self.process.stdin is not None
        self.process.stdin.close()
        assert self.process.wait(TIMEOUT) == 0

    def kill(self) -> None:
        """End the process without a word."""
        self.process.kill()
        self.process.wait(TIMEOUT)

    def descriptors(self) -> int:
        """How many files and sockets the process has open."""
        return len(os.listdir(f'/proc/{self.process.pid}/fd'))

    def threads(self) -> int:
        return len(os.listdir(f'/proc/{self.process.pid}/task'))

    def memory(self) -> float:
        """Resident memory of the process [MB]."""
        pages = int(Path(f'/proc/{self.process.pid}/statm').read_text().split()[1])
        return pages * os.sysconf('SC_PAGE_SIZE') / 1e6


@pytest.fixture
def spawn(domain: int) -> Iterator[Callable[..., list[WorkerProcess]]]:
    """Start processes at once, each with a node; return when all are ready."""
    made: list[WorkerProcess] = []

    def start(*names: str) -> list[WorkerProcess]:
        workers = [WorkerProcess(name) for name in names]
        made.extend(workers)
        for worker in workers:
            assert worker.answer() == 'ready'
        return workers

    yield start
    for worker in made:
        worker.kill()


@pytest.fixture
def node(domain: int) -> Iterator[Node]:
    """A node of this process."""
    with rclpy.init(args=[], signal_handler_options=rclpy.SignalHandlerOptions.NO):
        yield rclpy.create_node('tester')


@pytest.fixture
def executor(node: Node) -> Iterator[SingleThreadedExecutor]:
    """An executor that serves the node."""
    with SingleThreadedExecutor() as made:
        made.add_node(node)
        yield made
