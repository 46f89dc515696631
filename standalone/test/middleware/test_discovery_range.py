from __future__ import annotations

import os
import xml.etree.ElementTree as ElementTree

import pytest

from ros_standalone.middleware import (
    ConfigurationError,
    discovery_configuration,
    domain_id_from,
)


def settings(domain_id=0, **environment):
    configuration = discovery_configuration(environment, domain_id)
    return ElementTree.fromstring(configuration)


def peers(configuration):
    return [peer.attrib['Address'] for peer in configuration.iter('Peer')]


def interfaces(configuration):
    return [interface.attrib for interface in configuration.iter('NetworkInterface')]


@pytest.mark.parametrize('environment', [{}, {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'}])
def test_default_is_the_loopback_interface_without_multicast(environment):
    configuration = settings(**environment)
    assert interfaces(configuration) == [{'address': '127.0.0.1'}]
    assert configuration.findtext('.//AllowMulticast') == 'false'
    assert peers(configuration) == ['127.0.0.1']
    assert configuration.findtext('.//ParticipantIndex') == 'auto'


def test_subnet_opens_multicast_and_interfaces():
    configuration = settings(ROS_AUTOMATIC_DISCOVERY_RANGE='SUBNET')
    assert interfaces(configuration) == []
    assert configuration.find('.//AllowMulticast') is None


def test_off_has_a_tag_that_no_other_process_has():
    configuration = settings(ROS_AUTOMATIC_DISCOVERY_RANGE='OFF', ROS_STATIC_PEERS='192.0.2.7')
    assert configuration.findtext('.//Tag') == f'ros_discovery_off_{os.getpid()}'
    assert peers(configuration) == []
    assert interfaces(configuration) == [{'address': '127.0.0.1'}]


def test_system_default_leaves_cyclone_alone():
    assert discovery_configuration({'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SYSTEM_DEFAULT'}) is None


def test_own_cyclone_settings_of_the_user_win():
    environment = {'CYCLONEDDS_URI': 'file:///etc/mine.xml', 'ROS_STATIC_PEERS': '192.0.2.7'}
    assert discovery_configuration(environment) is None


def test_empty_cyclone_settings_are_none():
    assert discovery_configuration({'CYCLONEDDS_URI': ' '}) == discovery_configuration({})


def test_static_peers_are_added():
    configuration = settings(
        ROS_AUTOMATIC_DISCOVERY_RANGE='SUBNET', ROS_STATIC_PEERS='192.0.2.7; hand.example;'
    )
    assert peers(configuration) == ['192.0.2.7', 'hand.example']


def test_static_peer_elsewhere_opens_the_interface_that_leads_there():
    configuration = settings(ROS_STATIC_PEERS='192.0.2.7')
    assert interfaces(configuration) == []
    assert configuration.findtext('.//AllowMulticast') == 'false'
    assert peers(configuration) == ['127.0.0.1', '192.0.2.7']


def test_static_peers_on_this_machine_keep_to_loopback():
    configuration = settings(ROS_STATIC_PEERS='localhost;127.0.0.2')
    assert interfaces(configuration) == [{'address': '127.0.0.1'}]


def test_name_of_a_peer_cannot_change_the_settings():
    configuration = settings(ROS_STATIC_PEERS='"/><Evil a="<&')
    assert peers(configuration)[1] == '"/><Evil a="<&'


@pytest.mark.parametrize('domain_id', [0, 1, 100, 231, 232])
def test_ports_of_all_participants_stay_in_the_domain_and_are_ports(domain_id):
    largest = int(settings(domain_id).findtext('.//MaxAutoParticipantIndex'))
    last_port = 7400 + 250 * domain_id + 11 + 2 * largest
    assert last_port < 7400 + 250 * (domain_id + 1)
    assert last_port <= 65535
    assert largest >= 60


def test_unknown_range_is_an_error_that_names_the_known_ones():
    with pytest.raises(
        ConfigurationError,
        match=r"one of LOCALHOST, SUBNET, OFF, SYSTEM_DEFAULT, got 'NEARBY'",
    ):
        discovery_configuration({'ROS_AUTOMATIC_DISCOVERY_RANGE': 'NEARBY'})


@pytest.mark.parametrize(('text', 'domain_id'), [('', 0), ('7', 7), (' 232 ', 232)])
def test_domain_is_read_from_the_environment(text, domain_id):
    assert domain_id_from({'ROS_DOMAIN_ID': text}) == domain_id


def test_domain_is_zero_unless_said():
    assert domain_id_from({}) == 0


@pytest.mark.parametrize('text', ['233', '-1', 'seven', '1.5'])
def test_impossible_domain_is_an_error_that_names_it(text):
    with pytest.raises(ConfigurationError, match=rf"ROS_DOMAIN_ID .*0\.\.232, got '{text}'"):
        domain_id_from({'ROS_DOMAIN_ID': text})
