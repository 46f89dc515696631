"""Another process of the stress tests: a node that does what it is told on standard input.

Each line is ["method", argument, ...], in JSON, and is answered by one line with what the method
returned. The service is rcl_interfaces/srv/GetParameters, as its request and its response can
both carry text: the first name of a request is its key, and the response repeats it.
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
import threading
import time
from collections import Counter
from typing import Any

import rclpy
from rcl_interfaces.msg import ParameterValue
from rcl_interfaces.srv import GetParameters
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile
from std_msgs.msg import Int64, String, UInt8MultiArray

WAIT = 30.0
LATCHED = QoSProfile(
    history=HistoryPolicy.KEEP_ALL, durability=DurabilityPolicy.TRANSIENT_LOCAL
)


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
        self.texts: dict[str, list[str]] = {}
        self.futures: list[Any] = []
        threading.Thread(target=self._spin, daemon=True).start()

    def _spin(self) -> None:
        try:
            rclpy.spin(self.node)
        except ExternalShutdownException:
            pass

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
        client = self.node.create_client(GetParameters, service)
        self.clients[service] = client
        ready: bool = client.wait_for_service(WAIT)
        return ready

    def call(self, service: str, prefix: str, count: int) -> int:
        """Call one after another; returns how many were answered with their own key."""
        client = self.clients[service]
        answered = 0
        for index in range(count):
            key = f'{prefix}-{index}'
            response = client.call(GetParameters.Request(names=[key]), timeout_sec=WAIT)
            answered += [value.string_value for value in response.values] == [key]
        return answered

    def call_large(self, service: str, size: int) -> bool:
        """Call with a long key; returns whether it came back."""
        key = _text(size)
        request = GetParameters.Request(names=[key])
        response = self.clients[service].call(request, timeout_sec=WAIT)
        returned: bool = response.values[0].string_value == key
        return returned

    def send(self, service: str, key: str) -> None:
        """Send a request and do not wait."""
        request = GetParameters.Request(names=[key])
        self.futures.append(self.clients[service].call_async(request))

    def send_large(self, service: str, size: int) -> None:
        """Send a request with a long key and do not wait."""
        self.send(service, _text(size))

    def answered(self) -> list[bool]:
        """Which of the sent requests were answered."""
        return [future.done() for future in self.futures]

    def forget(self, service: str) -> int:
        """Give up the sent requests; returns how many are still awaited then."""
        for future in self.futures:
            self.clients[service].remove_pending_request(future)
        return len(self.clients[service]._pending)

    def is_ready(self, service: str) -> bool:
        ready: bool = self.clients[service].service_is_ready()
        return ready

    # Topics

    def send_back(self, there: str, back: str) -> None:
        """Publish on one topic the arrays that come on the other."""
        publisher = self.node.create_publisher(UInt8MultiArray, back, 10)
        self.node.create_subscription(UInt8MultiArray, there, publisher.publish, 10)

    def advertise(self, topic: str, depth: int) -> None:
        self.publishers[topic] = self.node.create_publisher(Int64, topic, depth)

    def wait_subscribed(self, topic: str, count: int) -> bool:
        publisher = self.publishers[topic]
        return self._graph_shows(lambda: publisher.get_subscription_count() >= count)

    def publish_numbers(self, topic: str, first: int, count: int, period: float) -> list[float]:
        """Publish whole numbers in time; returns the seconds it took, and whether all arrived."""
        publisher = self.publishers[topic]
        start = time.monotonic()
        for index in range(count):
            time.sleep(max(0.0, start + index * period - time.monotonic()))
            publisher.publish(Int64(data=first + index))
        taken = time.monotonic() - start
        return [taken, float(publisher.wait_for_all_acked(rclpy.duration.Duration(seconds=WAIT)))]

    def say(self, topic: str, text: str) -> None:
        """Publish a text that late subscribers get, too."""
        if topic not in self.publishers:
            self.publishers[topic] = self.node.create_publisher(String, topic, LATCHED)
        self.publishers[topic].publish(String(data=text))

    def listen(self, topic: str) -> None:
        """Note the texts of a topic."""
        texts = self.texts[topic] = []

        def note(message: String) -> None:
            with self.changed:
                texts.append(message.data)
                self.changed.notify_all()

        self.node.create_subscription(String, topic, note, LATCHED)

    def heard(self, topic: str, count: int) -> list[str]:
        """The texts that came, as soon as there are so many."""
        with self.changed:
            self.changed.wait_for(lambda: len(self.texts[topic]) >= count, WAIT)
            return sorted(self.texts[topic])

    # Nodes

    def nodes(self, count: int) -> list[str]:
        """The names of the nodes, as soon as there are so many."""
        self._graph_shows(lambda: len(self.node.get_node_names()) >= count)
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
