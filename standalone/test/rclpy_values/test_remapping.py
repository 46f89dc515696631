import pytest

from rclpy._remapping import Names, parse_remap_rule
from rclpy.exceptions import (
    InvalidNamespaceException,
    InvalidNodeNameException,
    InvalidServiceNameException,
    InvalidTopicNameException,
)


def names(*rules, node='golden', namespace='/hand'):
    return Names(node, namespace, [parse_remap_rule(rule) for rule in rules])


def test_names_without_rules_expand():
    assert names().topic('~/markers') == '/hand/golden/markers'


def test_a_node_gets_another_name():
    renamed = names('__node:=silver')
    assert renamed.fully_qualified_name == '/hand/silver'
    assert renamed.topic('~/markers') == '/hand/silver/markers'


def test_the_old_word_for_a_node_name_still_counts():
    assert names('__name:=silver').name == 'silver'


def test_a_node_gets_another_namespace():
    moved = names('__ns:=/arm/left')
    assert moved.fully_qualified_name == '/arm/left/golden'
    assert moved.logger_name == 'arm.left.golden'


def test_a_topic_is_renamed_however_it_is_written():
    renamed = names('/hand/golden/markers:=/shown')
    assert {renamed.topic(name) for name in ('~/markers', 'golden/markers')} == {'/shown'}


def test_a_relative_rule_counts_in_the_nodes_namespace():
    assert names('markers:=shown').topic('/hand/markers') == '/hand/shown'


def test_a_private_rule_counts_below_the_node():
    assert names('~/markers:=~/shown').topic('~/markers') == '/hand/golden/shown'


def test_rules_rename_services_too():
    assert names('~/plan:=/plan').service('~/plan') == '/plan'


def test_a_scheme_limits_a_rule():
    limited = names('rosservice://~/x:=/y')
    assert (limited.service('~/x'), limited.topic('~/x')) == ('/y', '/hand/golden/x')


def test_the_first_rule_wins():
    assert names('a:=b', 'a:=c').topic('a') == '/hand/b'


def test_a_rule_for_another_node_does_not_count():
    assert names('silver:a:=b', 'silver:__ns:=/x').topic('a') == '/hand/a'


def test_a_rule_for_this_node_counts():
    assert names('golden:a:=b').topic('a') == '/hand/b'


def test_name_rules_are_chosen_by_the_old_name_and_topic_rules_by_the_new():
    renamed = names('golden:__node:=silver', 'silver:a:=b')
    assert renamed.topic('a') == '/hand/b'


def test_expansion_alone_leaves_rules_out():
    assert names('a:=b').topic('a', only_expand=True) == '/hand/a'


def test_rosout_and_parameter_events_can_be_renamed():
    assert names('/rosout:=/log').topic('/rosout') == '/log'


@pytest.mark.parametrize('namespace', [None, '', '/'])
def test_no_namespace_is_the_root(namespace):
    assert Names('node', namespace).fully_qualified_name == '/node'


def test_a_namespace_gets_its_leading_slash():
    assert Names('node', 'hand').namespace == '/hand'


def test_a_bad_node_name_is_refused():
    with pytest.raises(InvalidNodeNameException):
        Names('no de', '/')


def test_a_bad_namespace_is_refused():
    with pytest.raises(InvalidNamespaceException):
        Names('node', '/a//b')


def test_a_bad_topic_name_is_refused():
    with pytest.raises(InvalidTopicNameException, match='unknown substitution'):
        names().topic('{robot}/x')


def test_a_bad_service_name_is_refused():
    with pytest.raises(InvalidServiceNameException):
        names().service('a b')


@pytest.mark.parametrize(
    ('rule', 'reason'),
    [
        ('foo', "without ':='"),
        (':=b', 'on both sides'),
        ('a:=', 'on both sides'),
        ('a*:=b', 'Wildcard'),
        ('a:=b c', "'b c' is not a valid topic or service name"),
        ('a/:=b', "'a/' is not a valid"),
        ('__node:=a/b', "'a/b' is not a valid node name"),
        ('__ns:=hand', "'hand' is not a fully qualified namespace"),
        ('__ns:=/a//b', 'is not a fully qualified namespace'),
    ],
)
def test_a_malformed_rule_says_what_is_wrong(rule, reason):
    with pytest.raises(ValueError, match=reason.replace('*', r'\*')):
        parse_remap_rule(rule)
