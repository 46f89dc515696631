"""Reading what a node gives to declare_parameters."""

from __future__ import annotations

import warnings
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor, ParameterValue
from rclpy.parameter import PARAMETER_SEPARATOR_STRING, Parameter
from rclpy.validate_parameter_name import validate_parameter_name


def read_declaration(
    namespace: str, entry: tuple[Any, ...], index: int
) -> tuple[str, Any, ParameterDescriptor]:
    """Read one entry of declare_parameters.

    Args:
        namespace: Put before the name with a dot, unless empty.
        entry: A name, optionally a value or Parameter.Type, optionally a descriptor.
        index: Where the entry stands in its list, for messages.

    Returns:
        The full name, the value (None where only a type is given), and the descriptor with the
        type filled in.

    Raises:
        TypeError: If the entry is not of that form.
        ValueError: If a statically typed parameter gets neither value nor type.
        InvalidParameterException: If the name is empty.
    """
    if not 1 <= len(entry) <= 3:
        raise TypeError(
            f'Invalid parameter tuple length at index {index} in parameters list: '
            f'{entry}; expecting length between 1 and 3'
        )
    name = entry[0]
    if not isinstance(name, str):
        raise TypeError(f'First element {name} at index {index} in parameters list is not a str.')
    if namespace:
        name = f'{namespace}{PARAMETER_SEPARATOR_STRING}{name}'
    validate_parameter_name(name)
    value = entry[1] if len(entry) > 1 else None
    descriptor = entry[2] if len(entry) > 2 else ParameterDescriptor()
    if not isinstance(descriptor, ParameterDescriptor):
        raise TypeError(
            f'Third element {descriptor} at index {index} in parameters list '
            'is not a ParameterDescriptor.'
        )
    if len(entry) == 1:
        warnings.warn(
            f"when declaring parameter named '{name}', "
            'declaring a parameter only providing its name is deprecated. You have to either:\n'
            '\t- Pass a name and a default value different to "PARAMETER NOT SET"'
            ' (and optionally a descriptor).\n'
            '\t- Pass a name and a parameter type.\n'
            '\t- Pass a name and a descriptor with `dynamic_typing=True',
            stacklevel=5,
        )
        descriptor.dynamic_typing = True
    if isinstance(value, Parameter.Type):
        _declare_type(name, value, descriptor)
        return name, None, descriptor
    if not descriptor.dynamic_typing:
        if isinstance(value, ParameterValue):
            descriptor.type = value.type
        else:
            descriptor.type = Parameter.Type.from_parameter_value(value).value
        if descriptor.type == Parameter.Type.NOT_SET.value:
            raise ValueError(
                'Cannot declare a statically typed parameter with default value '
                'of type PARAMETER_NOT_SET'
            )
    return name, value, descriptor


def _declare_type(name: str, type_: Parameter.Type, descriptor: ParameterDescriptor) -> None:
    if type_ is Parameter.Type.NOT_SET:
        raise ValueError(
            f'Cannot declare parameter {{{name}}} as statically typed of type NOT_SET'
        )
    if descriptor.dynamic_typing:
        raise ValueError(
            f'When declaring parameter {{{name}}} passing a descriptor with'
            '`dynamic_typing=True` is not allowed when the parameter type is provided'
        )
    descriptor.type = type_.value
