import math

import pytest

from rclpy._arguments import parameter_overrides
from rclpy._parameter_files import parse_value, read_parameter_file


@pytest.fixture
def read(tmp_path):
    def read_text(text):
        path = tmp_path / 'parameters.yaml'
        path.write_text(text)
        return read_parameter_file(str(path))

    return read_text


@pytest.mark.parametrize(
    ('text', 'value'),
    [
        ('1', 1),
        ('-7', -7),
        ('0x10', 16),
        ('010', 8),
        ('1.0', 1.0),
        ('.5', 0.5),
        ('1e5', 1e5),
        ('-1.5E-3', -1.5e-3),
        ('-.inf', -math.inf),
        ('true', True),
        ('No', False),
        ('on', True),
        ('text', 'text'),
        ("'1'", '1'),
        ('"true"', 'true'),
        ("''", ''),
        ('12:30', '12:30'),
        ('2024-01-01', '2024-01-01'),
        ('1_000', '1_000'),
        ('nan', 'nan'),
        ('null', 'null'),
        ('[1, 2]', [1, 2]),
        ('[1.0, 2.0]', [1.0, 2.0]),
        ('[a, b]', ['a', 'b']),
        ('[true, off]', [True, False]),
        ('[]', None),
    ],
)
def test_scalars_are_read_by_ros_rules(text, value):
    parsed = parse_value(text)
    assert parsed == value
    assert type(parsed) is type(value)


def test_not_a_number_is_a_number():
    assert math.isnan(parse_value('.nan'))


def test_nested_keys_are_joined_by_dots(read):
    rules = read('node:\n  ros__parameters:\n    a: {b: {c: 1}, d: [x]}\n')
    assert rules[0].values == {'a.b.c': 1, 'a.d': ['x']}


@pytest.mark.parametrize(
    ('key', 'nodes'),
    [
        ('/**', {'/golden', '/hand/golden', '/a/hand/golden', '/hand/silver'}),
        ('/*', {'/golden'}),
        ('golden', {'/golden'}),
        ('/hand/golden', {'/hand/golden'}),
        ('/hand/*', {'/hand/golden', '/hand/silver'}),
        ('/*/golden', {'/hand/golden'}),
        ('/**/golden', {'/golden', '/hand/golden', '/a/hand/golden'}),
        ('/hand/**', {'/hand/golden', '/hand/silver'}),
    ],
)
def test_patterns_choose_their_nodes(read, key, nodes):
    rule = read(f"'{key}':\n  ros__parameters: {{x: 1}}\n")[0]
    candidates = ('/golden', '/hand/golden', '/a/hand/golden', '/hand/silver')
    assert {node for node in candidates if rule.matches(node)} == nodes


def test_namespaces_may_be_nested(read):
    rules = read('/hand:\n  golden:\n    ros__parameters: {x: 1}\n')
    assert parameter_overrides(rules, '/hand/golden') == {'x': 1}


def test_later_nodes_win(read):
    rules = read('/**:\n  ros__parameters: {x: 1, y: 1}\nn:\n  ros__parameters: {x: 2}\n')
    assert parameter_overrides(rules, '/n') == {'x': 2, 'y': 1}


@pytest.mark.parametrize(
    ('text', 'line', 'reason'),
    [
        ('', 1, 'the file is empty'),
        ('- a\n', 1, 'got a list'),
        ('n: 3\n', 1, "got '3'"),
        ('n:\n', 1, 'got nothing'),
        ('ros__parameters: {a: 1}\n', 1, 'stands under no node name'),
        ('n:\n  ros__parameters: 3\n', 2, 'expected parameter names and values'),
        ('n:\n  ros__parameters:\n    a:\n', 3, "parameter 'a': No value"),
        ('n:\n  ros__parameters:\n    a: [1, 2.0]\n', 3, 'got float and int'),
        ('n:\n  ros__parameters:\n    a: [[1]]\n', 3, 'a list may hold scalars only'),
        ('n:\n  ros__parameters:\n    a: [1\n', 4, 'expected'),
        ('n: &x\n  ros__parameters:\n    a: *x\n', 3, 'aliases'),
        ('n: ' + '[' * 800 + ']' * 800, 1, 'nested too deeply'),
        ('n:\n\tros__parameters: {}\n', 2, 'cannot start any token'),
    ],
)
def test_a_malformed_file_is_refused_with_file_line_and_reason(read, text, line, reason):
    with pytest.raises(ValueError, match=reason) as refusal:
        read(text)
    assert f"parameters.yaml': line {line}: " in str(refusal.value)


def test_a_missing_file_is_named():
    with pytest.raises(ValueError, match=r"'/nowhere\.yaml': No such file or directory"):
        read_parameter_file('/nowhere.yaml')


def test_a_directory_is_not_a_file(tmp_path):
    with pytest.raises(ValueError, match='Is a directory'):
        read_parameter_file(str(tmp_path))


def test_a_binary_file_is_refused(tmp_path):
    path = tmp_path / 'p.yaml'
    path.write_bytes(b'\xff\xfe\x00')
    with pytest.raises(ValueError, match='not UTF-8'):
        read_parameter_file(str(path))
