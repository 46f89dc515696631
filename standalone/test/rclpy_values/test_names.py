import pytest
from hypothesis import given
from hypothesis import strategies as st

from rclpy.exceptions import (
    InvalidNamespaceException,
    InvalidNodeNameException,
    InvalidServiceNameException,
    InvalidTopicNameException,
)
from rclpy.expand_topic_name import expand_topic_name
from rclpy.validate_full_topic_name import validate_full_topic_name
from rclpy.validate_namespace import validate_namespace
from rclpy.validate_node_name import validate_node_name
from rclpy.validate_topic_name import validate_topic_name

TOKENS = st.from_regex(r'[A-Za-z_][A-Za-z0-9_]{0,8}', fullmatch=True)


@pytest.mark.parametrize(
    'name', ['chatter', '~', '~/a', '/a/b', '{node}/x', 'a/{ns}', '_x', 'a1', 'a__b']
)
def test_good_topic_names_pass(name):
    assert validate_topic_name(name) is True


@pytest.mark.parametrize(
    ('name', 'rule', 'index'),
    [
        ('', 'must not be empty string', 0),
        ('1a', 'token must not start with a number', 0),
        ('a/2b', 'token must not start with a number', 2),
        ('a/', 'must not end with a forward slash', 1),
        ('a b', 'must not contain characters other than', 1),
        ('a~', 'unless it is the first character', 1),
        ('~a', 'not followed by a forward slash', 1),
        ('a{b', r'must not have unmatched \(unbalanced\) curly braces', 1),
        ('ab}', r'must not have unmatched \(unbalanced\) curly braces', 2),
        ('{a/b}', 'substitution name must not contain characters', 2),
        ('{1a}', 'substitution name must not start with a number', 1),
    ],
)
def test_bad_topic_names_are_refused_where_they_are_bad(name, rule, index):
    with pytest.raises(InvalidTopicNameException, match=rule) as refusal:
        validate_topic_name(name)
    assert str(refusal.value).splitlines()[-1] == ' ' * (3 + index) + '^'


def test_a_refusal_reads_as_in_ros():
    with pytest.raises(InvalidServiceNameException) as refusal:
        validate_topic_name('a b', is_service=True)
    assert str(refusal.value) == (
        'Invalid service name: topic name must not contain characters other than alphanumerics, '
        "'_', '~', '{', or '}':\n  'a b'\n    ^"
    )


@pytest.mark.parametrize('name', ['chatter', '/a/', '/a//b', '/1', '/~a', '', '/' + 'a' * 247])
def test_bad_full_topic_names_are_refused(name):
    with pytest.raises(InvalidTopicNameException):
        validate_full_topic_name(name)


@pytest.mark.parametrize('name', ['', '1node', 'a/b', 'a-b', 'ä', 'a' * 256])
def test_bad_node_names_are_refused(name):
    with pytest.raises(InvalidNodeNameException):
        validate_node_name(name)


@pytest.mark.parametrize('namespace', ['', 'a', '/a/', '/a//b', '/1', '/a' * 123])
def test_bad_namespaces_are_refused(namespace):
    with pytest.raises(InvalidNamespaceException):
        validate_namespace(namespace)


@pytest.mark.parametrize('namespace', ['/', '/a', '/a/b_c'])
def test_good_namespaces_pass(namespace):
    assert validate_namespace(namespace) is True


@pytest.mark.parametrize(
    ('name', 'namespace', 'expanded'),
    [
        ('chatter', '/ns', '/ns/chatter'),
        ('chatter', '/', '/chatter'),
        ('/chatter', '/ns', '/chatter'),
        ('~', '/ns', '/ns/node'),
        ('~/chatter', '/', '/node/chatter'),
        ('{node}/x', '/ns', '/ns/node/x'),
        ('{ns}/x', '/ns', '/ns/x'),
        ('/{node}/x', '/ns', '/node/x'),
    ],
)
def test_names_expand_as_in_ros(name, namespace, expanded):
    assert expand_topic_name(name, 'node', namespace) == expanded


def test_an_unknown_substitution_is_refused():
    with pytest.raises(ValueError, match=r'unknown substitution: \{robot\}'):
        expand_topic_name('{robot}/x', 'node', '/')


@given(st.lists(TOKENS, min_size=1, max_size=5), st.sampled_from(['', '/', '~/']), TOKENS, TOKENS)
def test_what_is_valid_expands_to_what_is_fully_valid(tokens, start, node, namespace):
    name = start + '/'.join(tokens)
    assert validate_topic_name(name)
    assert validate_full_topic_name(expand_topic_name(name, node, f'/{namespace}'))
