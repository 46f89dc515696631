from __future__ import annotations

import re

import pytest

from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from ros_standalone.middleware import WaitSet
from ros_standalone.middleware.graph import UnknownNodeError

STRING = 'std_msgs/msg/String'


@pytest.fixture
def peer(spawn):
    """Another process with a node that has one endpoint of each kind."""
    process = spawn('golden', '/hand')
    process.writer('/hand/state', True, 3)
    process.reader('/hand/command', False, 10)
    process.server('/hand/trigger', '')
    process.client('/hand/missing')
    return process


def sees(participant, predicate):
    return participant.graph.wait_until(predicate, 10.0)


def sees_all(participant):
    graph = participant.graph
    return sees(
        participant,
        lambda: (
            ('golden', '/hand') in graph.node_names_and_namespaces()
            and graph.publishers_by_node('golden', '/hand') != []
            and graph.subscribers_by_node('golden', '/hand') != []
            and graph.services_by_node('golden', '/hand') != []
            and graph.clients_by_node('golden', '/hand') != []
        ),
    )


def test_node_of_another_process_is_seen_with_its_endpoints(participant, peer):
    assert sees_all(participant)
    graph = participant.graph
    assert graph.publishers_by_node('golden', '/hand') == [('/hand/state', [STRING])]
    assert graph.subscribers_by_node('golden', '/hand') == [('/hand/command', [STRING])]
    assert graph.services_by_node('golden', '/hand') == [
        ('/hand/trigger', ['std_srvs/srv/Trigger'])
    ]
    assert graph.clients_by_node('golden', '/hand') == [
        ('/hand/missing', ['std_srvs/srv/Trigger'])
    ]


def test_topics_and_services_of_another_process_are_listed_with_their_types(participant, peer):
    assert sees_all(participant)
    assert participant.graph.topic_names_and_types() == [
        ('/hand/command', [STRING]),
        ('/hand/state', [STRING]),
    ]
    assert participant.graph.service_names_and_types() == [
        ('/hand/missing', ['std_srvs/srv/Trigger']),
        ('/hand/trigger', ['std_srvs/srv/Trigger']),
    ]


def test_names_of_dds_are_listed_on_demand(participant, peer):
    assert sees_all(participant)
    assert ('rt/hand/state', ['std_msgs::msg::dds_::String_']) in (
        participant.graph.topic_names_and_types(no_demangle=True)
    )


def test_endpoints_of_another_process_are_counted(participant, peer):
    assert sees_all(participant)
    graph = participant.graph
    assert graph.count_publishers('/hand/state') == 1
    assert graph.count_subscribers('/hand/state') == 0
    assert graph.count_subscribers('/hand/command') == 1
    assert graph.count_services('/hand/trigger') == 1
    assert graph.count_clients('/hand/missing') == 1
    assert graph.count_services('/hand/missing') == 0


def test_endpoint_is_described_with_its_node_and_policies(participant, peer):
    assert sees_all(participant)
    (record,) = participant.graph.publishers_info('/hand/state')
    assert (record.node_name, record.node_namespace) == ('golden', '/hand')
    assert (record.topic_type, record.topic_type_hash) == (STRING, 'RIHS01_test')
    assert (record.endpoint_type, len(record.endpoint_gid)) == ('PUBLISHER', 16)
    qos = record.qos_profile
    assert (qos.depth, qos.durability, qos.reliability) == (
        3,
        DurabilityPolicy.TRANSIENT_LOCAL,
        ReliabilityPolicy.RELIABLE,
    )


def test_other_process_sees_this_one(participant, spawn):
    participant.add_node('here', '/test')
    peer = spawn('there', '/test')
    assert peer.wait_nodes(2) == [['here', '/test'], ['there', '/test']]


def test_node_is_gone_at_once_when_its_process_leaves(participant, peer):
    assert sees_all(participant)
    peer.leave()
    # Well below the seconds after which DDS gives up a participant that falls silent.
    assert participant.graph.wait_until(
        lambda: not participant.graph.node_names_and_namespaces(), 2.0
    )
    assert participant.graph.topic_names_and_types() == []


def test_removed_node_is_gone_though_its_participant_stays(make_participant):
    here, there = make_participant(), make_participant()
    node = there.add_node('short', '/')
    there.add_node('long', '/')
    assert sees(here, lambda: len(here.graph.node_names_and_namespaces()) == 2)
    there.remove_node(node)
    assert sees(here, lambda: here.graph.node_names_and_namespaces() == [('long', '/')])


def test_closed_endpoint_leaves_the_graph(make_participant, volatile):
    here, there = make_participant(), make_participant()
    node = there.add_node('talker', '/')
    writer = there.create_writer(node, '/chatter', STRING, '', volatile)
    assert sees(here, lambda: here.graph.count_publishers('/chatter') == 1)
    writer.close()
    assert sees(here, lambda: here.graph.topic_names_and_types() == [])
    assert there.graph.publishers_by_node('talker', '/') == []


def test_own_endpoints_are_known_at_once(participant, volatile):
    node = participant.add_node('talker', '/')
    participant.create_writer(node, '/chatter', STRING, '', volatile)
    assert participant.graph.publishers_by_node('talker', '/') == [('/chatter', [STRING])]


def test_enclave_of_another_participant_is_known(participant, peer):
    assert sees_all(participant)
    assert participant.graph.node_names_namespaces_and_enclaves() == [('golden', '/hand', '/')]


def test_unknown_node_is_an_error_that_names_it(participant):
    with pytest.raises(UnknownNodeError, match=re.escape("'nobody' in namespace '/nowhere'")):
        participant.graph.publishers_by_node('nobody', '/nowhere')


def test_change_of_the_graph_ends_a_wait(make_participant):
    here, there = make_participant(), make_participant()
    waitset = WaitSet(here)
    while waitset.wait([here.graph.changed], 0.5):
        pass
    there.add_node('new', '/')
    assert waitset.wait([here.graph.changed], 10.0) == {here.graph.changed}
