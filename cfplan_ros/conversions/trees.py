"""Trees of contact formations as messages, and back."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from cfplan_msgs.msg import ContactFormationNode

from cfplan_core.errors import Finding, InvalidPlanError
from cfplan_core.trajectory.plan_result import TreeNode
from cfplan_ros.conversions.contacts import contact_names, formation_message
from cfplan_ros.conversions.stabilities import NAMES, NUMBERS


def tree_message(tree: Iterable[TreeNode]) -> list[ContactFormationNode]:
    """Return the nodes of a tree as messages, in their order."""
    return [
        ContactFormationNode(
            parent=int(ContactFormationNode.ROOT) if node.parent is None else node.parent,
            contact_formation=formation_message(node.contacts),
            stability=NUMBERS[node.stability],
            dimension=node.dimension,
            on_path=node.on_path,
            shared=node.shared,
        )
        for node in tree
    ]


def tree_nodes(messages: Sequence[ContactFormationNode], field: str) -> tuple[TreeNode, ...]:
    """Return a tree.

    Args:
        messages: Its nodes, parents before their children.
        field: Where they are, for the error.

    Raises:
        InvalidPlanError: A node has an unknown stability or a parent that is not before it.
    """
    root = int(ContactFormationNode.ROOT)
    found = [
        Finding(
            'response',
            f'{field}[{k}]',
            f'parent {node.parent}, stability {node.stability}',
            f'{root} or a parent before the node, and a stability of PlanSegment or 0',
        )
        for k, node in enumerate(messages)
        if not root <= node.parent < k or node.stability not in NAMES
    ]
    if found:
        raise InvalidPlanError('\n'.join(str(finding) for finding in found))
    return tuple(
        TreeNode(
            parent=None if node.parent == root else int(node.parent),
            contacts=contact_names(node.contact_formation),
            stability=NAMES[node.stability],
            dimension=int(node.dimension),
            on_path=bool(node.on_path),
            shared=bool(node.shared),
        )
        for node in messages
    )
