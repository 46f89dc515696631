"""The errors that code for ROS imports from rclpy's compiled module."""

from rclpy.exceptions import (
    InvalidHandle,
    NodeNameNonExistentError,
    NotImplementedError,
    RCLError,
    RCLInvalidROSArgsError,
    UnknownROSArgsError,
    UnsupportedEventTypeError,
)

__all__ = [
    'InvalidHandle',
    'NodeNameNonExistentError',
    'NotImplementedError',
    'RCLError',
    'RCLInvalidROSArgsError',
    'UnknownROSArgsError',
    'UnsupportedEventTypeError',
]
