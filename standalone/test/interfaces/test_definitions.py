import pytest

from ros_standalone.interfaces import InterfaceFormatError, package_names
from ros_standalone.interfaces.catalog import definition, interface_names
from ros_standalone.interfaces.definitions import (
    Constant,
    Field,
    FieldType,
    MessageDefinition,
    parse_message,
    parse_service,
)


def _field(line: str) -> Field:
    return parse_message('a_msgs/msg/Thing', line).fields[0]


@pytest.mark.parametrize(
    ('text', 'expected'),
    [
        ('float64', FieldType('float64')),
        ('char', FieldType('uint8')),
        ('string<=9', FieldType('string', string_bound=9)),
        ('int8[]', FieldType('int8', is_sequence=True)),
        ('int8[<=4]', FieldType('int8', is_sequence=True, size=4)),
        ('int8[4]', FieldType('int8', is_array=True, size=4)),
        ('string<=9[<=4]', FieldType('string', string_bound=9, is_sequence=True, size=4)),
        ('Other', FieldType('a_msgs/msg/Other')),
        ('b_msgs/Other[]', FieldType('b_msgs/msg/Other', is_sequence=True)),
        ('b_msgs/msg/Other', FieldType('b_msgs/msg/Other')),
    ],
)
def test_types_are_read(text: str, expected: FieldType) -> None:
    assert _field(f'{text} name').type == expected


@pytest.mark.parametrize(
    ('line', 'expected'),
    [
        ('float64 x 1', 1.0),
        ('float32 x -.5', -0.5),
        ('int32 x -2 # a comment', -2),
        ('uint8 x 0x1f', 31),
        ('bool x true', True),
        ('byte x 3', b'\x03'),
        ('string x "a # \'b\'"', "a # 'b'"),
        ("string x 'it\\'s'", "it's"),
        ('float64[] x [1, 2.5]', [1.0, 2.5]),
        ('string[] x ["a, b", \'c\']', ['a, b', 'c']),
        ('bool[2] x [true, false]', [True, False]),
        ('float64 x', None),
    ],
)
def test_default_values_are_read(line: str, expected: object) -> None:
    assert _field(line).default == expected


@pytest.mark.parametrize(
    ('line', 'expected'),
    [
        ('uint8 A=3', Constant('A', 'uint8', 3)),
        ('int8 B = -2 # why', Constant('B', 'int8', -2)),
        ('string C = "x y"', Constant('C', 'string', 'x y')),
        ('byte D=1', Constant('D', 'byte', b'\x01')),
        ('float32 E=1e3', Constant('E', 'float32', 1000.0)),
    ],
)
def test_constants_are_read(line: str, expected: Constant) -> None:
    assert parse_message('a_msgs/msg/Thing', line).constants == (expected,)


def test_comments_and_empty_lines_are_skipped() -> None:
    text = "# it's a comment\n\n  # another\nint8 x # one's own\n"
    assert parse_message('a_msgs/msg/Thing', text).fields == (Field('x', FieldType('int8')),)


@pytest.mark.parametrize(
    ('line', 'text'),
    [
        ('float64', "line 2: expected a constant or a field, got 'float64'"),
        ('@optional int8 x', 'line 2: expected a constant or a field'),
        ('int8<=3 x', 'line 2: only strings have an upper bound'),
        ('int8[<=] x', 'line 2: expected a number after "<="'),
        ('Other X=3', 'line 2: a constant is a single number'),
        ('Other x 3', 'line 2: a message has no default value'),
        ('int8[] x 3', 'line 2: expected a list in brackets'),
        ('bool x maybe', "line 2: expected true or false, got 'maybe'"),
        ('int8 x one', 'line 2: invalid literal'),
    ],
)
def test_a_wrong_line_is_named(line: str, text: str) -> None:
    with pytest.raises(InterfaceFormatError, match=text) as caught:
        parse_message('a_msgs/msg/Thing', f'int8 ok\n{line}')
    assert str(caught.value).startswith('a_msgs/msg/Thing')


def test_a_service_is_split_into_its_messages() -> None:
    service = parse_service('a_msgs/srv/Do', 'int8 x\n---\nuint8 A=1\nint8 y\n')
    assert service.request.fields == (Field('x', FieldType('int8')),)
    assert service.response == MessageDefinition(
        'a_msgs/srv/Do_Response',
        (Field('y', FieldType('int8')),),
        (Constant('A', 'uint8', 1),),
    )


@pytest.mark.parametrize('text', ['int8 x', '---\n---\n'])
def test_a_service_needs_one_separator(text: str) -> None:
    with pytest.raises(InterfaceFormatError, match='expected one line "---"'):
        parse_service('a_msgs/srv/Do', text)


@pytest.mark.parametrize('package', package_names())
def test_every_file_of_a_package_is_read(package: str) -> None:
    names = [(kind, name) for kind in ('msg', 'srv') for name in interface_names(package, kind)]
    assert names
    for kind, name in names:
        assert definition(f'{package}/{kind}/{name}').type_name == f'{package}/{kind}/{name}'
