from __future__ import annotations

import json
from pathlib import Path

import pytest

from ros_standalone.middleware import names

GOLDEN = json.loads((Path(__file__).parents[1] / 'golden' / 'cdr_jazzy.json').read_text())


def test_topic_of_ros_has_the_prefix_rt():
    assert names.topic_to_dds('/hand/state') == 'rt/hand/state'


def test_topic_without_conventions_keeps_its_name():
    assert names.topic_to_dds('raw', avoid_ros_namespace_conventions=True) == 'raw'


def test_service_is_a_topic_of_requests_and_one_of_replies():
    assert names.request_to_dds('/hand/plan') == 'rq/hand/planRequest'
    assert names.reply_to_dds('/hand/plan') == 'rr/hand/planReply'


def test_type_of_a_message_is_the_one_of_ros():
    assert names.type_to_dds('std_msgs/msg/String') == 'std_msgs::msg::dds_::String_'


def test_type_of_a_request_is_the_one_of_ros():
    assert (
        names.type_to_dds('std_srvs/srv/Trigger', '_Request')
        == 'std_srvs::srv::dds_::Trigger_Request_'
    )


@pytest.mark.parametrize('type_name', sorted(GOLDEN['messages']))
def test_type_of_a_message_comes_back(type_name):
    assert names.type_from_dds(names.type_to_dds(type_name)) == type_name


@pytest.mark.parametrize('suffix', ['_Request', '_Response'])
@pytest.mark.parametrize('type_name', sorted(GOLDEN['services']))
def test_type_of_a_service_comes_back(type_name, suffix):
    assert names.service_type_from_dds(names.type_to_dds(type_name, suffix)) == type_name


@pytest.mark.parametrize('name', ['/a', '/a/Request', '/Reply/Request'])
def test_names_come_back(name):
    assert names.topic_from_dds(names.topic_to_dds(name)) == name
    assert names.service_from_request(names.request_to_dds(name)) == name
    assert names.service_from_reply(names.reply_to_dds(name)) == name


@pytest.mark.parametrize(
    ('demangle', 'name'),
    [
        (names.topic_from_dds, 'ros_discovery_info'),
        (names.topic_from_dds, 'rq/planRequest'),
        (names.service_from_request, 'rt/planRequest'),
        (names.service_from_request, 'rq/plan'),
        (names.service_from_reply, 'rq/planRequest'),
        (names.service_type_from_dds, 'std_msgs::msg::dds_::String_'),
        (names.service_type_from_dds, 'Foreign_Request'),
    ],
)
def test_foreign_name_is_none(demangle, name):
    assert demangle(name) is None


def test_foreign_type_keeps_its_name():
    assert names.type_from_dds('Foreign::Type') == 'Foreign::Type'


@pytest.mark.parametrize('name', ['String', 'std_msgs/String', 'a/b/c/d', 'std_msgs/msg/'])
def test_incomplete_type_is_an_error_that_names_it(name):
    with pytest.raises(ValueError, match=f"'package/msg/Name', got '{name}'"):
        names.type_to_dds(name)
