"""Clear errors for the parts of rclpy that this runtime does not have."""

from __future__ import annotations

import importlib.abc
import sys
from collections.abc import Callable, Sequence
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

COVERED = (
    'nodes, topics, services, timers, parameters, executors, callback groups, QoS, time, '
    'logging, graph queries and serialization'
)


def module_getattr(module: str) -> Callable[[str], Any]:
    """Make a module's `__getattr__`, for names that the module does not have.

    Args:
        module: The module's name.
    """

    def missing(name: str) -> Any:
        raise AttributeError(
            f'{module}.{name} is not part of the standalone rclpy, which covers {COVERED}'
        )

    return missing


class _MissingModules(importlib.abc.MetaPathFinder):
    """Explains, as the last finder, why a module of rclpy cannot be imported."""

    def find_spec(
        self,
        fullname: str,
        path: Sequence[str] | None,
        target: ModuleType | None = None,
    ) -> ModuleSpec | None:
        if fullname.startswith('rclpy.'):
            raise ModuleNotFoundError(
                f'{fullname} is not part of the standalone rclpy, which covers {COVERED}',
                name=fullname,
            )
        return None


def explain_missing_modules() -> None:
    """Let `import rclpy.action` and its like say what they miss."""
    if not any(isinstance(finder, _MissingModules) for finder in sys.meta_path):
        sys.meta_path.append(_MissingModules())
