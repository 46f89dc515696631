"""Interface definitions, message classes, their CDR encoding and their type hashes.

The interface files (``.msg``, ``.srv``) are the only source: everything else is made from them on
first use.
"""

from __future__ import annotations

from typing import Any

from ros_standalone.interfaces.catalog import definition_text, interface_names, package_names
from ros_standalone.interfaces.cdr import deserialize, serialize
from ros_standalone.interfaces.classes import Message, Service, load
from ros_standalone.interfaces.errors import (
    InterfaceFormatError,
    InterfaceNotFoundError,
    SerializationError,
)

__all__ = [
    'InterfaceFormatError',
    'InterfaceNotFoundError',
    'Message',
    'SerializationError',
    'Service',
    'definition_text',
    'deserialize',
    'interface_names',
    'load',
    'package_names',
    'serialize',
    'type_description',
    'type_hash',
    'type_name',
]


def type_name(interface_class: type[Any]) -> str:
    """The name of a message or service class, such as ``std_msgs/msg/String``.

    Raises:
        TypeError: It is neither.
    """
    is_interface = isinstance(interface_class, type) and issubclass(
        interface_class, (Message, Service)
    )
    if not is_interface:
        raise TypeError(f'expected a message or service class, got {interface_class!r}')
    name: str = interface_class._definition.type_name
    return name


def type_hash(interface_class: type[Any]) -> str:
    """The type hash of a message or service class, such as ``RIHS01_df66...``.

    Raises:
        TypeError: It is neither.
    """
    from ros_standalone.interfaces.type_hashes import hash_of

    return hash_of(type_name(interface_class))


def type_description(interface_class: type[Any]) -> dict[str, Any]:
    """The fields of ``type_description_interfaces/msg/TypeDescription`` for a class, nested.

    Raises:
        TypeError: It is neither a message nor a service class.
    """
    from ros_standalone.interfaces.type_hashes import description_of

    return description_of(type_name(interface_class))
