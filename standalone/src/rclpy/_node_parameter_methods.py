"""The part of a node that declares, reads and sets parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rcl_interfaces.msg import (
    ListParametersResult,
    ParameterDescriptor,
    ParameterValue,
    SetParametersResult,
)
from rclpy._node_parameters import (
    NodeParameters,
    OnSetCallback,
    PostSetCallback,
    PreSetCallback,
)
from rclpy.parameter import Parameter


class ParameterMethods:
    """What `rclpy.node.Node` delegates to its NodeParameters, which documents it in full."""

    _parameters: NodeParameters

    def declare_parameter(
        self,
        name: str,
        value: Any = None,
        descriptor: ParameterDescriptor | None = None,
        ignore_override: bool = False,
    ) -> Parameter:
        """Declare one parameter; see declare_parameters."""
        return self._parameters.declare_parameter(name, value, descriptor, ignore_override)

    def declare_parameters(
        self, namespace: str, parameters: Sequence[tuple[Any, ...]], ignore_override: bool = False
    ) -> list[Parameter]:
        """Declare parameters, with the values that overrides give them or else their own."""
        return self._parameters.declare_parameters(namespace, parameters, ignore_override)

    def undeclare_parameter(self, name: str) -> None:
        """Take a parameter away; it must be declared and not read-only."""
        self._parameters.undeclare_parameter(name)

    def has_parameter(self, name: str) -> bool:
        """Whether a parameter is declared."""
        return self._parameters.has_parameter(name)

    def get_parameter(self, name: str) -> Parameter:
        """Return a parameter by name."""
        return self._parameters.get_parameter(name)

    def get_parameters(self, names: list[str]) -> list[Parameter]:
        """Parameters by name; see get_parameter."""
        return self._parameters.get_parameters(names)

    def get_parameter_or(self, name: str, alternative_value: Parameter | None = None) -> Parameter:
        """A parameter, or the alternative (by default one that is NOT_SET) if it has no value."""
        return self._parameters.get_parameter_or(name, alternative_value)

    def get_parameter_type(self, name: str) -> Any:
        """The number of a parameter's type; ParameterNotDeclaredException as get_parameter."""
        return self._parameters.get_parameter_type(name)

    def get_parameter_types(self, names: list[str]) -> list[Any]:
        """Types by name; see get_parameter_type."""
        return self._parameters.get_parameter_types(names)

    def get_parameters_by_prefix(self, prefix: str) -> dict[str, Parameter]:
        """The parameters below a prefix, by name without it; '' gives all."""
        return self._parameters.get_parameters_by_prefix(prefix)

    def set_parameters(self, parameter_list: list[Parameter]) -> list[SetParametersResult]:
        """Set parameters one after the other."""
        return self._parameters.set_parameters(parameter_list)

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """Set all parameters or, if one is refused, none."""
        return self._parameters.set_parameters_atomically(parameter_list)

    def list_parameters(self, prefixes: list[str], depth: int) -> ListParametersResult:
        """The names below prefixes, down to a depth; see rcl_interfaces/ListParameters."""
        return self._parameters.list_parameters(prefixes, depth)

    def describe_parameter(self, name: str) -> ParameterDescriptor:
        """A parameter's descriptor; ParameterNotDeclaredException as get_parameter."""
        return self._parameters.describe_parameter(name)

    def describe_parameters(self, names: list[str]) -> list[ParameterDescriptor]:
        """Descriptors by name; see describe_parameter."""
        return self._parameters.describe_parameters(names)

    def set_descriptor(
        self,
        name: str,
        descriptor: ParameterDescriptor,
        alternative_value: ParameterValue | None = None,
    ) -> ParameterValue:
        """Give a parameter another descriptor."""
        return self._parameters.set_descriptor(name, descriptor, alternative_value)

    def add_pre_set_parameters_callback(self, callback: PreSetCallback) -> None:
        """Add a callback that may change a list of parameters before it is checked."""
        self._parameters.add_pre_set_parameters_callback(callback)

    def add_on_set_parameters_callback(self, callback: OnSetCallback) -> None:
        """Add a callback that accepts or refuses a list of parameters."""
        self._parameters.add_on_set_parameters_callback(callback)

    def add_post_set_parameters_callback(self, callback: PostSetCallback) -> None:
        """Add a callback that learns of parameters that have been set."""
        self._parameters.add_post_set_parameters_callback(callback)

    def remove_pre_set_parameters_callback(self, callback: PreSetCallback) -> None:
        """Remove a callback; ValueError if it is not there."""
        self._parameters.remove_pre_set_parameters_callback(callback)

    def remove_on_set_parameters_callback(self, callback: OnSetCallback) -> None:
        """Remove a callback; ValueError if it is not there."""
        self._parameters.remove_on_set_parameters_callback(callback)

    def remove_post_set_parameters_callback(self, callback: PostSetCallback) -> None:
        """Remove a callback; ValueError if it is not there."""
        self._parameters.remove_post_set_parameters_callback(callback)
