"""Whether a value may be set: read-only, type, range and step, with ROS's words for a refusal."""

from __future__ import annotations

import math

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
)
from rclpy.parameter import Parameter

RELATIVE_TOLERANCE = 1e-6
"""How near to a range's end or to a step a float must be to count as on it."""


def refusal(
    parameter: Parameter,
    descriptor: ParameterDescriptor,
    *,
    declared: bool,
    check_read_only: bool,
) -> str:
    """Say why a descriptor refuses a parameter; '' if it does not.

    Args:
        parameter: The wanted name and value.
        descriptor: The descriptor; of a dynamically typed parameter it takes the value's type.
        declared: Whether the parameter is there already.
        check_read_only: Whether the read-only flag counts (it does not while declaring).
    """
    descriptor.name = parameter.name
    if check_read_only and descriptor.read_only:
        return f'Trying to set a read-only parameter: {parameter.name}.'
    type_ = parameter.type_
    if descriptor.dynamic_typing:
        descriptor.type = type_.value
    elif type_ is Parameter.Type.NOT_SET:
        return 'Static parameter cannot be undeclared' if declared else ''
    elif type_.value != descriptor.type:
        expected = Parameter.Type(descriptor.type)
        return f"Wrong parameter type, expected '{expected}' got '{type_}'"
    if type_ is Parameter.Type.INTEGER and descriptor.integer_range:
        return _integer_refusal(parameter, descriptor.integer_range[0])
    if type_ is Parameter.Type.DOUBLE and descriptor.floating_point_range:
        return _float_refusal(parameter, descriptor.floating_point_range[0])
    return ''


def _integer_refusal(parameter: Parameter, allowed: IntegerRange) -> str:
    low, high = sorted((allowed.from_value, allowed.to_value))
    value = parameter.value
    if value in (low, high):
        return ''
    if not low < value < high:
        return f'Parameter {parameter.name} out of range. Min: {low}, Max: {high}, value: {value}'
    if allowed.step != 0 and (value - low) % allowed.step != 0:
        return (
            f'The parameter value for {parameter.name} is not a valid step. '
            f'Min: {low}, max: {high}, value: {value}, step: {allowed.step}'
        )
    return ''


def _float_refusal(parameter: Parameter, allowed: FloatingPointRange) -> str:
    low, high = sorted((allowed.from_value, allowed.to_value))
    value = parameter.value
    if _close(value, low) or _close(value, high):
        return ''
    if not low < value < high:
        return f'Parameter {parameter.name} out of range Min: {low}, Max: {high}, value: {value}'
    if allowed.step != 0.0:
        nearest = low + round((value - low) / allowed.step) * allowed.step
        if not _close(nearest, value):
            return (
                f'The parameter value for {parameter.name} is not close enough to a valid step. '
                f'Min: {low}, max: {high}, value: {value}, step: {allowed.step}'
            )
    return ''


def _close(a: float, b: float) -> bool:
    return math.isclose(a, b, rel_tol=RELATIVE_TOLERANCE)
