"""Parameter values from YAML: parameter files, and the values of `-p name:=value`.

Scalars are read by ROS's rules, which are not PyYAML's: `1e5` is a number, `12:30` and dates are
text, `yes` and `on` are true.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

_PARAMETERS_KEY = 'ros__parameters'
_TRUE = {
    form for word in ('y', 'yes', 'true', 'on') for form in (word, word.title(), word.upper())
}
_FALSE = {
    form for word in ('n', 'no', 'false', 'off') for form in (word, word.title(), word.upper())
}
_INTEGER = re.compile(r'[-+]?(0[xX][0-9a-fA-F]+|[0-9]+)')
_FLOAT = re.compile(r'[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?')
_NAN = ('.nan', '.NaN', '.NAN')
_INFINITY = re.compile(r'([-+]?)\.(inf|Inf|INF)')


@dataclass(frozen=True)
class ParameterRule:
    """Values for the nodes whose full name a pattern matches.

    Attributes:
        pattern: A full node name, in which `*` stands for one token and `**` for any number.
        values: Values by parameter name; None is a value of no type (an empty list).
    """

    pattern: str
    values: dict[str, Any]

    def matches(self, node: str) -> bool:
        """Whether the rule is for the node of this full name."""
        # `/**` is any number of tokens, none included; `/*` is exactly one.
        expression = re.escape('/' + self.pattern.lstrip('/'))
        expression = expression.replace(r'/\*\*', r'(/\w+)*').replace(r'/\*', r'/\w+')
        return re.fullmatch(expression, node) is not None


def read_parameter_file(path: str) -> tuple[ParameterRule, ...]:
    """The rules of a parameter file, in its order.

    Raises:
        ValueError: If the file cannot be read or is malformed; the message names file and line.
    """
    try:
        text = Path(path).read_text(encoding='utf-8')
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else 'it is not UTF-8 text'
        raise ValueError(f"Error opening YAML file '{path}': {reason}") from None
    try:
        root = _composed(text)
        if root is None:
            raise ValueError('line 1: the file is empty, expected node names with ros__parameters')
        return tuple(_node_rules(root, ''))
    except RecursionError:
        raise ValueError(f"Error parsing YAML file '{path}': it is nested too deeply") from None
    except ValueError as error:
        raise ValueError(f"Error parsing YAML file '{path}': {error}") from None


def parse_value(text: str) -> Any:
    """The value of `-p name:=value`; ValueError if it is not a scalar or a list of scalars."""
    try:
        node = _composed(text)
    except ValueError as error:
        raise ValueError(f"'{text}' is not YAML: {error}") from None
    if node is None:
        raise ValueError('No value')
    if isinstance(node, yaml.MappingNode):
        raise ValueError(f"expected a value or a list of values, got the mapping '{text}'")
    return _value(node)


def _composed(text: str) -> yaml.Node | None:
    try:
        for event in yaml.parse(text, Loader=yaml.SafeLoader):
            if isinstance(event, yaml.AliasEvent):
                raise ValueError(f"{_line(event)}: aliases ('*{event.anchor}') are not supported")
        return yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.YAMLError as error:
        raise ValueError(_yaml_reason(error)) from None
    except RecursionError:
        raise ValueError('line 1: it is nested too deeply') from None


def _yaml_reason(error: yaml.YAMLError) -> str:
    mark = getattr(error, 'problem_mark', None)
    problem = getattr(error, 'problem', None) or getattr(error, 'reason', str(error))
    return f'line {mark.line + 1}: {problem}' if mark else str(problem)


def _line(place: yaml.Node | yaml.Event) -> str:
    mark: Any = place.start_mark
    return f'line {mark.line + 1}'


def _entries(node: yaml.Node, what: str) -> Iterator[tuple[str, yaml.Node]]:
    if not isinstance(node, yaml.MappingNode):
        raise ValueError(f'{_line(node)}: expected {what}, got {_described(node)}')
    for key, value in node.value:
        if not isinstance(key, yaml.ScalarNode) or not key.value:
            raise ValueError(f'{_line(key)}: a key must be a name, got {_described(key)}')
        yield key.value, value


def _described(node: yaml.Node) -> str:
    if isinstance(node, yaml.MappingNode):
        return 'a mapping'
    if isinstance(node, yaml.SequenceNode):
        return 'a list'
    return f"'{node.value}'" if node.value else 'nothing'


def _node_rules(node: yaml.Node, prefix: str) -> Iterator[ParameterRule]:
    for key, value in _entries(node, f"node names with '{_PARAMETERS_KEY}' below them"):
        if key == _PARAMETERS_KEY:
            if not prefix:
                raise ValueError(f"{_line(value)}: '{_PARAMETERS_KEY}' stands under no node name")
            yield ParameterRule(prefix, dict(_flattened(value, '')))
        else:
            yield from _node_rules(value, f'{prefix.rstrip("/")}/{key.lstrip("/")}')


def _flattened(node: yaml.Node, prefix: str) -> Iterator[tuple[str, Any]]:
    for key, value in _entries(node, 'parameter names and values'):
        name = f'{prefix}{key}'
        if isinstance(value, yaml.MappingNode):
            yield from _flattened(value, f'{name}.')
        else:
            try:
                yield name, _value(value)
            except ValueError as error:
                raise ValueError(f"{_line(value)}: parameter '{name}': {error}") from None


def _value(node: yaml.Node) -> Any:
    if isinstance(node, yaml.ScalarNode):
        return _scalar(node)
    values = []
    for item in node.value:
        if not isinstance(item, yaml.ScalarNode):
            raise ValueError(f'a list may hold scalars only, got {_described(item)}')
        values.append(_scalar(item))
    kinds = sorted({type(value).__name__ for value in values})
    if len(kinds) > 1:
        raise ValueError(f'Sequence should be of same type, got {" and ".join(kinds)}')
    # An empty list has no type that ROS could tell.
    return values or None


def _scalar(node: yaml.ScalarNode) -> Any:
    text: str = node.value
    if node.style is not None or (node.tag == 'tag:yaml.org,2002:str' and not text):
        return text
    if not text:
        raise ValueError('No value')
    if text in _TRUE:
        return True
    if text in _FALSE:
        return False
    if _INTEGER.fullmatch(text):
        return _integer(text)
    if _FLOAT.fullmatch(text):
        return float(text)
    if text in _NAN:
        return float('nan')
    infinity = _INFINITY.fullmatch(text)
    if infinity:
        return float(f'{infinity[1]}inf')
    return text


def _integer(text: str) -> int | float:
    digits = text.lstrip('+-')
    octal = len(digits) > 1 and digits[0] == '0' and digits.isdigit()
    try:
        value = int(text, 8) if octal else int(text, 0)
    except ValueError:
        # As C's strtod does, 089 is read as a decimal number.
        return float(text)
    return value if -(2**63) <= value < 2**63 else float(value)
