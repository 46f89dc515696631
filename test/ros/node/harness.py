"""A planner that spins in a thread of its own, and a client that spins in another.

Nothing here depends on how rclpy is implemented: real messages go between two contexts.
"""

from __future__ import annotations

import os
import queue
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import rclpy
from cfplan_msgs.srv import PlanManipulation
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.srv import GetParameters, SetParameters, SetParametersAtomically
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions

from cfplan_core import Problem, load_problem
from cfplan_ros.conversions.requests import request_from_problem
from cfplan_ros.planner_node import PlannerNode

REPOSITORY = Path(__file__).parents[3]
# Without a solution, which takes a tenth of a second to find out.
INFEASIBLE_FILE = REPOSITORY / 'config' / 'problems' / 'existence' / 'barrier_too_low.yaml'
STORY_FILE = REPOSITORY / 'config' / 'problems' / 'trinkle_hunter_1991.yaml'
# Parallel test runs on one machine do not hear each other.
DOMAIN = 1 + os.getpid() % 100
TIMEOUT = 20.0

VOLATILE = QoSProfile(depth=100)
LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)

Code = PlanManipulation.Response


def story() -> Problem:
    return load_problem(STORY_FILE)


def story_request(name: str = 'trinkle_hunter_1991', **options: Any) -> Any:
    request = request_from_problem(story())
    request.problem_name = name
    for option, value in options.items():
        setattr(request.options, option, value)
    return request


def eventually(condition: Callable[[], bool], otherwise: str) -> None:
    """Wait for what no event tells of, such as what a node knows of others."""
    deadline = time.monotonic() + TIMEOUT
    pause = threading.Event()
    while not condition():
        assert time.monotonic() < deadline, otherwise
        pause.wait(0.005)


class _Spinning:
    """A context with an executor that spins in a thread until it is closed."""

    def __init__(self, executor_class: type[Executor] = SingleThreadedExecutor) -> None:
        self.context = rclpy.Context()
        rclpy.init(
            args=[],
            context=self.context,
            domain_id=DOMAIN,
            signal_handler_options=SignalHandlerOptions.NO,
        )
        self.executor = executor_class(context=self.context)
        self.errors: list[Exception] = []
        self._thread = threading.Thread(target=self._spin, daemon=True)

    def _spin(self) -> None:
        try:
            self.executor.spin()
        except Exception as error:
            self.errors.append(error)

    def start(self, node: Node) -> None:
        self.node = node
        self.executor.add_node(node)
        self._thread.start()

    def end(self) -> None:
        self.executor.shutdown(timeout_sec=TIMEOUT)
        if self._thread.ident is not None:
            self._thread.join(TIMEOUT)
            self.node.destroy_node()
        rclpy.shutdown(context=self.context)
        assert not self.errors, self.errors


class Planner(_Spinning):
    """The node under test.

    Args:
        executor_class: What spins it.
        parameters: Overrides; ``preview.speed`` is written ``preview__speed``.
    """

    running: ClassVar[list[Planner]] = []

    def __init__(
        self, executor_class: type[Executor] = SingleThreadedExecutor, **parameters: Any
    ) -> None:
        super().__init__(executor_class)
        overrides = [
            Parameter(name.replace('__', '.'), value=value) for name, value in parameters.items()
        ]
        try:
            self.start(PlannerNode(context=self.context, parameter_overrides=overrides))
        except Exception:
            self.end()
            raise
        self.running.append(self)

    def stop(self) -> None:
        self.node.stop()

    def close(self) -> None:
        self.running.remove(self)
        self.node.stop()
        self.end()


class Client(_Spinning):
    """Calls the planner's services and hears its topics."""

    def __init__(self) -> None:
        super().__init__()
        self._clients: dict[str, Any] = {}
        self.start(Node('tester', context=self.context))

    def close(self) -> None:
        self.end()

    def send(self, service_class: Any, name: str, request: Any) -> _Pending:
        """Call a service of the planner once it is there; do not wait for the answer."""
        if name not in self._clients:
            self._clients[name] = self.node.create_client(service_class, f'/cfplan_planner/{name}')
        client = self._clients[name]
        assert client.wait_for_service(timeout_sec=TIMEOUT), f'no service {name}'
        return _Pending(client.call_async(request))

    def call(self, service_class: Any, name: str, request: Any) -> Any:
        return self.send(service_class, name, request).answer()

    def send_plan(self, request: Any) -> _Pending:
        return self.send(PlanManipulation, 'plan', request)

    def plan(self, request: Any) -> Any:
        return self.send_plan(request).answer()

    def set(self, **values: Any) -> list[Any]:
        """Set parameters one by one; return their results."""
        request = SetParameters.Request(parameters=_messages(values))
        return list(self.call(SetParameters, 'set_parameters', request).results)

    def set_atomically(self, **values: Any) -> Any:
        request = SetParametersAtomically.Request(parameters=_messages(values))
        return self.call(SetParametersAtomically, 'set_parameters_atomically', request).result

    def get(self, name: str) -> Any:
        request = GetParameters.Request(names=[name])
        (value,) = self.call(GetParameters, 'get_parameters', request).values
        return rclpy.parameter.parameter_value_to_python(value)

    def planner_state(self, wanted: Callable[[dict[str, str]], bool]) -> dict[str, str]:
        """Wait until diagnostics say of the planner what is wanted; return what they say."""
        return self.status('planner', lambda status: wanted(_values(status)))[1]

    def status(self, task: str, wanted: Callable[[Any], bool]) -> tuple[Any, dict[str, str]]:
        """Wait for a wanted status of one of the planner's tasks; return it and its values."""
        heard = self.listen(DiagnosticArray, '/diagnostics')
        name = f'cfplan_planner: {task}'
        while True:
            for status in heard.next().status:
                if status.name == name and wanted(status):
                    return status, _values(status)

    def publishers(self, topic: str) -> list[Any]:
        """Who publishes a topic, once it is known that somebody does."""
        name = topic if topic.startswith('/') else f'/cfplan_planner/{topic}'
        eventually(lambda: self.node.count_publishers(name) > 0, f'nobody publishes {name}')
        return list(self.node.get_publishers_info_by_topic(name))

    def listen(self, message_class: Any, topic: str, qos: QoSProfile = VOLATILE) -> _Heard:
        """Subscribe and return once both sides know: what is published then is heard."""
        heard = _Heard()
        name = topic if topic.startswith('/') else f'/cfplan_planner/{topic}'
        planners = list(Planner.running)
        before = [planner.node.count_subscribers(name) for planner in planners]
        heard.subscription = self.node.create_subscription(message_class, name, heard.put, qos)
        eventually(lambda: self.node.count_publishers(name) > 0, f'nobody publishes {name}')
        eventually(
            lambda: all(
                planner.node.count_subscribers(name) > count
                for planner, count in zip(planners, before, strict=True)
            ),
            f'the planner does not see who listens to {name}',
        )
        return heard


class _Pending:
    def __init__(self, future: Any) -> None:
        self._future = future
        self._done = threading.Event()
        future.add_done_callback(lambda _: self._done.set())

    @property
    def done(self) -> bool:
        return bool(self._future.done())

    def answer(self, timeout: float = TIMEOUT) -> Any:
        assert self._done.wait(timeout), 'no answer'
        return self._future.result()


class _Heard:
    """Messages of a topic in the order of their arrival."""

    def __init__(self) -> None:
        self._messages: queue.Queue[Any] = queue.Queue()
        self.subscription: Any = None

    def put(self, message: Any) -> None:
        self._messages.put(message)

    def next(self, timeout: float = TIMEOUT) -> Any:
        return self._messages.get(timeout=timeout)

    def until(self, condition: Any, timeout: float = TIMEOUT) -> Any:
        """Return the first message that fulfils a condition."""
        while True:
            message = self.next(timeout)
            if condition(message):
                return message

    @property
    def empty(self) -> bool:
        return self._messages.empty()


def _values(status: Any) -> dict[str, str]:
    return {pair.key: pair.value for pair in status.values}


def _messages(values: dict[str, Any]) -> list[ParameterMessage]:
    return [
        Parameter(name.replace('__', '.'), value=value).to_parameter_msg()
        for name, value in values.items()
    ]
