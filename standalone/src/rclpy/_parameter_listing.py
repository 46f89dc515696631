"""Which parameter names a ListParameters request asks for."""

from __future__ import annotations

from rcl_interfaces.msg import ListParametersResult
from rcl_interfaces.srv import ListParameters
from rclpy.parameter import PARAMETER_SEPARATOR_STRING


def list_parameters(names: list[str], prefixes: list[str], depth: int) -> ListParametersResult:
    """Select names and their prefixes.

    Args:
        names: All full names.
        prefixes: Names or beginnings of names that are wanted, all when empty.
        depth: How many parts a name may have beyond the prefix; 0 is without limit.

    Raises:
        TypeError: If prefixes is not a list of str, or depth not an int.
        ValueError: If depth is negative.
    """
    if not isinstance(prefixes, list):
        raise TypeError('The prefixes argument must be a list')
    if not all(isinstance(prefix, str) for prefix in prefixes):
        raise TypeError('All prefixes must be instances of type str')
    if not isinstance(depth, int):
        raise TypeError('The depth must be instance of type int')
    if depth < 0:
        raise ValueError('The depth must be greater than or equal to zero')

    def shallow(name: str) -> bool:
        unlimited = depth == ListParameters.Request.DEPTH_RECURSIVE
        return unlimited or name.count(PARAMETER_SEPARATOR_STRING) < depth

    def below(name: str, prefix: str) -> bool:
        start = prefix + PARAMETER_SEPARATOR_STRING
        return name == prefix or (name.startswith(start) and shallow(name[len(start) :]))

    result = ListParametersResult()
    for name in names:
        if any(below(name, prefix) for prefix in prefixes) or (not prefixes and shallow(name)):
            result.names.append(name)
            prefix = name.rpartition(PARAMETER_SEPARATOR_STRING)[0]
            if prefix and prefix not in result.prefixes:
                result.prefixes.append(prefix)
    return result
