"""The errors that rclpy raises, with its texts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rclpy.parameter import Parameter


class NotInitializedException(Exception):
    """A context was used before init or after shutdown."""

    def __init__(self, *args: object) -> None:
        super().__init__('rclpy.init() has not been called', *args)


class NoTypeSupportImportedException(Exception):
    """A class was given where a message or service class was expected."""

    def __init__(self, *args: object) -> None:
        super().__init__('no type_support imported', *args)


class InvalidHandle(RuntimeError):
    """Something was used after it had been destroyed."""


class InvalidTypeSupport(TypeError):
    """A class was given that is not a ROS interface."""


class RCLError(RuntimeError):
    """An error that ROS's C library would report."""


class RCLInvalidROSArgsError(RCLError):
    """A ROS argument (after --ros-args) is malformed."""


class UnknownROSArgsError(RuntimeError):
    """There are arguments after --ros-args that ROS does not know."""

    def __init__(self, arguments: list[str]) -> None:
        super().__init__(f'Found unknown ROS arguments: {arguments!r}')


class NodeNameNonExistentError(RCLError):
    """A graph query names a node that is not there."""


class UnsupportedEventTypeError(RCLError):
    """The middleware does not offer the event that was asked for."""


class NotImplementedError(RCLError):
    """Asked for something that ROS's C library knows and this runtime does not cover."""


class NameValidationException(Exception):
    """A name breaks ROS's rules; the message points at the character.

    Args:
        name_type: What the name is of ('topic name', 'namespace', ...).
        name: The name.
        error_msg: The rule that it breaks.
        invalid_index: Where it breaks it.
    """

    def __init__(
        self, name_type: str, name: str, error_msg: str, invalid_index: int, *args: object
    ) -> None:
        text = f"Invalid {name_type}: {error_msg}:\n  '{name}'\n   {' ' * invalid_index}^"
        super().__init__(text, *args)


class InvalidNamespaceException(NameValidationException):
    """A namespace breaks the rules."""

    def __init__(self, name: str, error_msg: str, invalid_index: int, *args: object) -> None:
        super().__init__('namespace', name, error_msg, invalid_index, *args)


class InvalidNodeNameException(NameValidationException):
    """A node name breaks the rules."""

    def __init__(self, name: str, error_msg: str, invalid_index: int, *args: object) -> None:
        super().__init__('node name', name, error_msg, invalid_index, *args)


class InvalidTopicNameException(NameValidationException):
    """A topic name breaks the rules."""

    def __init__(self, name: str, error_msg: str, invalid_index: int, *args: object) -> None:
        super().__init__('topic name', name, error_msg, invalid_index, *args)


class InvalidServiceNameException(NameValidationException):
    """A service name breaks the rules."""

    def __init__(self, name: str, error_msg: str, invalid_index: int, *args: object) -> None:
        super().__init__('service name', name, error_msg, invalid_index, *args)


class ParameterException(Exception):
    """What all errors about parameters are.

    Args:
        error_msg: What is wrong.
        parameters: The name or names that it is about.
    """

    def __init__(self, error_msg: str, parameters: str | list[str], *args: object) -> None:
        super().__init__(f'{error_msg}: {parameters}', *args)


class ParameterNotDeclaredException(ParameterException):
    """A parameter was used that is not declared."""

    def __init__(self, parameters: str | list[str], *args: object) -> None:
        super().__init__('Invalid access to undeclared parameter(s)', parameters, *args)


class ParameterAlreadyDeclaredException(ParameterException):
    """A parameter was declared a second time."""

    def __init__(self, parameters: str | list[str], *args: object) -> None:
        super().__init__('Parameter(s) already declared', parameters, *args)


class InvalidParameterException(ParameterException):
    """The name of a parameter to be declared is empty."""

    def __init__(self, parameter_name: str, *args: object) -> None:
        super().__init__('Invalid parameter name', parameter_name, *args)


class InvalidParameterTypeException(ParameterException):
    """A declared parameter's value is not of the parameter's type."""

    def __init__(self, desired_parameter: Parameter, expected_type: str, *args: object) -> None:
        super().__init__(
            f"Trying to set parameter '{desired_parameter.name}' to "
            f"'{desired_parameter.value}' of type '{desired_parameter.type_.name}', "
            f"expecting type '{expected_type}'",
            desired_parameter.name,
            *args,
        )


class InvalidParameterValueException(ParameterException):
    """A declared parameter's value is refused by its descriptor or by a callback."""

    def __init__(self, parameter: str, value: Any, reason: str, *args: object) -> None:
        super().__init__(
            f'Invalid parameter value ({value}) for parameter. Reason: {reason}', parameter, *args
        )


class ParameterImmutableException(ParameterException):
    """A read-only parameter was to be changed."""

    def __init__(self, parameter_name: str, *args: object) -> None:
        super().__init__('Attempted to modify read-only parameter', parameter_name, *args)


class ParameterUninitializedException(ParameterException):
    """A parameter that has a type and no value yet was read."""

    def __init__(self, parameter_name: str, *args: object) -> None:
        super().__init__(
            f"The parameter '{parameter_name}' is not initialized", parameter_name, *args
        )


class ROSInterruptException(Exception):
    """An operation was ended by rclpy's shutdown."""

    def __init__(self, *args: object) -> None:
        super().__init__('rclpy.shutdown() has been called', *args)
