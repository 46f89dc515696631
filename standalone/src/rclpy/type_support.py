"""Checks that a class is a message or a service."""

from __future__ import annotations

from typing import Any

from ros_standalone import interfaces


def check_is_valid_msg_type(msg_type: Any) -> str:
    """Return the name of a message class, as 'std_msgs/msg/String'.

    Raises:
        RuntimeError: if it is not a message class.
    """
    name = _name(msg_type)
    if name is None or '/msg/' not in name:
        raise RuntimeError(
            f'The message type provided is not valid ({msg_type}), '
            'this might be a service or action'
        )
    return name


def check_is_valid_srv_type(srv_type: Any) -> str:
    """Return the name of a service class, as 'std_srvs/srv/Trigger'.

    Raises:
        RuntimeError: if it is not a service class.
    """
    name = _name(srv_type)
    if name is None or '/srv/' not in name or not hasattr(srv_type, 'Request'):
        raise RuntimeError(
            f'The service type provided is not valid ({srv_type}), '
            'this might be a message or action'
        )
    return name


def _name(interface: Any) -> str | None:
    try:
        return interfaces.type_name(interface)
    except (AttributeError, TypeError, ValueError):
        return None
