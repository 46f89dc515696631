"""Checking the name of a parameter."""

from rclpy.exceptions import InvalidParameterException


def validate_parameter_name(name: str) -> bool:
    """Return True for any name but an empty one, which raises InvalidParameterException."""
    if not name:
        raise InvalidParameterException(name)
    return True
