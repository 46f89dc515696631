"""Checking the name of a node."""

from rclpy._name_rules import node_name_violation
from rclpy.exceptions import InvalidNodeNameException


def validate_node_name(node_name: str) -> bool:
    """Return True for a good name; raise InvalidNodeNameException for another."""
    violation = node_name_violation(node_name)
    if violation is not None:
        raise InvalidNodeNameException(node_name, *violation)
    return True
