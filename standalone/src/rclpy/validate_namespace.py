"""Checking a namespace."""

from rclpy._name_rules import namespace_violation
from rclpy.exceptions import InvalidNamespaceException


def validate_namespace(namespace: str) -> bool:
    """Return True for a good full namespace; raise InvalidNamespaceException for another."""
    violation = namespace_violation(namespace)
    if violation is not None:
        raise InvalidNamespaceException(namespace, *violation)
    return True
