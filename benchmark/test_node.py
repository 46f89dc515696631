"""What a call of the planning node costs beyond planning, on loopback and with recording.

The node runs in a process of its own, the client in this one. The cost is the wall time of the
call at the client without the planning time that the answer gives.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

rclpy = pytest.importorskip('rclpy', reason='rclpy is not installed')

from cfplan_msgs.srv import PlanManipulation  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from rclpy.signals import SignalHandlerOptions  # noqa: E402

from cfplan_core import load_problem  # noqa: E402
from cfplan_ros.conversions.requests import request_from_problem  # noqa: E402
from cfplan_ros.conversions.times import seconds_of  # noqa: E402

REPOSITORY = Path(__file__).parents[1]
STORY = REPOSITORY / 'config' / 'problems' / 'trinkle_hunter_1991.yaml'
CALLS = 30
# Of the issue: the median, s.
LARGEST_COST = 0.020
TIMEOUT = 30.0


@dataclass(frozen=True)
class RunningNode:
    """A node in a process of its own, and how to call its service."""

    process: int
    call: Callable[[Any], Any]

    def peak_memory(self) -> int:
        """Bytes; zero where the system does not tell."""
        status = Path(f'/proc/{self.process}/status')
        if not status.exists():
            return 0
        line = next(row for row in status.read_text().splitlines() if row.startswith('VmHWM'))
        return 1024 * int(line.split()[1])


@pytest.fixture
def running_node(tmp_path: Path) -> Iterator[RunningNode]:
    """Starts a node that records into tmp_path."""
    domain = 101 + os.getpid() % 100
    values = {'hand_file': STORY, 'record_directory': tmp_path / 'runs'}
    arguments = [word for name, value in values.items() for word in ('-p', f'{name}:={value}')]
    node = subprocess.Popen(
        [sys.executable, '-m', 'cfplan_ros.planner_node', '--ros-args', *arguments],
        env={**os.environ, 'ROS_DOMAIN_ID': str(domain)},
        cwd=REPOSITORY,
        stderr=subprocess.DEVNULL,
    )
    context = rclpy.Context()
    rclpy.init(
        args=[], context=context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO
    )
    executor = SingleThreadedExecutor(context=context)
    client_node = rclpy.create_node('benchmark', context=context)
    executor.add_node(client_node)
    client = client_node.create_client(PlanManipulation, '/cfplan_planner/plan')
    threading.Thread(target=executor.spin, daemon=True).start()

    def call(request: Any) -> Any:
        answered = threading.Event()
        future = client.call_async(request)
        future.add_done_callback(lambda _: answered.set())
        assert answered.wait(TIMEOUT), 'no answer'
        return future.result()

    try:
        assert client.wait_for_service(timeout_sec=TIMEOUT), 'the node does not start'
        yield RunningNode(node.pid, call)
    finally:
        node.terminate()
        executor.shutdown()
        client_node.destroy_node()
        rclpy.shutdown(context=context)
        node.wait(TIMEOUT)


def test_call_costs_little_beyond_planning(
    running_node: RunningNode, record: Callable[..., None]
) -> None:
    request = request_from_problem(load_problem(STORY))
    running_node.call(request)
    costs, planning = [], []
    for _ in range(CALLS):
        began = time.perf_counter()
        response = running_node.call(request)
        wall = time.perf_counter() - began
        assert response.error_code == PlanManipulation.Response.NONE, response.error_msg
        assert response.record, 'the run is not recorded'
        planning.append(seconds_of(response.planning_time))
        costs.append(wall - planning[-1])
    cost = statistics.median(costs)
    record(
        name=f'node, beyond {1e3 * statistics.median(planning):.0f} ms planning',
        seconds=cost,
        memory=running_node.peak_memory(),
    )
    assert cost < LARGEST_COST
