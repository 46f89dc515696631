"""The parameters of one node: declaring, reading, setting, describing, and who is asked."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from rcl_interfaces.msg import (
    ListParametersResult,
    ParameterDescriptor,
    ParameterEvent,
    ParameterValue,
    SetParametersResult,
)
from rcl_interfaces.msg import Parameter as ParameterMsg
from rclpy._parameter_checks import refusal
from rclpy._parameter_declarations import read_declaration
from rclpy._parameter_listing import list_parameters
from rclpy.exceptions import (
    InvalidParameterTypeException,
    InvalidParameterValueException,
    ParameterAlreadyDeclaredException,
    ParameterImmutableException,
    ParameterNotDeclaredException,
    ParameterUninitializedException,
)
from rclpy.parameter import PARAMETER_SEPARATOR_STRING, Parameter
from rclpy.time import Time

PreSetCallback = Callable[[list[Parameter]], list[Parameter]]
OnSetCallback = Callable[[list[Parameter]], SetParametersResult]
PostSetCallback = Callable[[list[Parameter]], None]
CallbackT = TypeVar('CallbackT', bound=Callable[[list[Parameter]], Any])


class NodeParameters:
    """A node's parameters. The methods are those of rclpy.node.Node, which delegates to them.

    Args:
        node_name: The node's full name, put into parameter events.
        publish: Publishes a ParameterEvent.
        now: Gives the node's time, for the events' stamps.
        overrides: Values from the command line and the node's constructor, by parameter name.
        allow_undeclared: Whether undeclared parameters may be read and set.
    """

    def __init__(
        self,
        node_name: str,
        publish: Callable[[ParameterEvent], None],
        now: Callable[[], Time],
        *,
        overrides: Mapping[str, Parameter] | None = None,
        allow_undeclared: bool = False,
    ) -> None:
        self._node_name = node_name
        self._publish = publish
        self._now = now
        self._overrides = dict(overrides or {})
        self._allow_undeclared = allow_undeclared
        self._parameters: dict[str, Parameter] = {}
        self._descriptors: dict[str, ParameterDescriptor] = {}
        self._pre_set_callbacks: list[PreSetCallback] = []
        self._on_set_callbacks: list[OnSetCallback] = []
        self._post_set_callbacks: list[PostSetCallback] = []

    @property
    def overrides(self) -> dict[str, Parameter]:
        """Values given from outside, by parameter name."""
        return self._overrides

    # Declaring

    def declare_parameter(
        self,
        name: str,
        value: Any = None,
        descriptor: ParameterDescriptor | None = None,
        ignore_override: bool = False,
    ) -> Parameter:
        """Declare one parameter; see declare_parameters."""
        entry: tuple[Any, ...] = (name,)
        if value is not None or descriptor is not None:
            entry = (name, value, ParameterDescriptor() if descriptor is None else descriptor)
        return self.declare_parameters('', [entry], ignore_override)[0]

    def declare_parameters(
        self,
        namespace: str,
        parameters: Sequence[tuple[Any, ...]],
        ignore_override: bool = False,
    ) -> list[Parameter]:
        """Declare parameters, with the values that overrides give them or else their own.

        Args:
            namespace: Put before each name with a dot, unless empty.
            parameters: Each a name, optionally a value or Parameter.Type, optionally a
                descriptor.
            ignore_override: Whether overrides do not count.

        Raises:
            TypeError: If an entry is not of that form.
            ValueError: If a statically typed parameter gets neither value nor type.
            InvalidParameterException: If a name is empty.
            ParameterAlreadyDeclaredException: If a parameter is there already.
            InvalidParameterTypeException: If an override is of another type.
            InvalidParameterValueException: If a descriptor or a callback refuses a value.
        """
        wanted: list[Parameter] = []
        descriptors: dict[str, ParameterDescriptor] = {}
        for index, entry in enumerate(parameters):
            name, value, descriptor = read_declaration(namespace, entry, index)
            if not ignore_override and name in self._overrides:
                value = self._overrides[name].value
            wanted.append(Parameter(name, value=value))
            descriptors[name] = descriptor
        declared = [parameter.name for parameter in wanted if parameter.name in self._parameters]
        if declared:
            raise ParameterAlreadyDeclaredException(declared)
        for parameter in wanted:
            result = self._set_atomically([parameter], descriptors, keep_not_set=True)
            if not result.successful:
                if result.reason.startswith('Wrong parameter type'):
                    expected = Parameter.Type(descriptors[parameter.name].type).name
                    raise InvalidParameterTypeException(parameter, expected)
                raise InvalidParameterValueException(
                    parameter.name, parameter.value, result.reason
                )
        return [self._parameters[parameter.name] for parameter in wanted]

    def declare_overrides(self) -> None:
        """Declare every parameter that was given from outside."""
        entries = [
            (name, parameter.value, ParameterDescriptor())
            for name, parameter in self._overrides.items()
        ]
        self.declare_parameters('', entries, ignore_override=True)

    def undeclare_parameter(self, name: str) -> None:
        """Take a parameter away; it must be declared and not read-only."""
        if not self.has_parameter(name):
            raise ParameterNotDeclaredException(name)
        if self._descriptors[name].read_only:
            raise ParameterImmutableException(name)
        del self._parameters[name]
        del self._descriptors[name]

    def has_parameter(self, name: str) -> bool:
        """Whether a parameter is declared."""
        return name in self._parameters

    # Reading

    def get_parameter(self, name: str) -> Parameter:
        """A parameter by name.

        Raises:
            ParameterNotDeclaredException: If it is not declared, and must be.
            ParameterUninitializedException: If it is statically typed and has no value yet.
        """
        if self.has_parameter(name):
            parameter = self._parameters[name]
            if (
                parameter.type_ is Parameter.Type.NOT_SET
                and not self._descriptors[name].dynamic_typing
            ):
                raise ParameterUninitializedException(name)
            return parameter
        if self._allow_undeclared:
            return Parameter(name, Parameter.Type.NOT_SET, None)
        raise ParameterNotDeclaredException(name)

    def get_parameters(self, names: list[str]) -> list[Parameter]:
        """Parameters by name; see get_parameter."""
        _check_names(names)
        return [self.get_parameter(name) for name in names]

    def get_parameter_or(self, name: str, alternative_value: Parameter | None = None) -> Parameter:
        """A parameter, or the alternative (by default one that is NOT_SET) if it has no value."""
        parameter = self._parameters.get(name)
        if parameter is not None and parameter.type_ is not Parameter.Type.NOT_SET:
            return parameter
        if alternative_value is None:
            return Parameter(name, Parameter.Type.NOT_SET)
        return alternative_value

    def get_parameter_type(self, name: str) -> Any:
        """The number of a parameter's type; ParameterNotDeclaredException as get_parameter."""
        if self.has_parameter(name):
            return self._parameters[name].type_.value
        if self._allow_undeclared:
            return Parameter.Type.NOT_SET.value
        raise ParameterNotDeclaredException(name)

    def get_parameter_types(self, names: list[str]) -> list[Any]:
        """Types by name; see get_parameter_type."""
        _check_names(names)
        return [self.get_parameter_type(name) for name in names]

    def get_parameters_by_prefix(self, prefix: str) -> dict[str, Parameter]:
        """The parameters below a prefix, by name without it; '' gives all."""
        if prefix:
            prefix += PARAMETER_SEPARATOR_STRING
        return {
            name[len(prefix) :]: parameter
            for name, parameter in self._parameters.items()
            if name.startswith(prefix)
        }

    def list_parameters(self, prefixes: list[str], depth: int) -> ListParametersResult:
        """The names below prefixes, down to a depth; see rcl_interfaces/ListParameters."""
        return list_parameters(list(self._parameters), prefixes, depth)

    # Setting

    def set_parameters(self, parameter_list: list[Parameter]) -> list[SetParametersResult]:
        """Set parameters one after the other.

        Raises:
            ParameterNotDeclaredException: If one is not declared, and must be; those before it
                stay set.
        """
        return [self.set_parameters_atomically([parameter]) for parameter in parameter_list]

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """Set all parameters or, if one is refused, none.

        Raises:
            ParameterNotDeclaredException: If one is not declared, and must be.
        """
        if self._pre_set_callbacks:
            modified: list[Parameter] = []
            for callback in list(self._pre_set_callbacks):
                modified.extend(callback(parameter_list))
            parameter_list = modified
            if not parameter_list:
                return SetParametersResult(
                    successful=False,
                    reason='parameter list cannot be empty, this might be due to '
                    'pre_set_parameters_callback modifying the original parameters list.',
                )
        if not all(isinstance(parameter, Parameter) for parameter in parameter_list):
            raise TypeError(f"parameter must be instance of type '{Parameter!r}'")
        undeclared = [
            parameter.name
            for parameter in parameter_list
            if parameter.name not in self._parameters
        ]
        if undeclared and not self._allow_undeclared:
            # rclpy reports the names after the first one only.
            raise ParameterNotDeclaredException(undeclared[1:])
        return self._set_atomically(parameter_list)

    def _set_atomically(
        self,
        parameter_list: list[Parameter],
        descriptors: dict[str, ParameterDescriptor] | None = None,
        *,
        keep_not_set: bool = False,
    ) -> SetParametersResult:
        applied = self._descriptors if descriptors is None else descriptors
        for parameter in parameter_list:
            if parameter.name in applied:
                reason = self._refusal(parameter, applied[parameter.name], descriptors is None)
                if reason:
                    return SetParametersResult(successful=False, reason=reason)
        for callback in list(self._on_set_callbacks):
            result = callback(parameter_list)
            if not isinstance(result, SetParametersResult):
                reason = 'Callback returned an invalid type, it should return SetParameterResult.'
                warnings.warn(reason, stacklevel=4)
                return SetParametersResult(successful=False, reason=reason)
            if not result.successful:
                return result
        event = ParameterEvent(node=self._node_name)
        for parameter in parameter_list:
            if parameter.type_ is Parameter.Type.NOT_SET and not keep_not_set:
                event.deleted_parameters.append(parameter.to_parameter_msg())
                self._parameters.pop(parameter.name, None)
                self._descriptors.pop(parameter.name, None)
                continue
            if descriptors is not None:
                self._descriptors[parameter.name] = descriptors[parameter.name]
            elif parameter.name not in self._descriptors:
                self._descriptors[parameter.name] = ParameterDescriptor(dynamic_typing=True)
            is_new = self.get_parameter_or(parameter.name).type_ is Parameter.Type.NOT_SET
            changes = event.new_parameters if is_new else event.changed_parameters
            changes.append(parameter.to_parameter_msg())
            self._parameters[parameter.name] = parameter
        event.stamp = self._now().to_msg()
        self._publish(event)
        for post_set in list(self._post_set_callbacks):
            post_set(parameter_list)
        return SetParametersResult(successful=True)

    def _refusal(
        self, parameter: Parameter, descriptor: ParameterDescriptor, check_read_only: bool
    ) -> str:
        return refusal(
            parameter,
            descriptor,
            declared=self.has_parameter(parameter.name),
            check_read_only=check_read_only,
        )

    # Describing

    def describe_parameter(self, name: str) -> ParameterDescriptor:
        """A parameter's descriptor; ParameterNotDeclaredException as get_parameter."""
        if name in self._descriptors:
            return self._descriptors[name]
        if self._allow_undeclared:
            return ParameterDescriptor()
        raise ParameterNotDeclaredException(name)

    def describe_parameters(self, names: list[str]) -> list[ParameterDescriptor]:
        """Descriptors by name; see describe_parameter."""
        return [self.describe_parameter(name) for name in names]

    def set_descriptor(
        self,
        name: str,
        descriptor: ParameterDescriptor,
        alternative_value: ParameterValue | None = None,
    ) -> ParameterValue:
        """Give a parameter another descriptor.

        Args:
            name: The parameter.
            descriptor: The new descriptor.
            alternative_value: The value to take if the new descriptor refuses the present one.

        Returns:
            The parameter's value afterwards.

        Raises:
            ParameterNotDeclaredException: If the parameter is not declared, and must be.
            ParameterImmutableException: If it is read-only.
            InvalidParameterValueException: If the descriptor refuses both values.
        """
        if not self.has_parameter(name):
            return self.get_parameter(name).get_parameter_value()
        if self.describe_parameter(name).read_only:
            raise ParameterImmutableException(name)
        candidates = [self.get_parameter(name)]
        if alternative_value is not None:
            message = ParameterMsg(name=name, value=alternative_value)
            candidates.append(Parameter.from_parameter_msg(message))
        for candidate in candidates:
            reason = self._refusal(candidate, descriptor, False)
            if not reason:
                self._parameters[name] = candidate
                self._descriptors[name] = descriptor
                return self.get_parameter(name).get_parameter_value()
        raise InvalidParameterValueException(name, candidates[-1].value, reason)

    # Callbacks; the one that was added last is called first.

    def add_pre_set_parameters_callback(self, callback: PreSetCallback) -> None:
        """Add a callback that may change a list of parameters before it is checked."""
        self._pre_set_callbacks.insert(0, _callable(callback))

    def add_on_set_parameters_callback(self, callback: OnSetCallback) -> None:
        """Add a callback that accepts or refuses a list of parameters."""
        self._on_set_callbacks.insert(0, _callable(callback))

    def add_post_set_parameters_callback(self, callback: PostSetCallback) -> None:
        """Add a callback that learns of parameters that have been set."""
        self._post_set_callbacks.insert(0, _callable(callback))

    def remove_pre_set_parameters_callback(self, callback: PreSetCallback) -> None:
        """Remove a callback; ValueError if it is not there."""
        self._pre_set_callbacks.remove(callback)

    def remove_on_set_parameters_callback(self, callback: OnSetCallback) -> None:
        """Remove a callback; ValueError if it is not there."""
        self._on_set_callbacks.remove(callback)

    def remove_post_set_parameters_callback(self, callback: PostSetCallback) -> None:
        """Remove a callback; ValueError if it is not there."""
        self._post_set_callbacks.remove(callback)


def _callable(callback: CallbackT) -> CallbackT:
    if not callable(callback):
        raise TypeError(f'Callback must be callable, got {type(callback)}')
    return callback


def _check_names(names: list[str]) -> None:
    if not all(isinstance(name, str) for name in names):
        raise TypeError('All names must be instances of type str')
