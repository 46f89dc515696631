"""Checking the name of a topic or service as it is written, before expansion."""

from rclpy._name_rules import topic_violation
from rclpy.exceptions import InvalidServiceNameException, InvalidTopicNameException

TOPIC_SEPARATOR_STRING = '/'


def validate_topic_name(name: str, *, is_service: bool = False) -> bool:
    """Return True for a good name.

    Raises:
        InvalidTopicNameException: For a bad one.
        InvalidServiceNameException: For a bad one, with is_service.
    """
    violation = topic_violation(name)
    if violation is None:
        return True
    if is_service:
        raise InvalidServiceNameException(name, *violation)
    raise InvalidTopicNameException(name, *violation)
