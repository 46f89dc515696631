"""The parse tree of ``.msg`` and ``.srv`` files.

Unlike a type description, the tree keeps default values and constants, which message classes
need. The grammar is ROS 2's: https://docs.ros.org/en/jazzy/Concepts/Basic/About-Interfaces.html.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

from ros_standalone.interfaces.errors import InterfaceFormatError

INTEGERS = ('int8', 'uint8', 'int16', 'uint16', 'int32', 'uint32', 'int64', 'uint64')
PRIMITIVES = frozenset({'bool', 'byte', *INTEGERS, 'float32', 'float64'})
STRINGS = frozenset({'string', 'wstring'})

_STATEMENT = re.compile(
    r'(?P<base>[A-Za-z]\w*(?:/[A-Za-z]\w*)*)(?:<=(?P<string_bound>\d+))?'
    r'(?P<brackets>\[(?P<at_most><=)?(?P<size>\d+)?\])?'
    r'\s+(?P<name>[A-Za-z]\w*)\s*(?P<rest>.*)'
)
_COMMENT = re.compile(r"""((?:[^#'"]|'(?:\\.|[^'\\])*'|"(?:\\.|[^"\\])*"|['"])*)(#.*)?""")
_SEPARATOR = re.compile(r'^---[ \t]*$', re.MULTILINE)


@dataclass(frozen=True)
class FieldType:
    """The type of a field.

    Attributes:
        base: A primitive type, ``string``, ``wstring``, or a message such as
            ``geometry_msgs/msg/Pose``.
        string_bound: Greatest number of characters of a string; None where there is none.
        is_array: Whether there is a fixed number of elements.
        is_sequence: Whether there is a varying number of elements.
        size: Number of elements of an array, greatest number of a bounded sequence, else None.
    """

    base: str
    string_bound: int | None = None
    is_array: bool = False
    is_sequence: bool = False
    size: int | None = None

    @property
    def is_single(self) -> bool:
        """Whether there is one value rather than several."""
        return not (self.is_array or self.is_sequence)

    @property
    def is_message(self) -> bool:
        """Whether the value, or each element, is a message."""
        return self.base not in PRIMITIVES and self.base not in STRINGS


@dataclass(frozen=True)
class Field:
    """A field; ``default`` is None where the file gives no default value."""

    name: str
    type: FieldType
    default: Any = None


@dataclass(frozen=True)
class Constant:
    """A named value of a message."""

    name: str
    base: str
    value: Any


@dataclass(frozen=True)
class MessageDefinition:
    """A message, or the request, response or event of a service."""

    type_name: str
    fields: tuple[Field, ...]
    constants: tuple[Constant, ...] = ()


@dataclass(frozen=True)
class ServiceDefinition:
    """A service with its three messages."""

    type_name: str
    request: MessageDefinition
    response: MessageDefinition
    event: MessageDefinition


def parse_message(type_name: str, text: str) -> MessageDefinition:
    """Parse the text of a ``.msg`` file.

    Args:
        type_name: Full name, such as ``std_msgs/msg/String``.
        text: Content of the file.

    Raises:
        InterfaceFormatError: A line is no comment, constant or field.
    """
    package = type_name.split('/')[0]
    fields: list[Field] = []
    constants: list[Constant] = []
    for number, raw_line in enumerate(text.splitlines(), 1):
        comment = _COMMENT.match(raw_line)
        line = (comment.group(1) if comment else raw_line).strip()
        if not line:
            continue
        try:
            parsed = _parse_statement(line, package)
        except ValueError as error:
            raise InterfaceFormatError(f'{type_name}, line {number}: {error}') from None
        if isinstance(parsed, Constant):
            constants.append(parsed)
        else:
            fields.append(parsed)
    return MessageDefinition(type_name, tuple(fields), tuple(constants))


def parse_service(type_name: str, text: str) -> ServiceDefinition:
    """Parse the text of a ``.srv`` file.

    Args:
        type_name: Full name, such as ``std_srvs/srv/Trigger``.
        text: Content of the file.

    Raises:
        InterfaceFormatError: There is not exactly one line ``---``, or a line is wrong.
    """
    parts = _SEPARATOR.split(text)
    if len(parts) != 2:
        raise InterfaceFormatError(
            f'{type_name}: expected one line "---" between request and response, '
            f'got {len(parts) - 1}'
        )
    event = MessageDefinition(
        f'{type_name}_Event',
        (
            Field('info', FieldType('service_msgs/msg/ServiceEventInfo')),
            Field('request', FieldType(f'{type_name}_Request', is_sequence=True, size=1)),
            Field('response', FieldType(f'{type_name}_Response', is_sequence=True, size=1)),
        ),
    )
    request = parse_message(f'{type_name}_Request', parts[0])
    response = parse_message(f'{type_name}_Response', parts[1])
    return ServiceDefinition(type_name, request, response, event)


def _parse_statement(line: str, package: str) -> Field | Constant:
    match = _STATEMENT.fullmatch(line)
    if match is None:
        raise ValueError(f'expected a constant or a field, got {line!r}')
    base = _resolve(match['base'], package)
    string_bound = int(match['string_bound']) if match['string_bound'] else None
    if string_bound is not None and base not in STRINGS:
        raise ValueError(f'only strings have an upper bound, got {line!r}')
    size = int(match['size']) if match['size'] else None
    if match['at_most'] and size is None:
        raise ValueError(f'expected a number after "<=", got {line!r}')
    is_array = size is not None and not match['at_most']
    is_sequence = match['brackets'] is not None and not is_array
    field_type = FieldType(base, string_bound, is_array, is_sequence, size)
    rest = match['rest']
    if rest.startswith('='):
        if field_type.is_message or not field_type.is_single:
            raise ValueError(f'a constant is a single number, bool or string, got {line!r}')
        return Constant(match['name'], base, _parse_value(base, rest[1:].strip()))
    default = None
    if rest:
        if field_type.is_message:
            raise ValueError(f'a message has no default value, got {line!r}')
        default = _parse_value(base, rest) if field_type.is_single else _parse_list(base, rest)
    return Field(match['name'], field_type, default)


def _resolve(base: str, package: str) -> str:
    if base == 'char':  # ROS 2's char is an unsigned byte, whose IDL type is uint8
        return 'uint8'
    if base in PRIMITIVES or base in STRINGS:
        return base
    parts = base.split('/')
    if len(parts) == 1:
        return f'{package}/msg/{base}'
    if len(parts) == 2:
        return f'{parts[0]}/msg/{parts[1]}'
    return base


def _parse_value(base: str, text: str) -> Any:
    if base in STRINGS:
        if len(text) > 1 and text[0] == text[-1] and text[0] in '\'"':
            quote = text[0]
            return text[1:-1].replace('\\' + quote, quote)
        return text
    if base == 'bool':
        if text.lower() not in ('true', 'false', '1', '0'):
            raise ValueError(f'expected true or false, got {text!r}')
        return text.lower() in ('true', '1')
    if base in ('float32', 'float64'):
        return float(text)
    value = int(text, 0)
    return bytes([value]) if base == 'byte' else value


def _parse_list(base: str, text: str) -> list[Any]:
    if not (text.startswith('[') and text.endswith(']')):
        raise ValueError(f'expected a list in brackets, got {text!r}')
    items = re.findall(r"""\s*("(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*'|[^,]+)\s*,?""", text[1:-1])
    return [_parse_value(base, item.strip()) for item in items if item.strip()]
