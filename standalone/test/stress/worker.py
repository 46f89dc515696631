"""Another process of the stress tests: a node that does what it is told on standard input.

Each line is ["method", argument, ...], in JSON, and is answered by one line with what the method
returned. The service is rcl_interfaces/srv/GetParameters, as its request and its response can
both carry text: the first name of a request is its key, and the response repeats it.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import sys
import threading
import time
from collections import Counter
from typing import Any

import rclpy
from rcl_interfaces.msg import ParameterValue
from rcl_interfaces.srv import GetParameters
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Int64, String, UInt8MultiArray

WAIT = 30.0
LATCHED = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Worker:
    def __init__(self, name: str) -> None:
        rclpy.init(args=[])
        self.node = rclpy.create_node(name)
        self.changed = threading.Condition()
        self.keys: Counter[str] = Counter()
        self.held = 0
        self.released = threading.Semaphore(0)
        self.clients: dict[str, Any] = {}
        self.publishers: dict[str, Any] = {}
        self.received: dict[str, list[Any]] = {}
        self.futures: list[Any] = []
        threading.Thread(target=self._spin, daemon=True).start()

    def _spin(self) -> None:
        with contextlib.suppress(ExternalShutdownException):
            rclpy.spin(self.node)

    # Services

    def serve(self, service: str) -> None:
        self.node.create_service(GetParameters, service, self._answer)

    def serve_when_released(self, service: str) -> None:
        self.node.create_service(GetParameters, service, self._answer_when_released)

    def _answer(
        self, request: GetParameters.Request, response: GetParameters.Response
    ) -> GetParameters.Response:
        (key,) = request.names
        self.keys[key] += 1
        response.values = [ParameterValue(string_value=key)]
        return response

    def _answer_when_released(
        self, request: GetParameters.Request, response: GetParameters.Response
    ) -> GetParameters.Response:
        with self.changed:
            self.held += 1
            self.changed.notify_all()
        self.released.acquire()
        return self._answer(request, response)

    def held_requests(self) -> int:
        return self.held

    def wait_held(self, count: int) -> bool:
        """Wait until so many requests have come to the service that holds them."""
        with self.changed:
            return self.changed.wait_for(lambda: self.held >= count, WAIT)

    def release(self) -> None:
        self.released.release()

    def served(self) -> list[int]:
        """How many requests were served, and how many different ones."""
        return [sum(self.keys.values()), len(self.keys)]

    # Clients

    def connect(self, service: str) -> bool:
        """Make a client; returns whether it finds a server."""
        self.clients[service] = self.node.create_client(GetParameters, service)
        return self.wait_ready(service)

    def wait_ready(self, service: str) -> bool:
        ready: bool = self.clients[service].wait_for_service(WAIT)
        return ready

    def wait_unready(self, service: str) -> bool:
        client = self.clients[service]
        return self._graph_shows(lambda: not client.service_is_ready())

    def wait_service_of(self, node: str, service: str) -> bool:
        """Wait until a node of the root namespace is known to offer a service."""
        offered = (service, ['rcl_interfaces/srv/GetParameters'])
        graph = self.node.context.participant.graph
        return self.node.wait_for_node(node, WAIT) and self._graph_shows(
            lambda: offered in graph.services_by_node(node, '/')
        )

    def call(self, service: str, prefix: str, count: int) -> int:
        """Call one after another; returns how many were answered with their own key."""
        client = self.clients[service]
        answered = 0
        for index in range(count):
            key = f'{prefix}-{index}'
            response = client.call(GetParameters.Request(names=[key]), timeout_sec=WAIT)
            answered += [value.string_value for value in response.values] == [key]
        return answered

    def call_text(self, service: str, size: int) -> bool:
        """Call with a key of so many bytes; returns whether it came back."""
        request = GetParameters.Request(names=[_text(size)])
        response = self.clients[service].call(request, timeout_sec=WAIT)
        returned: bool = response.values[0].string_value == request.names[0]
        return returned

    def send(self, service: str, key: str) -> None:
        """Send a request and do not wait."""
        request = GetParameters.Request(names=[key])
        self.futures.append(self.clients[service].call_async(request))

    def send_text(self, service: str, size: int) -> None:
        """Send a request with a key of so many bytes and do not wait."""
        self.send(service, _text(size))

    def answered(self) -> list[bool]:
        """Which of the sent requests were answered."""
        return [future.done() for future in self.futures]

    def pending(self, service: str) -> int:
        """How many requests the client waits for."""
        return len(self.clients[service]._pending)

    def forget(self, service: str) -> None:
        """Give up the sent requests."""
        for future in self.futures:
            self.clients[service].remove_pending_request(future)

    # Topics

    def send_back(self, there: str, back: str) -> None:
        """Publish on one topic the arrays that come on the other."""
        publisher = self.node.create_publisher(UInt8MultiArray, back, 10)
        self.publishers[back] = publisher
        self.node.create_subscription(UInt8MultiArray, there, publisher.publish, 10)

    def advertise(self, topic: str, depth: int = 10) -> None:
        self.publishers[topic] = self.node.create_publisher(Int64, topic, depth)

    def wait_subscribed(self, topic: str) -> bool:
        publisher = self.publishers[topic]
        return self._graph_shows(lambda: publisher.get_subscription_count() > 0)

    def publish_numbers(self, topic: str, count: int, period: float) -> float:
        """Publish 0, 1, ... with so many seconds between; returns how long it took [s]."""
        publisher = self.publishers[topic]
        start = time.monotonic()
        for number in range(count):
            time.sleep(max(0.0, start + number * period - time.monotonic()))
            publisher.publish(Int64(data=number))
        taken = time.monotonic() - start
        assert publisher.wait_for_all_acked(Duration(seconds=WAIT))
        return taken

    def count(self, topic: str, depth: int = 10) -> None:
        """Note the numbers of a topic."""
        self._note(Int64, topic, depth)

    def counted(self, topic: str, count: int) -> list[int]:
        """The numbers that came, as soon as there are so many."""
        return self._noted(topic, count)

    def say(self, topic: str, text: str) -> None:
        """Publish a text that late subscribers get, too."""
        publisher = self.node.create_publisher(String, topic, LATCHED)
        publisher.publish(String(data=text))

    def listen(self, topic: str) -> None:
        """Note the texts of a topic."""
        self._note(String, topic, LATCHED)

    def heard(self, topic: str, count: int) -> list[str]:
        """The texts that came, in alphabetical order, as soon as there are so many."""
        return sorted(self._noted(topic, count))

    def _note(self, message_type: Any, topic: str, qos: QoSProfile | int) -> None:
        received = self.received[topic] = []

        def note(message: Any) -> None:
            with self.changed:
                received.append(message.data)
                self.changed.notify_all()

        self.node.create_subscription(message_type, topic, note, qos)

    def _noted(self, topic: str, count: int) -> list[Any]:
        with self.changed:
            self.changed.wait_for(lambda: len(self.received[topic]) >= count, WAIT)
            return list(self.received[topic])

    # Nodes

    def wait_node_count(self, count: int) -> bool:
        return self._graph_shows(lambda: len(self.nodes()) == count)

    def nodes(self) -> list[str]:
        return sorted(self.node.get_node_names())

    def add_nodes(self, prefix: str, count: int) -> None:
        """Have more nodes, each with a service '~/echo'."""
        executor = MultiThreadedExecutor(4)
        for index in range(count):
            node = Node(f'{prefix}_{index}')
            node.create_service(GetParameters, '~/echo', self._answer)
            executor.add_node(node)
        threading.Thread(target=executor.spin, daemon=True).start()

    def destroy_node(self) -> None:
        self.node.destroy_node()

    def _graph_shows(self, predicate: Any) -> bool:
        shows: bool = self.node.context.participant.graph.wait_until(predicate, WAIT)
        return shows


def _text(size: int) -> str:
    """Text of so many characters in which no two stretches are alike."""
    digests = (hashlib.sha256(str(index).encode()).hexdigest() for index in range(size // 64 + 1))
    return ''.join(digests)[:size]


def main() -> None:
    worker = Worker(sys.argv[1])
    print(json.dumps('ready'), flush=True)
    for line in sys.stdin:
        method, *arguments = json.loads(line)
        print(json.dumps(getattr(worker, method)(*arguments)), flush=True)
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
