import array

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcl_interfaces.msg import ParameterType, ParameterValue
from rclpy.parameter import (
    Parameter,
    get_parameter_value,
    parameter_dict_from_yaml_file,
    parameter_value_to_python,
)

INTEGERS = st.integers(-(2**63), 2**63 - 1)
FLOATS = st.floats(allow_nan=False)
TEXT = st.text(st.characters(codec='utf-8', exclude_characters='\0'))
VALUES = st.one_of(
    st.none(),
    st.booleans(),
    INTEGERS,
    FLOATS,
    TEXT,
    st.lists(st.booleans(), min_size=1),
    st.lists(INTEGERS, min_size=1),
    st.lists(FLOATS, min_size=1),
    st.lists(TEXT, min_size=1),
    st.lists(st.binary(min_size=1, max_size=1)),
)


@given(VALUES)
def test_a_value_survives_its_message(value):
    message = Parameter('a.b', value=value).to_parameter_msg()
    assert parameter_value_to_python(message.value) == value
    assert Parameter.from_parameter_msg(message).type_ is Parameter('a.b', value=value).type_


@pytest.mark.parametrize(
    ('value', 'type_'),
    [
        (None, 'NOT_SET'),
        (True, 'BOOL'),
        (1, 'INTEGER'),
        (1.0, 'DOUBLE'),
        ('x', 'STRING'),
        ([b'x'], 'BYTE_ARRAY'),
        ([], 'BYTE_ARRAY'),
        ([True], 'BOOL_ARRAY'),
        ((1, 2), 'INTEGER_ARRAY'),
        (array.array('d', [1.0]), 'DOUBLE_ARRAY'),
        (['x'], 'STRING_ARRAY'),
    ],
)
def test_types_are_inferred(value, type_):
    assert Parameter('p', value=value).type_ is Parameter.Type[type_]


@pytest.mark.parametrize('value', [[1, 'a'], [1, 2.0], [None], ['a', b'b']])
def test_mixed_lists_have_no_type(value):
    with pytest.raises(TypeError, match='not a list of one of the allowed types'):
        Parameter('p', value=value)


@pytest.mark.parametrize('value', [{}, object(), {1}, 1j])
def test_other_values_have_no_type(value):
    with pytest.raises(TypeError, match='not one of the allowed types'):
        Parameter('p', value=value)


def test_type_and_value_must_agree():
    with pytest.raises(ValueError, match=r"Type 'Type\.DOUBLE' and value '1' do not agree"):
        Parameter('p', Parameter.Type.DOUBLE, 1)


def test_a_type_must_be_one():
    with pytest.raises(TypeError, match='type must be an instance of'):
        Parameter('p', 3, 1.0)


def test_a_byte_array_holds_single_bytes():
    with pytest.raises(ValueError, match='do not agree'):
        Parameter('p', Parameter.Type.BYTE_ARRAY, [b'ab'])


def test_an_empty_list_may_be_of_any_array_type():
    for type_ in Parameter.Type:
        if type_.name.endswith('ARRAY'):
            assert Parameter('p', type_, []).value == []


@pytest.mark.parametrize(
    ('text', 'type_', 'value'),
    [
        ('true', 'BOOL', True),
        ('3', 'INTEGER', 3),
        ('3.5', 'DOUBLE', 3.5),
        ('x', 'STRING', 'x'),
        ("'3'", 'STRING', '3'),
        ('[1, 2]', 'INTEGER_ARRAY', [1, 2]),
        ('[a, b]', 'STRING_ARRAY', ['a', 'b']),
        ('[1, a]', 'STRING', '[1, a]'),
        ('[1', 'STRING', '[1'),
    ],
)
def test_text_is_guessed_as_the_command_line_does(text, type_, value):
    message = get_parameter_value(text)
    assert message.type == Parameter.Type[type_].value
    assert parameter_value_to_python(message) == value


def test_an_unknown_type_of_a_message_is_refused():
    with pytest.raises(RuntimeError, match='unexpected parameter type 99'):
        parameter_value_to_python(ParameterValue(type=99))


def test_a_parameter_file_is_read_for_its_nodes(tmp_path):
    path = tmp_path / 'p.yaml'
    path.write_text(
        '/**:\n  ros__parameters: {a: 1, b: {c: x}}\n/n:\n  ros__parameters: {a: 2.0}\n'
    )
    parameters = parameter_dict_from_yaml_file(str(path), True, ['/n'], 'pre.')
    assert {name: parameter_value_to_python(p.value) for name, p in parameters.items()} == {
        'pre.a': 2.0,
        'pre.b.c': 'x',
    }
    assert parameters['pre.a'].value.type == ParameterType.PARAMETER_DOUBLE


@pytest.mark.parametrize(
    ('text', 'nodes', 'reason'),
    [
        ('/n:\n  ros__parameters: {a: 1}\n', ['/m'], 'does not contain parameters for /m'),
        ('/n: {a: 1}\n', None, 'not a valid ROS parameter file for node /n'),
        ('/**:\n  ros__parameters: {a: 1}\n', None, 'does not contain selected parameters'),
        ('3', None, 'not a ROS parameter file'),
        ('{', None, 'not a YAML file'),
    ],
)
def test_a_file_that_is_no_parameter_file_is_refused(tmp_path, text, nodes, reason):
    path = tmp_path / 'p.yaml'
    path.write_text(text)
    with pytest.raises(RuntimeError, match=reason):
        parameter_dict_from_yaml_file(str(path), target_nodes=nodes)
