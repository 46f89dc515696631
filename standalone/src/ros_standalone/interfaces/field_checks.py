"""What a message field takes, with the words of ROS 2's generated classes.

A check is a function of the value given that returns the value to store or raises AssertionError.
Numbers of a sequence are stored in an ``array.array``, those of an array in a NumPy array.

Types, ranges of numbers and lengths of arrays are always checked. ROS 2 Jazzy takes, and sends,
more values than a bounded sequence or string may have, unless ROS_PYTHON_CHECK_FIELDS is 1; so do
these checks.
"""

from __future__ import annotations

import array
import math
import os
from collections import UserList, UserString
from collections.abc import Callable, Sequence, Set
from typing import Any

from ros_standalone.interfaces.definitions import STRINGS, FieldType

Check = Callable[[Any], Any]

TYPE_CODES = {
    'float32': 'f',
    'float64': 'd',
    'int8': 'b',
    'uint8': 'B',
    'int16': 'h',
    'uint16': 'H',
    'int32': 'i',
    'uint32': 'I',
    'int64': 'q',
    'uint64': 'Q',
}
"""Numeric types with their codes in the modules array and struct."""

IDL_NAMES = {'float32': 'float', 'float64': 'double', 'bool': 'boolean', 'byte': 'octet'}
"""Primitive types that IDL calls by another name."""

_bounds_are_checked = os.environ.get('ROS_PYTHON_CHECK_FIELDS') == '1'

# The greatest finite number, and what ROS 2 takes for it and names in its texts.
_FLOAT_BOUNDS = {
    'float32': (3.4028234663852886e38, 3.402823466e38),
    'float64': (1.7976931348623157e308, 1.7976931348623157e308),
}


def integer_range(base: str) -> tuple[int, int]:
    """Least and greatest value of an integer type such as ``uint8``."""
    bits = int(base.removeprefix('u').removeprefix('int'))
    return (0, 2**bits - 1) if base.startswith('u') else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)


def python_type(base: str) -> type[Any]:
    """The Python type of a primitive value or string."""
    if base in STRINGS:
        return str
    if base == 'bool':
        return bool
    if base == 'byte':
        return bytes
    return float if base in _FLOAT_BOUNDS else int


def check_for(name: str, kind: FieldType, message_class: type[Any] | None) -> Check:
    """The check of a field.

    Args:
        name: The field's name, for error texts.
        kind: The field's type.
        message_class: The class of the value or of its elements if they are messages.
    """
    if kind.is_single:
        return _single_check(name, kind, message_class)
    several = _several_check(name, kind, message_class)
    if kind.base not in TYPE_CODES:
        return several
    return (
        _array_check(name, kind, several)
        if kind.is_array
        else _sequence_check(name, kind, several)
    )


def converter_for(name: str, kind: FieldType) -> Check | None:
    """How the constructor converts the numbers that it is given before they are checked.

    As in ROS 2, it takes any numbers, also integers for floating-point fields, where assigning to
    a field does not. None where nothing is converted.
    """
    if kind.is_single or kind.base not in TYPE_CODES:
        return None
    code = TYPE_CODES[kind.base]
    if kind.is_array:

        def to_numpy(value: Any) -> Any:
            import numpy as np

            try:
                return np.array(value, dtype=kind.base)
            except (TypeError, ValueError, OverflowError) as error:
                raise AssertionError(f"The '{name}' field takes {kind.base}: {error}") from None

        return to_numpy

    def to_array(value: Any) -> Any:
        dtype = getattr(value, 'dtype', None)
        if dtype == kind.base and value.ndim == 1:
            result = array.array(code)
            result.frombytes(value.tobytes())
            return result
        try:
            return array.array(code, value)
        except (TypeError, OverflowError) as error:
            raise AssertionError(f"The '{name}' field takes {kind.base}: {error}") from None

    return to_array


def _in_range_of(base: str) -> Callable[[Any], bool] | None:
    """Whether a number is in a type's range; None for what is no number."""
    if base in _FLOAT_BOUNDS:
        greatest = _FLOAT_BOUNDS[base][0]
        return lambda value: not abs(value) > greatest or math.isinf(value)
    if base in TYPE_CODES:
        low, high = integer_range(base)
        return lambda value: low <= value <= high
    return None


def _range_text(base: str) -> tuple[str, Any, Any]:
    """What ROS 2 calls a number of that type, and its least and greatest value in texts."""
    if base in _FLOAT_BOUNDS:
        greatest = _FLOAT_BOUNDS[base][1]
        return IDL_NAMES[base], -greatest, greatest
    return 'unsigned integer' if base[0] == 'u' else 'integer', *integer_range(base)


def _single_check(name: str, kind: FieldType, message_class: type[Any] | None) -> Check:
    base = kind.base
    if message_class is not None:
        return _instance_check(
            message_class,
            f"The '{name}' field must be a sub message of type '{message_class.__name__}'",
        )
    if base == 'byte':
        return _byte_check(name)
    if base in STRINGS and kind.string_bound is not None:
        return _bounded_string_check(name, kind.string_bound)
    required = python_type(base)
    wrong_type = f"The '{name}' field must be of type '{required.__name__}'"
    in_range = _in_range_of(base)
    if in_range is None:
        return _instance_check(required, wrong_type)
    noun, low, high = _range_text(base)
    article = 'an' if noun[0] in 'iu' else 'a'
    out_of_range = f"The '{name}' field must be {article} {noun} in [{low}, {high}]"

    def check(value: Any) -> Any:
        if not isinstance(value, required):
            raise AssertionError(wrong_type)
        if not in_range(value):
            raise AssertionError(out_of_range)
        return value

    return check


def _instance_check(required: type[Any], wrong_type: str) -> Check:
    def check(value: Any) -> Any:
        if not isinstance(value, required):
            raise AssertionError(wrong_type)
        return value

    return check


def _byte_check(name: str) -> Check:
    def check(value: Any) -> Any:
        if not (isinstance(value, (bytes, bytearray)) and len(value) == 1):
            raise AssertionError(
                f"The '{name}' field must be of type 'bytes' or 'ByteString' with length 1"
            )
        return bytes(value)

    return check


def _bounded_string_check(name: str, bound: int) -> Check:
    def check(value: Any) -> Any:
        is_right = isinstance(value, (str, UserString))
        if not is_right or (_bounds_are_checked and len(value) > bound):
            raise AssertionError(
                f"The '{name}' field must be string value not longer than {bound}"
            )
        return value

    return check


def _several_check(name: str, kind: FieldType, message_class: type[Any] | None) -> Check:
    element = message_class or python_type(kind.base)
    in_range = _in_range_of(kind.base)
    bound = kind.string_bound if _bounds_are_checked else None
    size = kind.size if kind.is_array or _bounds_are_checked else None
    is_array = kind.is_array
    text = _several_text(name, kind, element)

    def check(value: Any) -> Any:
        is_right = (
            isinstance(value, (Sequence, Set, UserList))
            and not isinstance(value, (str, UserString))
            and (size is None or (len(value) == size if is_array else len(value) <= size))
            and all(isinstance(item, element) for item in value)
            and (bound is None or all(len(item) <= bound for item in value))
            and (in_range is None or all(map(in_range, value)))
        )
        if not is_right:
            raise AssertionError(text)
        return value

    return check


def _several_text(name: str, kind: FieldType, element: type[Any]) -> str:
    words = [f"The '{name}' field must be a set or sequence"]
    if kind.size is not None:
        words.append(
            f'with length {kind.size}' if kind.is_array else f'with length <= {kind.size}'
        )
    if kind.string_bound is not None:
        words.append(f'and each string value not longer than {kind.string_bound}')
    words.append(f"and each value of type '{element.__name__}'")
    if kind.base in TYPE_CODES:
        noun, low, high = _range_text(kind.base)
        numbers = f'{low:f}, {high:f}' if isinstance(low, float) else f'{low}, {high}'
        words.append(f'and each {noun} in [{numbers}]')
    return ' '.join(words)


def _array_check(name: str, kind: FieldType, several: Check) -> Check:
    dtype, size = kind.base, kind.size
    wrong_type = f"The '{name}' numpy.ndarray() must have the dtype of 'numpy.{dtype}'"
    wrong_size = f"The '{name}' numpy.ndarray() must have a size of {size}"

    def check(value: Any) -> Any:
        import numpy as np

        if not isinstance(value, np.ndarray):
            return np.array(several(value), dtype=dtype)
        if value.dtype != dtype:
            raise AssertionError(wrong_type)
        if value.size != size:
            raise AssertionError(wrong_size)
        return value

    return check


def _sequence_check(name: str, kind: FieldType, several: Check) -> Check:
    code, bound = TYPE_CODES[kind.base], kind.size if _bounds_are_checked else None
    wrong_code = f"The '{name}' array.array() must have the type code of '{code}'"
    too_long = f"The '{name}' array.array() must have a size <= {kind.size}"

    def check(value: Any) -> Any:
        if not isinstance(value, array.array):
            return array.array(code, several(value))
        if value.typecode != code:
            raise AssertionError(wrong_code)
        if bound is not None and len(value) > bound:
            raise AssertionError(too_long)
        return value

    return check
