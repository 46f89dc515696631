"""A parameter: its name, type and value, and the same as messages."""

from __future__ import annotations

import array
from enum import Enum
from typing import Any

import yaml

from rcl_interfaces.msg import Parameter as ParameterMsg
from rcl_interfaces.msg import ParameterType, ParameterValue

PARAMETER_SEPARATOR_STRING = '.'

AllowableParameterValue = Any
"""bool, int, float, str, or a list (or array) of one of these or of single bytes; None."""

_VALUE_FIELDS = {
    ParameterType.PARAMETER_BOOL: 'bool_value',
    ParameterType.PARAMETER_INTEGER: 'integer_value',
    ParameterType.PARAMETER_DOUBLE: 'double_value',
    ParameterType.PARAMETER_STRING: 'string_value',
    ParameterType.PARAMETER_BYTE_ARRAY: 'byte_array_value',
    ParameterType.PARAMETER_BOOL_ARRAY: 'bool_array_value',
    ParameterType.PARAMETER_INTEGER_ARRAY: 'integer_array_value',
    ParameterType.PARAMETER_DOUBLE_ARRAY: 'double_array_value',
    ParameterType.PARAMETER_STRING_ARRAY: 'string_array_value',
}


class Parameter:
    """A named value of one of ROS's parameter types.

    Args:
        name: Full name, parts separated by dots.
        type_: The type; inferred from the value when None.
        value: The value.

    Raises:
        TypeError: If no type fits the value, or type_ is not a Parameter.Type.
        ValueError: If type and value do not agree.
    """

    class Type(Enum):
        """The types, with the values of rcl_interfaces/ParameterType."""

        NOT_SET = ParameterType.PARAMETER_NOT_SET
        BOOL = ParameterType.PARAMETER_BOOL
        INTEGER = ParameterType.PARAMETER_INTEGER
        DOUBLE = ParameterType.PARAMETER_DOUBLE
        STRING = ParameterType.PARAMETER_STRING
        BYTE_ARRAY = ParameterType.PARAMETER_BYTE_ARRAY
        BOOL_ARRAY = ParameterType.PARAMETER_BOOL_ARRAY
        INTEGER_ARRAY = ParameterType.PARAMETER_INTEGER_ARRAY
        DOUBLE_ARRAY = ParameterType.PARAMETER_DOUBLE_ARRAY
        STRING_ARRAY = ParameterType.PARAMETER_STRING_ARRAY

        @classmethod
        def from_parameter_value(cls, parameter_value: AllowableParameterValue) -> Parameter.Type:
            """The type of a value; TypeError if there is none.

            An empty list is BYTE_ARRAY, as in ROS.
            """
            if parameter_value is None:
                return cls.NOT_SET
            for element, scalar, several in _PYTHON_TYPES:
                if scalar is not None and isinstance(parameter_value, element):
                    return cls[scalar]
                if isinstance(parameter_value, (list, tuple, array.array)) and all(
                    isinstance(value, element) for value in parameter_value
                ):
                    return cls[several]
            if isinstance(parameter_value, (list, tuple, array.array)):
                raise TypeError(
                    'The given value is not a list of one of the allowed types'
                    f" '{parameter_value}'."
                )
            raise TypeError(
                f"The given value is not one of the allowed types '{parameter_value}'."
            )

        def check(self, parameter_value: AllowableParameterValue) -> bool:
            """Whether a value is of this type."""
            if self is Parameter.Type.NOT_SET:
                return parameter_value is None
            for element, scalar, several in _PYTHON_TYPES:
                if self.name == scalar:
                    return isinstance(parameter_value, element)
                if self.name == several:
                    return _is_list_of(parameter_value, element)
            return False

    def __init__(
        self, name: str, type_: Parameter.Type | None = None, value: AllowableParameterValue = None
    ) -> None:
        if type_ is None:
            type_ = Parameter.Type.from_parameter_value(value)
        if not isinstance(type_, Parameter.Type):
            raise TypeError(f"type must be an instance of '{Parameter.Type!r}'")
        if not type_.check(value):
            raise ValueError(f"Type '{type_}' and value '{value}' do not agree")
        self._type_ = type_
        self._name = name
        self._value = value

    @property
    def name(self) -> str:
        """The full name."""
        return self._name

    @property
    def type_(self) -> Parameter.Type:
        """The type."""
        return self._type_

    @property
    def value(self) -> AllowableParameterValue:
        """The value; None for NOT_SET."""
        return self._value

    @classmethod
    def from_parameter_msg(cls, param_msg: ParameterMsg) -> Parameter:
        """From rcl_interfaces/Parameter; ValueError for a type that ROS does not have."""
        type_ = Parameter.Type(param_msg.value.type)
        value = None
        if type_ is not Parameter.Type.NOT_SET:
            value = getattr(param_msg.value, _VALUE_FIELDS[type_.value])
        return cls(param_msg.name, type_, value)

    def to_parameter_msg(self) -> ParameterMsg:
        """As rcl_interfaces/Parameter."""
        return ParameterMsg(name=self.name, value=self.get_parameter_value())

    def get_parameter_value(self) -> ParameterValue:
        """The value as rcl_interfaces/ParameterValue."""
        message = ParameterValue(type=self.type_.value)
        if self.type_ is not Parameter.Type.NOT_SET:
            setattr(message, _VALUE_FIELDS[self.type_.value], self.value)
        return message


# The Python type of a value or of a list's elements, and the names of the two types. bool stands
# before int, whose subclass it is, and bytes first, so that an empty list is a BYTE_ARRAY.
_PYTHON_TYPES: tuple[tuple[type[Any], str | None, str], ...] = (
    (bytes, None, 'BYTE_ARRAY'),
    (bool, 'BOOL', 'BOOL_ARRAY'),
    (int, 'INTEGER', 'INTEGER_ARRAY'),
    (float, 'DOUBLE', 'DOUBLE_ARRAY'),
    (str, 'STRING', 'STRING_ARRAY'),
)


def _is_list_of(value: Any, element: type[Any]) -> bool:
    is_sequence = isinstance(value, (list, tuple)) or (
        isinstance(value, array.array) and element in (int, float)
    )
    if not is_sequence or not all(isinstance(item, element) for item in value):
        return False
    return element is not bytes or all(len(item) == 1 for item in value)


def get_parameter_value(string_value: str) -> ParameterValue:
    """Guess type and value from text, as the ros2 command line does.

    Args:
        string_value: YAML of a scalar or a list; what is none of ROS's types becomes text.
    """
    try:
        value = yaml.safe_load(string_value)
    except yaml.YAMLError:
        value = string_value
    if isinstance(value, list) and not value:
        return ParameterValue(type=ParameterType.PARAMETER_BOOL_ARRAY)
    if isinstance(value, (bool, int, float, str, list)):
        try:
            return Parameter('', value=value).get_parameter_value()
        except TypeError:
            value = string_value
    text = value if isinstance(value, str) else string_value
    return ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=text)


def parameter_value_to_python(parameter_value: ParameterValue) -> AllowableParameterValue:
    """The value of a message, None for NOT_SET; arrays become lists.

    Raises:
        RuntimeError: If the message's type is none of ROS's.
    """
    if parameter_value.type == ParameterType.PARAMETER_NOT_SET:
        return None
    field = _VALUE_FIELDS.get(parameter_value.type)
    if field is None:
        raise RuntimeError(f'unexpected parameter type {parameter_value.type}')
    value = getattr(parameter_value, field)
    return list(value) if field.endswith('array_value') else value


def parameter_dict_from_yaml_file(
    parameter_file: str,
    use_wildcard: bool = False,
    target_nodes: list[str] | None = None,
    namespace: str = '',
) -> dict[str, ParameterMsg]:
    """Read a parameter file, as `ros2 param load` does.

    Args:
        parameter_file: Path of the file.
        use_wildcard: Whether values below '/**' count too, before those of the nodes.
        target_nodes: The nodes whose values are wanted, all when None or empty.
        namespace: Put before every parameter's name.

    Returns:
        rcl_interfaces/Parameter by parameter name.

    Raises:
        RuntimeError: If a node is not in the file, or the file is not a parameter file.
    """
    with open(parameter_file, encoding='utf-8') as stream:
        try:
            content = yaml.safe_load(stream)
        except yaml.YAMLError as error:
            raise RuntimeError(f'{parameter_file} is not a YAML file: {error}') from None
    if not isinstance(content, dict):
        raise RuntimeError(f'{parameter_file} is not a ROS parameter file: no node names in it')
    wildcard = ['/**'] if use_wildcard and '/**' in content else []
    for node in target_nodes or ():
        if node not in content:
            raise RuntimeError(
                f'Param file does not contain parameters for {node},'
                f'only for nodes: {list(content)} '
            )
    nodes = wildcard + list(target_nodes or [node for node in content if node != '/**'])
    if not nodes:
        raise RuntimeError('Param file does not contain selected parameters')
    values: dict[str, Any] = {}
    for node in nodes:
        section = content[node]
        if not isinstance(section, dict) or 'ros__parameters' not in section:
            raise RuntimeError(f'YAML file is not a valid ROS parameter file for node {node}')
        values.update(section['ros__parameters'])
    return _flattened(namespace, values)


def _flattened(prefix: str, values: dict[str, Any]) -> dict[str, ParameterMsg]:
    parameters: dict[str, ParameterMsg] = {}
    for key, value in values.items():
        name = f'{prefix}{key}'
        if isinstance(value, dict):
            parameters.update(_flattened(name + PARAMETER_SEPARATOR_STRING, value))
        else:
            parameters[name] = ParameterMsg(name=name, value=get_parameter_value(str(value)))
    return parameters
