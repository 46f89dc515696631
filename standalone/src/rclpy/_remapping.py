"""A node's name and namespace, and the names of its topics and services, after remapping.

A rule is `[node:]match:=replacement`. The match `__node` (or `__name`) gives the node another
name, `__ns` another namespace, anything else renames topics and services; `rostopic://` and
`rosservice://` before it limit the rule to one of them. The first rule that fits applies.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Flag, auto

from rclpy._name_rules import full_topic_violation
from rclpy.exceptions import InvalidServiceNameException, InvalidTopicNameException
from rclpy.expand_topic_name import expand_topic_name
from rclpy.validate_full_topic_name import validate_full_topic_name
from rclpy.validate_namespace import validate_namespace
from rclpy.validate_node_name import validate_node_name
from rclpy.validate_topic_name import validate_topic_name

_TOKEN = r'[A-Za-z_][A-Za-z0-9_]*'
_NAME = re.compile(rf'(~/|/)?{_TOKEN}(/{_TOKEN})*')


class RuleKind(Flag):
    """What a rule renames."""

    TOPIC = auto()
    SERVICE = auto()
    NODE_NAME = auto()
    NAMESPACE = auto()


@dataclass(frozen=True)
class RemapRule:
    """One rule.

    Attributes:
        kind: What it renames.
        match: The name that it is for, not expanded; '' for node names and namespaces.
        replacement: The new name, not expanded.
        node_name: The node that it is for, None for every node.
    """

    kind: RuleKind
    match: str
    replacement: str
    node_name: str | None = None


def parse_remap_rule(text: str) -> RemapRule:
    """Read a rule.

    Raises:
        ValueError: If the text is not a rule, saying what was expected.
    """
    left, separator, replacement = text.partition(':=')
    if not separator:
        raise ValueError(f"expected 'match:=replacement', got '{text}' without ':='")
    node_name = None
    prefix = re.match(rf'({_TOKEN}):(?!//)', left)
    if prefix:
        node_name = prefix[1]
        left = left[prefix.end() :]
    if not left or not replacement:
        raise ValueError(f"expected a name on both sides of ':=', got '{text}'")
    if left in ('__node', '__name'):
        if not re.fullmatch(_TOKEN, replacement):
            raise ValueError(f"'{replacement}' is not a valid node name")
        return RemapRule(RuleKind.NODE_NAME, '', replacement, node_name)
    if left == '__ns':
        if replacement != '/' and full_topic_violation(replacement.rstrip('/')):
            raise ValueError(f"'{replacement}' is not a fully qualified namespace, as '/hand' is")
        return RemapRule(RuleKind.NAMESPACE, '', replacement.rstrip('/') or '/', node_name)
    kind = RuleKind.TOPIC | RuleKind.SERVICE
    for scheme, only in (('rostopic://', RuleKind.TOPIC), ('rosservice://', RuleKind.SERVICE)):
        if left.startswith(scheme):
            kind, left = only, left[len(scheme) :]
    for name in (left, replacement):
        if '*' in name:
            raise ValueError(f"Wildcard '*' is not implemented, got '{name}'")
        if not _NAME.fullmatch(name):
            raise ValueError(f"'{name}' is not a valid topic or service name")
    return RemapRule(kind, left, replacement, node_name)


class Names:
    """The names of one node and of what it creates.

    Args:
        node_name: The node's base name as its constructor got it.
        namespace: Its namespace; '' is '/', and a missing leading '/' is added.
        rules: Remapping rules, the node's own before the process's.

    Raises:
        InvalidNodeNameException: If the name is invalid.
        InvalidNamespaceException: If the namespace is invalid.
    """

    def __init__(
        self, node_name: str, namespace: str | None = None, rules: Iterable[RemapRule] = ()
    ) -> None:
        self._rules = tuple(rules)
        validate_node_name(node_name)
        namespace = namespace or '/'
        if not namespace.startswith('/'):
            namespace = f'/{namespace}'
        validate_namespace(namespace)
        self.name = self._first(RuleKind.NODE_NAME, node_name) or node_name
        """The base name, remapped."""
        self.namespace = self._first(RuleKind.NAMESPACE, self.name) or namespace
        """The full namespace, remapped."""
        validate_node_name(self.name)
        validate_namespace(self.namespace)

    @property
    def fully_qualified_name(self) -> str:
        """The namespace and the name, as '/hand/golden'."""
        return f'{self.namespace.rstrip("/")}/{self.name}'

    @property
    def logger_name(self) -> str:
        """The name of the node's logger, as 'hand.golden'."""
        return self.fully_qualified_name[1:].replace('/', '.')

    def topic(self, name: str, *, only_expand: bool = False) -> str:
        """The full name of a topic; InvalidTopicNameException for an invalid one."""
        return self._resolve(name, RuleKind.TOPIC, only_expand)

    def service(self, name: str, *, only_expand: bool = False) -> str:
        """The full name of a service; InvalidServiceNameException for an invalid one."""
        return self._resolve(name, RuleKind.SERVICE, only_expand)

    def _resolve(self, name: str, kind: RuleKind, only_expand: bool) -> str:
        is_service = kind is RuleKind.SERVICE
        validate_topic_name(name, is_service=is_service)
        try:
            full_name = self._expand(name)
        except ValueError as error:
            exception = InvalidServiceNameException if is_service else InvalidTopicNameException
            text = str(error).rpartition('invalid: ')[2]
            raise exception(name, text, name.index('{')) from None
        if not only_expand:
            full_name = self._remap(full_name, kind)
        validate_full_topic_name(full_name, is_service=is_service)
        return full_name

    def _expand(self, name: str) -> str:
        return expand_topic_name(name, self.name, self.namespace)

    def _remap(self, full_name: str, kind: RuleKind) -> str:
        for rule in self._rules:
            if (
                kind in rule.kind
                and rule.node_name in (None, self.name)
                and self._expand(rule.match) == full_name
            ):
                return self._expand(rule.replacement)
        return full_name

    def _first(self, kind: RuleKind, node_name: str) -> str | None:
        for rule in self._rules:
            if kind in rule.kind and rule.node_name in (None, node_name):
                return rule.replacement
        return None
