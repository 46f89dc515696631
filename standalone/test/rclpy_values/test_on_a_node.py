"""What the values do on a real node: simulated time, type descriptions, parameter services."""

import os
import time

import pytest

from rcl_interfaces.msg import Parameter as ParameterMsg
from rcl_interfaces.msg import ParameterEvent, ParameterValue
from rcl_interfaces.srv import GetParameters, ListParameters, SetParameters
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_parameter_events
from rclpy.time import Time
from ros_standalone.interfaces import type_hash
from rosgraph_msgs.msg import Clock as ClockMsg
from std_msgs.msg import String
from std_srvs.srv import Trigger
from type_description_interfaces.srv import GetTypeDescription

TIMEOUT = 10.0


class Runner:
    """A context with an executor, and nodes in it."""

    def __init__(self, context):
        self.context = context
        self.executor = SingleThreadedExecutor(context=context)

    def node(self, name, **options):
        node = Node(name, context=self.context, **options)
        self.executor.add_node(node)
        return node

    def spin_until(self, condition):
        deadline = time.monotonic() + TIMEOUT
        while not condition():
            assert time.monotonic() < deadline, 'it did not happen in time'
            self.executor.spin_once(timeout_sec=0.1)

    def call(self, node, type_, name, request):
        client = node.create_client(type_, name)
        assert client.wait_for_service(TIMEOUT)
        future = client.call_async(request)
        self.executor.spin_until_future_complete(future, TIMEOUT)
        return future.result()


@pytest.fixture
def runner():
    context = Context()
    context.init(args=['test'], domain_id=1 + os.getpid() % 100)
    runner = Runner(context)
    yield runner
    runner.executor.shutdown()
    context.try_shutdown()


def sim_time(value):
    return [Parameter('use_sim_time', value=value)]


def test_a_node_with_simulated_time_shows_what_clock_says(runner):
    node = runner.node('simulated', parameter_overrides=sim_time(True))
    publisher = runner.node('simulator').create_publisher(ClockMsg, '/clock', 10)
    runner.spin_until(lambda: publisher.get_subscription_count() == 1)
    message = ClockMsg(clock=Time(seconds=42).to_msg())

    def shown():
        publisher.publish(message)
        return node.get_clock().now().nanoseconds == 42 * 10**9

    runner.spin_until(shown)


def test_simulated_time_is_switched_by_the_parameter(runner):
    node = runner.node('switched')
    assert not node.get_clock().ros_time_is_active
    node.set_parameters(sim_time(True))
    assert node.get_clock().ros_time_is_active
    assert node.get_clock().now().nanoseconds == 0
    assert [s.topic_name for s in node.subscriptions] == ['/clock']
    node.set_parameters(sim_time(False))
    assert node.get_clock().now() > Time(seconds=1, clock_type=node.get_clock().clock_type)
    assert list(node.subscriptions) == []


def test_simulated_time_must_be_a_bool(runner):
    result = runner.node('switched').set_parameters([Parameter('use_sim_time', value=1)])[0]
    assert result.reason == "Wrong parameter type, expected 'Type.BOOL' got 'Type.INTEGER'"


@pytest.mark.parametrize(('type_', 'name'), [(String, 'msg'), (Trigger, 'srv')])
def test_a_used_type_is_described_with_its_source(runner, type_, name):
    node = runner.node('described')
    node.create_publisher(String, 'chatter', 1)
    node.create_service(Trigger, 'trigger', lambda request, response: response)
    request = GetTypeDescription.Request(type_hash=type_hash(type_))
    answer = runner.call(node, GetTypeDescription, 'described/get_type_description', request)
    assert answer.successful, answer.failure_reason
    assert answer.type_description.type_description.type_name.split('/')[1] == name
    assert answer.type_sources[0].encoding == name
    assert answer.type_sources[0].raw_file_contents


@pytest.mark.parametrize(
    ('hash_text', 'reason'),
    [
        (type_hash(String), 'Type not currently in use by this node'),
        ('RIHS01_12', 'Failed to parse type hash'),
    ],
)
def test_an_unused_type_is_not_described(runner, hash_text, reason):
    node = runner.node('described')
    request = GetTypeDescription.Request(type_hash=hash_text)
    answer = runner.call(node, GetTypeDescription, 'described/get_type_description', request)
    assert (answer.successful, answer.failure_reason) == (False, reason)


def test_the_description_service_can_be_left_out(runner):
    node = runner.node(
        'quiet', parameter_overrides=[Parameter('start_type_description_service', value=False)]
    )
    assert '/quiet/get_type_description' not in [s.service_name for s in node.services]


def test_one_unknown_name_empties_the_answer(runner):
    node = runner.node('asked')
    request = GetParameters.Request(names=['use_sim_time', 'nope'])
    assert runner.call(node, GetParameters, 'asked/get_parameters', request).values == []


def test_names_are_listed_by_service(runner):
    node = runner.node('asked')
    node.declare_parameter('limits.speed', 1.0)
    request = ListParameters.Request(prefixes=['limits'], depth=1)
    result = runner.call(node, ListParameters, 'asked/list_parameters', request).result
    assert (result.names, result.prefixes) == (['limits.speed'], ['limits'])


def test_a_value_of_no_ros_type_is_refused_and_the_node_lives(runner):
    node = runner.node('asked')
    wrong = ParameterMsg(name='use_sim_time', value=ParameterValue(type=99))
    request = SetParameters.Request(parameters=[wrong])
    results = runner.call(node, SetParameters, 'asked/set_parameters', request).results
    assert [(r.successful, r.reason) for r in results] == [
        (False, '99 is not a valid Parameter.Type')
    ]


def test_changes_are_published(runner):
    listener, events = runner.node('listener'), []
    listener.create_subscription(
        ParameterEvent, '/parameter_events', events.append, qos_profile_parameter_events
    )
    node = runner.node('changed', namespace='/hand')
    runner.spin_until(lambda: node.count_subscribers('/parameter_events') == 1)

    def announced():
        node.set_parameters(sim_time(False))
        return any(
            event.node == '/hand/changed' and event.changed_parameters[0].name == 'use_sim_time'
            for event in events
            if event.changed_parameters
        )

    runner.spin_until(announced)
