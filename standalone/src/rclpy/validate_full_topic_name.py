"""Checking the name of a topic or service after expansion."""

from rclpy._name_rules import full_topic_violation
from rclpy.exceptions import InvalidServiceNameException, InvalidTopicNameException


def validate_full_topic_name(name: str, *, is_service: bool = False) -> bool:
    """Return True for a good full name.

    Raises:
        InvalidTopicNameException: For a bad one.
        InvalidServiceNameException: For a bad one, with is_service.
    """
    violation = full_topic_violation(name)
    if violation is None:
        return True
    if is_service:
        raise InvalidServiceNameException(name, *violation)
    raise InvalidTopicNameException(name, *violation)
