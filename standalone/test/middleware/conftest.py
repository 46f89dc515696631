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

from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_standalone.middleware import Participant

_SETTINGS = (
    'CYCLONEDDS_URI',
    'ROS_AUTOMATIC_DISCOVERY_RANGE',
    'ROS_STATIC_PEERS',
    'ROS_LOCALHOST_ONLY',
)


@pytest.fixture(autouse=True)
def domain(monkeypatch: pytest.MonkeyPatch) -> int:
    """A domain of this test run, with the discovery that users get by default."""
    domain_id = 1 + os.getpid() % 100
    monkeypatch.setenv('ROS_DOMAIN_ID', str(domain_id))
    for name in _SETTINGS:
        monkeypatch.delenv(name, raising=False)
    return domain_id


@pytest.fixture
def make_participant(domain: int) -> Iterator[Callable[[], Participant]]:
    made: list[Participant] = []

    def make() -> Participant:
        made.append(Participant())
        return made[-1]

    yield make
    for participant in made:
        participant.close()


@pytest.fixture
def participant(make_participant: Callable[[], Participant]) -> Participant:
    return make_participant()


@pytest.fixture
def volatile() -> QoSProfile:
    return QoSProfile(depth=10)


@pytest.fixture
def latched() -> QoSProfile:
    return QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class PeerProcess:
    """A process that runs peer.py; calling a method of it runs the peer's of that name."""

    def __init__(self, name: str, namespace: str) -> None:
        environment = {**os.environ, 'PYTHONPATH': os.pathsep.join(filter(None, sys.path))}
        self.process = subprocess.Popen(
            [sys.executable, str(Path(__file__).with_name('peer.py')), name, namespace],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=environment,
        )
        self._lines: Queue[str] = Queue()
        threading.Thread(target=self._listen, daemon=True).start()
        self.answer()

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
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps([method, *arguments]) + '\n')
        self.process.stdin.flush()

    def answer(self) -> Any:
        try:
            return json.loads(self._lines.get(timeout=30.0))
        except Empty:
            raise AssertionError(f'the peer said nothing ({self.process.poll()=})') from None

    def leave(self) -> None:
        """End the process as it should end."""
        assert self.process.stdin is not None
        self.process.stdin.close()
        assert self.process.wait(10.0) == 0

    def kill(self) -> None:
        """End the process without a word."""
        self.process.kill()
        self.process.wait(10.0)


@pytest.fixture
def spawn(domain: int) -> Iterator[Callable[..., PeerProcess]]:
    """Start another process with a node."""
    made: list[PeerProcess] = []

    def start(name: str = 'peer', namespace: str = '/') -> PeerProcess:
        made.append(PeerProcess(name, namespace))
        return made[-1]

    yield start
    for peer in made:
        peer.kill()
