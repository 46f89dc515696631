"""ROS's rules for names. Each function gives the first broken rule and where, or None."""

from __future__ import annotations

import re

Violation = tuple[str, int]
"""The rule that is broken, and the index of the character that breaks it."""

MAX_NODE_NAME_LENGTH = 255
MAX_NAMESPACE_LENGTH = 245
MAX_TOPIC_LENGTH = 247


def node_name_violation(name: str) -> Violation | None:
    """Check the base name of a node."""
    if not name:
        return 'node name must not be empty', 0
    bad = re.search(r'[^A-Za-z0-9_]', name)
    if bad:
        return (
            "node name must not contain characters other than alphanumerics or '_'",
            bad.start(),
        )
    if name[0].isdigit():
        return 'node name must not start with a number', 0
    if len(name) > MAX_NODE_NAME_LENGTH:
        text = f"node name length should not exceed '{MAX_NODE_NAME_LENGTH}'"
        return text, MAX_NODE_NAME_LENGTH - 1
    return None


def namespace_violation(namespace: str) -> Violation | None:
    """Check a full namespace."""
    if namespace == '/':
        return None
    violation = _absolute_violation(namespace, 'namespace', ", unless only a '/'")
    if violation is None and len(namespace) > MAX_NAMESPACE_LENGTH:
        return f"namespace should not exceed '{MAX_NAMESPACE_LENGTH}'", MAX_NAMESPACE_LENGTH - 1
    return violation


def full_topic_violation(name: str) -> Violation | None:
    """Check a topic or service name after expansion."""
    violation = _absolute_violation(name, 'topic name', '')
    if violation is None and len(name) > MAX_TOPIC_LENGTH:
        return f"topic length should not exceed '{MAX_TOPIC_LENGTH}'", MAX_TOPIC_LENGTH - 1
    return violation


def _absolute_violation(name: str, what: str, slash_exception: str) -> Violation | None:
    if not name:
        return f'{what} must not be empty', 0
    if name[0] != '/':
        return f"{what} must be absolute, it must lead with a '/'", 0
    if name[-1] == '/':
        return f"{what} must not end with a '/'{slash_exception}", len(name) - 1
    bad = re.search(r'[^A-Za-z0-9_/]', name)
    if bad:
        text = f"{what} must not contain characters other than alphanumerics, '_', or '/'"
        return text, bad.start()
    bad = re.search(r'/[/0-9]', name)
    if bad is None:
        return None
    if bad[0] == '//':
        return f"{what} must not contain repeated '/'", bad.start() + 1
    return f'{what} must not have a token that starts with a number', bad.start() + 1


def topic_violation(name: str) -> Violation | None:
    """Check a topic or service name before expansion, with its '~' and substitutions."""
    if not name:
        return 'topic name must not be empty string', 0
    if re.match(r'[0-9]', name):
        return 'topic name token must not start with a number', 0
    if name[-1] == '/':
        return 'topic name must not end with a forward slash', len(name) - 1
    return _substitution_violation(name) or _token_violation(name)


def _substitution_violation(name: str) -> Violation | None:
    opened: int | None = None
    for index, character in enumerate(name):
        if re.match(r'[A-Za-z0-9_]', character):
            if character.isdigit() and opened is not None and index == opened + 1:
                return 'substitution name must not start with a number', index
        elif character == '}':
            if opened is None:
                return "topic name must not have unmatched (unbalanced) curly braces '{}'", index
            opened = None
        elif character == '~':
            if index:
                return (
                    "topic name must not have tilde '~' unless it is the first character",
                    index,
                )
        elif opened is not None:
            return (
                "substitution name must not contain characters other than alphanumerics or '_'",
                index,
            )
        elif character == '{':
            opened = index
        elif character != '/':
            return (
                'topic name must not contain characters other than alphanumerics, '
                "'_', '~', '{', or '}'",
                index,
            )
    if opened is not None:
        return "topic name must not have unmatched (unbalanced) curly braces '{}'", opened
    return None


def _token_violation(name: str) -> Violation | None:
    if name[0] == '~' and len(name) > 1 and name[1] != '/':
        return (
            "topic name must not have a tilde '~' that is not followed by a forward slash '/'",
            1,
        )
    bad = re.search(r'/[0-9]', name)
    if bad:
        return 'topic name token must not start with a number', bad.start() + 1
    return None
