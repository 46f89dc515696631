"""What the modules ``<package>.msg`` and ``<package>.srv`` have in common."""

from __future__ import annotations

import sys
from typing import Any

from ros_standalone.interfaces.catalog import interface_names, service_part
from ros_standalone.interfaces.classes import load
from ros_standalone.interfaces.errors import InterfaceNotFoundError


def member(module: str, name: str) -> type[Any]:
    """The interface class of that name, for a module's ``__getattr__``.

    Args:
        module: ``<package>.msg`` or ``<package>.srv``.
        name: Such as ``String``, or ``Trigger_Request`` for a part of a service.

    Raises:
        AttributeError: The package has no such interface.
    """
    package, kind = module.split('.')
    known = service_part(name)[0] if kind == 'srv' else name
    if known not in interface_names(package, kind):
        raise AttributeError(f'module {module!r} has no attribute {name!r}')
    try:
        found = load(f'{package}/{kind}/{name}')
    except InterfaceNotFoundError as error:
        raise AttributeError(f'{module}.{name} cannot be loaded: {error}') from None
    setattr(sys.modules[module], name, found)
    return found


def members(module: str) -> list[str]:
    """Names of the interfaces in such a module, for its ``__all__`` and ``__dir__``."""
    package, kind = module.split('.')
    return list(interface_names(package, kind))
