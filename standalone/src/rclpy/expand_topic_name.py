"""From a topic name as it is written to the full name."""

import re

from rclpy._name_rules import namespace_violation, node_name_violation, topic_violation


def expand_topic_name(topic_name: str, node_name: str, node_namespace: str) -> str:
    """Replace `~`, `{node}`, `{ns}` and `{namespace}`, and make the name absolute.

    Args:
        topic_name: The name as it is written.
        node_name: The node's base name.
        node_namespace: The node's full namespace.

    Raises:
        ValueError: If one of the three is invalid, or a substitution is unknown.
    """
    for what, violation in (
        ('topic name', topic_violation(topic_name)),
        ('node name', node_name_violation(node_name)),
        ('node namespace', namespace_violation(node_namespace)),
    ):
        if violation is not None:
            raise ValueError(f'{what} is invalid: {violation[0]}')
    base = '' if node_namespace == '/' else node_namespace
    name = topic_name
    if name.startswith('~'):
        name = f'{base}/{node_name}{name[1:]}'
    known = {'node': node_name, 'ns': node_namespace, 'namespace': node_namespace}

    def replacement(match: re.Match[str]) -> str:
        if match[1] not in known:
            raise ValueError(f'topic name is invalid: unknown substitution: {match[0]}')
        return known[match[1]]

    name = re.sub(r'\{([^}]*)\}', replacement, name)
    return name if name.startswith('/') else f'{base}/{name}'
