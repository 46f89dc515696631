"""The golden node runs here unchanged, and what `ros2` printed of it on a real Jazzy holds.

Each function named after a `ros2` command asks the graph or calls the services as that command
does, through the standalone rclpy in another process, and prints in its format.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from queue import Empty, Queue
from typing import Any

import numpy as np
import pytest
import yaml

import rclpy
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters, SetParameters
from rclpy.node import Node
from rclpy.parameter import Parameter, get_parameter_value
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import MarkerArray

GOLDEN = Path(__file__).with_name('golden')
NODE = '/hand/golden'
TIMEOUT = 20.0
TYPE_NAMES = {Parameter.Type.DOUBLE: 'double', Parameter.Type.INTEGER: 'integer'}


def expected(command: str) -> str:
    """What the golden file says that a command prints."""
    text = GOLDEN.joinpath('cli_jazzy.txt').read_text()
    blocks = dict(block.split('\n', 1) for block in re.split(r'^\$ ', text, flags=re.M)[1:])
    return blocks[command].strip('\n')


class GoldenProcess:
    """The golden node in a process of its own."""

    def __init__(self) -> None:
        self.process = subprocess.Popen(
            [sys.executable, str(GOLDEN / 'node.py')],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, 'PYTHONPATH': os.pathsep.join(filter(None, sys.path))},
        )
        self._errors: Queue[str] = Queue()
        threading.Thread(target=self._listen, daemon=True).start()

    def next_error_line(self) -> str:
        try:
            return self._errors.get(timeout=TIMEOUT)
        except Empty:
            raise AssertionError(f'the node said nothing ({self.process.poll()=})') from None

    def end(self, number: int) -> tuple[int, str, str]:
        """Send a signal; return the status and what was printed after it."""
        self.process.send_signal(number)
        status = self.process.wait(TIMEOUT)
        assert self.process.stdout is not None
        return status, self.process.stdout.read(), self._rest()

    def kill(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait(TIMEOUT)

    def _listen(self) -> None:
        assert self.process.stderr is not None
        for line in self.process.stderr:
            self._errors.put(line)
        self._errors.put('')

    def _rest(self) -> str:
        return ''.join(iter(self.next_error_line, ''))


@pytest.fixture(scope='module', autouse=True)
def domain() -> Iterator[int]:
    with pytest.MonkeyPatch.context() as patch:
        domain_id = 1 + os.getpid() % 100
        patch.setenv('ROS_DOMAIN_ID', str(domain_id))
        for name in ('CYCLONEDDS_URI', 'ROS_AUTOMATIC_DISCOVERY_RANGE', 'ROS_STATIC_PEERS'):
            patch.delenv(name, raising=False)
        yield domain_id


@pytest.fixture
def golden() -> Iterator[GoldenProcess]:
    made = GoldenProcess()
    yield made
    made.kill()


@pytest.fixture
def node() -> Iterator[Node]:
    """A node that the ros2 command line would hide, as it hides its own."""
    with rclpy.init(args=[]):
        yield rclpy.create_node('_ros2cli', start_parameter_services=False)


@pytest.fixture
def asking(golden: GoldenProcess, node: Node) -> Node:
    """The hidden node once it knows the golden node with all its services."""
    assert node.wait_for_node(NODE, TIMEOUT)
    graph = node.context.participant.graph
    last = (f'{NODE}/trigger', ['std_srvs/srv/Trigger'])
    assert graph.wait_until(lambda: last in graph.services_by_node('golden', '/hand'), TIMEOUT)
    return node


def call(node: Node, type_: Any, name: str, request: Any) -> Any:
    client = node.create_client(type_, name)
    assert client.wait_for_service(TIMEOUT)
    future = client.call_async(request)
    rclpy.spin_until_future_complete(node, future, timeout_sec=TIMEOUT)
    assert future.done(), f'{name} did not answer'
    node.destroy_client(client)
    return future.result()


def receive(node: Node, type_: Any, topic: str, qos: QoSProfile) -> Any:
    got: list[Any] = []
    subscription = node.create_subscription(type_, topic, got.append, qos)
    end = time.monotonic() + TIMEOUT
    while not got:
        assert time.monotonic() < end, f'nothing came on {topic}'
        rclpy.spin_once(node, timeout_sec=0.1)
    node.destroy_subscription(subscription)
    return got[0]


def is_hidden(name: str) -> bool:
    return any(part.startswith('_') for part in name.split('/'))


def with_types(names_and_types: list[tuple[str, list[str]]]) -> list[str]:
    shown = [entry for entry in names_and_types if not is_hidden(entry[0])]
    return [f'{name} [{", ".join(types)}]' for name, types in shown]


def ros2_node_info(node: Node) -> str:
    kinds = {
        'Subscribers': node.get_subscriber_names_and_types_by_node,
        'Publishers': node.get_publisher_names_and_types_by_node,
        'Service Servers': node.get_service_names_and_types_by_node,
        'Service Clients': node.get_client_names_and_types_by_node,
        'Action Servers': lambda name, namespace: [],
        'Action Clients': lambda name, namespace: [],
    }
    lines = [NODE]
    for title, query in kinds.items():
        lines.append(f'  {title}:')
        lines += [f'    {name}: {", ".join(types)}' for name, types in query('golden', '/hand')]
    return '\n'.join(lines)


def ros2_topic_info(node: Node, topic: str) -> str:
    (publisher,) = node.get_publishers_info_by_topic(topic)
    assert node.get_subscriptions_info_by_topic(topic) == []
    head = f'Type: {publisher.topic_type}\nPublisher count: {node.count_publishers(topic)}'
    return f'{head}\n{publisher}\nSubscription count: {node.count_subscribers(topic)}'


def ros2_param_describe(node: Node, name: str) -> str:
    request = DescribeParameters.Request(names=[name])
    (descriptor,) = call(
        node, DescribeParameters, f'{NODE}/describe_parameters', request
    ).descriptors
    lines = [
        f'Parameter name: {descriptor.name}',
        f'  Type: {TYPE_NAMES[Parameter.Type(descriptor.type)]}',
    ]
    if descriptor.description:
        lines.append(f'  Description: {descriptor.description}')
    lines.append('  Constraints:')
    for bounds in (*descriptor.integer_range, *descriptor.floating_point_range):
        lines += [f'    Min value: {bounds.from_value}', f'    Max value: {bounds.to_value}']
        if bounds.step:
            lines.append(f'    Step: {bounds.step}')
    return '\n'.join(lines)


def ros2_param_set(node: Node, name: str, text: str) -> str:
    parameter = ParameterMessage(name=name, value=get_parameter_value(text))
    request = SetParameters.Request(parameters=[parameter])
    (result,) = call(node, SetParameters, f'{NODE}/set_parameters', request).results
    if result.successful:
        return 'Set parameter successful'
    return f'Setting parameter failed: {result.reason}'


def as_plain_data(value: Any) -> Any:
    """A message as what its YAML text reads as."""
    if hasattr(value, 'get_fields_and_field_types'):
        return {
            name: as_plain_data(getattr(value, name))
            for name in value.get_fields_and_field_types()
        }
    if isinstance(value, (str, bool, int, float)):
        return value
    return [as_plain_data(entry) for entry in np.asarray(value, dtype=object)]


def test_the_node_is_in_the_graph(asking):
    listed = [name for name in asking.get_fully_qualified_node_names() if not is_hidden(name)]
    assert '\n'.join(listed) == expected('ros2 node list')


def test_the_node_has_what_it_has_on_jazzy(asking):
    assert ros2_node_info(asking) == expected('ros2 node info /hand/golden')


def test_the_topics_and_their_types_are_those_of_jazzy(asking):
    listed = with_types(asking.get_topic_names_and_types())
    assert '\n'.join(listed) == expected('ros2 topic list -t')


def test_the_latched_topic_is_described_as_on_jazzy(asking):
    def without_identifier(text: str) -> str:
        return re.sub(r'(?<=GID: )([0-9a-f]{2}\.){15}[0-9a-f]{2}', '<gid>', text)

    shown = ros2_topic_info(asking, f'{NODE}/markers')
    wanted = expected('ros2 topic info -v /hand/golden/markers')
    assert '<gid>' in without_identifier(wanted)
    assert without_identifier(shown) == without_identifier(wanted)


def test_the_services_and_their_types_are_those_of_jazzy(asking):
    listed = with_types(asking.get_service_names_and_types())
    assert '\n'.join(listed) == expected('ros2 service list -t')


def test_a_service_call_prints_as_on_jazzy(asking):
    request = Trigger.Request()
    response = call(asking, Trigger, f'{NODE}/trigger', request)
    shown = f'requester: making request: {request!r}\nresponse:\n{response!r}'
    assert shown == expected('ros2 service call /hand/golden/trigger std_srvs/srv/Trigger')


def test_the_parameters_are_those_of_jazzy(asking):
    response = call(asking, ListParameters, f'{NODE}/list_parameters', ListParameters.Request())
    listed = '\n'.join(f'  {name}' for name in sorted(response.result.names))
    assert listed == expected('ros2 param list /hand/golden')


@pytest.mark.parametrize('name', ['budget', 'depth'])
def test_a_parameter_is_described_as_on_jazzy(asking, name):
    shown = ros2_param_describe(asking, name)
    assert shown == expected(f'ros2 param describe /hand/golden {name}')


def test_a_parameter_has_the_value_of_jazzy(asking):
    request = GetParameters.Request(names=['budget'])
    (value,) = call(asking, GetParameters, f'{NODE}/get_parameters', request).values
    shown = f'Double value is: {value.double_value}'
    assert shown == expected('ros2 param get /hand/golden budget')


def test_setting_parameters_is_accepted_and_refused_in_the_words_of_jazzy(asking):
    attempts = [
        ('budget', '3.5'),
        ('budget', '99.0'),
        ('directory', 'x'),
        ('depth', '4'),
        ('depth', '5'),
        ('nope', '1'),
    ]
    shown = [ros2_param_set(asking, name, text) for name, text in attempts]
    assert shown == [
        expected(f'ros2 param set /hand/golden {name} {text}') for name, text in attempts
    ]


def test_the_trajectory_reads_as_on_jazzy(asking):
    message = receive(asking, JointTrajectory, f'{NODE}/joint_trajectory', QoSProfile(depth=1))
    shown = as_plain_data(message)
    text = expected('ros2 topic echo --once /hand/golden/joint_trajectory')
    wanted = yaml.safe_load(text.removesuffix('---'))
    for data in (shown, wanted):
        assert data['header'].pop('stamp').keys() == {'sec', 'nanosec'}
    assert shown == wanted


def test_the_markers_reach_who_comes_late(asking):
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    (marker,) = receive(asking, MarkerArray, f'{NODE}/markers', latched).markers
    assert (marker.id, marker.ns, marker.text) == (7, 'object', 'hello')


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_node_without_a_word(golden, asking, number):
    # A message of its timer says that it spins.
    receive(asking, JointTrajectory, f'{NODE}/joint_trajectory', QoSProfile(depth=1))
    line = golden.next_error_line()
    assert re.fullmatch(r'\[INFO\] \[\d+\.\d{9}\] \[hand\.golden\]: ready\n', line)
    assert golden.end(number) == (0, '', '')


def test_the_node_is_off_the_graph_at_once_when_it_has_ended(golden, asking):
    receive(asking, JointTrajectory, f'{NODE}/joint_trajectory', QoSProfile(depth=1))
    golden.end(signal.SIGTERM)
    graph = asking.context.participant.graph
    assert graph.wait_until(
        lambda: NODE not in asking.get_fully_qualified_node_names(), timeout_s=1.0
    )
