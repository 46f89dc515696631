"""The interface files that are installed, and their parse trees by name."""

from __future__ import annotations

import os
from functools import cache

from ros_standalone.interfaces.definitions import (
    MessageDefinition,
    ServiceDefinition,
    parse_message,
    parse_service,
)
from ros_standalone.interfaces.errors import InterfaceNotFoundError

DEFINITIONS_PATH = os.path.join(
    os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))),
    'interface_definitions',
)
"""Folder with one folder for each interface package."""

_SERVICE_PARTS = ('_Request', '_Response', '_Event')


@cache
def package_names() -> tuple[str, ...]:
    """Names of the interface packages, sorted."""
    return tuple(
        sorted(entry.name for entry in os.scandir(DEFINITIONS_PATH) if _is_package(entry.path))
    )


@cache
def interface_names(package: str, kind: str) -> tuple[str, ...]:
    """Names of the interfaces of a package, sorted.

    Args:
        package: Such as ``std_msgs``.
        kind: ``msg`` or ``srv``.

    Raises:
        InterfaceNotFoundError: There is no such package.
    """
    if package not in package_names():
        raise InterfaceNotFoundError(
            f'no interface package {package!r}; there are {", ".join(package_names())}'
        )
    folder = os.path.join(DEFINITIONS_PATH, package, kind)
    if not os.path.isdir(folder):
        return ()
    suffix = f'.{kind}'
    names = (name for name in os.listdir(folder) if name.endswith(suffix))
    return tuple(sorted(name.removesuffix(suffix) for name in names))


@cache
def definition_text(type_name: str) -> str:
    """The file that defines a message or service, word for word.

    Args:
        type_name: Such as ``std_msgs/msg/String`` or ``std_srvs/srv/Trigger``; a request, response
            or event is defined by its service's file.

    Raises:
        InterfaceNotFoundError: There is no such interface.
    """
    package, kind, name = split_type_name(type_name)
    if kind == 'srv':
        name = service_part(name)[0]
    if name not in interface_names(package, kind):
        raise InterfaceNotFoundError(
            f'no interface {type_name!r}; {package}/{kind} has '
            f'{", ".join(interface_names(package, kind)) or "none"}'
        )
    path = os.path.join(DEFINITIONS_PATH, package, kind, f'{name}.{kind}')
    with open(path, encoding='utf-8') as file:
        return file.read()


@cache
def definition(type_name: str) -> MessageDefinition | ServiceDefinition:
    """The parse tree of a message, a service, or a request, response or event.

    Raises:
        InterfaceNotFoundError: There is no such interface.
        InterfaceFormatError: Its file cannot be read.
    """
    package, kind, name = split_type_name(type_name)
    text = definition_text(type_name)
    if kind == 'msg':
        return parse_message(type_name, text)
    service_name, part = service_part(name)
    if not part:
        return parse_service(type_name, text)
    service = definition(f'{package}/srv/{service_name}')
    assert isinstance(service, ServiceDefinition)
    return {'_Request': service.request, '_Response': service.response, '_Event': service.event}[
        part
    ]


def split_type_name(type_name: str) -> tuple[str, str, str]:
    """Split ``std_msgs/msg/String`` into package, kind and name.

    Raises:
        InterfaceNotFoundError: The name is not of that form.
    """
    parts = type_name.split('/')
    if len(parts) != 3 or parts[1] not in ('msg', 'srv'):
        raise InterfaceNotFoundError(
            f"expected 'package/msg/Name' or 'package/srv/Name', got {type_name!r}"
        )
    return parts[0], parts[1], parts[2]


def service_part(name: str) -> tuple[str, str]:
    """Split ``Trigger_Request`` into ``Trigger`` and ``_Request``; the second may be empty."""
    for part in _SERVICE_PARTS:
        if name.endswith(part):
            return name.removesuffix(part), part
    return name, ''


def _is_package(path: str) -> bool:
    return any(os.path.isdir(os.path.join(path, kind)) for kind in ('msg', 'srv'))
