"""Another process of the tests: does what it is told on standard input, a JSON list a line.

Each line is ["method", argument, ...] and is answered by one line with what the method returned.
"""

from __future__ import annotations

import json
import sys
import threading
import time
from typing import Any

from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_standalone.middleware import Participant, WaitSet

STRING = 'std_msgs/msg/String'
TRIGGER = 'std_srvs/srv/Trigger'
HEADER = bytes((0, 1, 0, 0))


class Peer:
    def __init__(self, name: str, namespace: str) -> None:
        self.participant = Participant()
        self.node = self.participant.add_node(name, namespace)
        self.waitset = WaitSet(self.participant)
        self.endpoints: dict[str, Any] = {}

    def writer(self, topic: str, latched: bool, depth: int) -> None:
        self.endpoints[topic] = self.participant.create_writer(
            self.node, topic, STRING, 'RIHS01_test', self.profile(latched, depth)
        )

    def reader(self, topic: str, latched: bool, depth: int) -> None:
        self.endpoints[topic] = self.participant.create_reader(
            self.node, topic, STRING, 'RIHS01_test', self.profile(latched, depth)
        )

    def profile(self, latched: bool, depth: int) -> QoSProfile:
        durability = DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
        return QoSProfile(depth=depth, durability=durability)

    def wait_matched(self, topic: str, count: int) -> bool:
        endpoint = self.endpoints[topic]
        return self.participant.graph.wait_until(lambda: endpoint.matched_count() == count, 10.0)

    def publish(self, topic: str, text: str) -> None:
        self.endpoints[topic].publish(HEADER + text.encode())

    def publish_bytes(self, topic: str, size: int) -> None:
        self.endpoints[topic].publish(HEADER + bytes(i % 251 for i in range(size - 4)))

    def server(self, service: str, tag: str) -> None:
        """Serve in a thread: the answer is the request and the tag."""
        server = self.participant.create_server(
            self.node, service, TRIGGER, 'RIHS01_test', self.profile(False, 10)
        )
        self.endpoints[service] = server
        waitset = WaitSet(self.participant)

        def serve() -> None:
            while server.is_open:
                for _ in waitset.wait([server], None):
                    while (taken := server.take()) is not None:
                        request_id, request = taken
                        server.send(request_id, request.rstrip(b'\0') + tag.encode())

        threading.Thread(target=serve, daemon=True).start()

    def client(self, service: str) -> None:
        self.endpoints[service] = self.participant.create_client(
            self.node, service, TRIGGER, 'RIHS01_test', self.profile(False, 10)
        )

    def wait_ready(self, service: str) -> bool:
        return self.participant.graph.wait_until(self.endpoints[service].is_ready, 10.0)

    def send(self, service: str, text: str) -> int:
        return self.endpoints[service].send(HEADER + text.encode())

    def call_many(self, service: str, prefix: str, count: int) -> list[str]:
        """Call one after another; returns the answers, with one that came unasked as well."""
        client = self.endpoints[service]
        answers = []
        for index in range(count):
            number = client.send(HEADER + f'{prefix}{index}'.encode())
            end = time.monotonic() + 10.0
            while (taken := client.take()) is None and time.monotonic() < end:
                self.waitset.wait([client], 1.0)
            assert taken is not None, f'call {index} has no answer'
            assert taken[0] == number, f'call {index} has the answer to {taken[0] - number}'
            answers.append(taken[1][4:].rstrip(b'\0').decode())
        extra = client.take()
        return answers if extra is None else [*answers, f'unasked {extra}']

    def wait_nodes(self, count: int) -> list[list[str]]:
        """The nodes, as soon as there are as many."""
        graph = self.participant.graph
        graph.wait_until(lambda: len(graph.node_names_and_namespaces()) == count, 10.0)
        return sorted(list(node) for node in reversed(graph.node_names_and_namespaces()))


def main() -> None:
    peer = Peer(*sys.argv[1:3])
    print(json.dumps('ready'), flush=True)
    for line in sys.stdin:
        method, *arguments = json.loads(line)
        print(json.dumps(getattr(peer, method)(*arguments)), flush=True)
    peer.participant.close()


if __name__ == '__main__':
    main()
