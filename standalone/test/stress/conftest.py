from __future__ import annotations

import json
import os
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


@pytest.fixture(autouse=True)
def domain(monkeypatch: pytest.MonkeyPatch) -> int:
    """A domain of this test run, with the discovery that users get by default."""
    domain_id = 1 + os.getpid() % 100
    monkeypatch.setenv('ROS_DOMAIN_ID', str(domain_id))
    for name in ('CYCLONEDDS_URI', 'ROS_AUTOMATIC_DISCOVERY_RANGE', 'ROS_STATIC_PEERS'):
        monkeypatch.delenv(name, raising=False)
    return domain_id


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
