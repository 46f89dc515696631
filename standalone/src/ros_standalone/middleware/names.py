"""ROS names and types as DDS names, and back.

ROS topic ``/chatter`` is the DDS topic ``rt/chatter``; service ``/add`` is the pair of topics
``rq/addRequest`` and ``rr/addReply``; type ``std_msgs/msg/String`` is
``std_msgs::msg::dds_::String_``.
"""

from __future__ import annotations

_REQUEST = ('rq/', 'Request')
_REPLY = ('rr/', 'Reply')


def topic_to_dds(topic: str, avoid_ros_namespace_conventions: bool = False) -> str:
    """The DDS topic of a fully qualified ROS topic."""
    return topic if avoid_ros_namespace_conventions else 'rt' + topic


def request_to_dds(service: str) -> str:
    """The DDS topic that carries the requests of a fully qualified service."""
    return f'rq{service}Request'


def reply_to_dds(service: str) -> str:
    """The DDS topic that carries the replies of a fully qualified service."""
    return f'rr{service}Reply'


def topic_from_dds(name: str) -> str | None:
    """The ROS topic of a DDS topic, None where it is none."""
    return name[2:] if name.startswith('rt/') else None


def service_from_request(name: str) -> str | None:
    """The ROS service of a DDS topic of requests, None where it is none."""
    return _between(name, *_REQUEST)


def service_from_reply(name: str) -> str | None:
    """The ROS service of a DDS topic of replies, None where it is none."""
    return _between(name, *_REPLY)


def type_to_dds(type_name: str, suffix: str = '') -> str:
    """The DDS type of a ROS type; suffix is '_Request' or '_Response' for the parts of services.

    Raises:
        ValueError: The name is not of the form 'package/msg/Name'.
    """
    parts = type_name.split('/')
    if len(parts) != 3 or not all(parts):
        raise ValueError(f"a type name must have the form 'package/msg/Name', got {type_name!r}")
    package, kind, name = parts
    return f'{package}::{kind}::dds_::{name}{suffix}_'


def type_from_dds(name: str) -> str:
    """The ROS type of a DDS type; a name that ROS did not make is returned as it is."""
    package, found, base = name.rpartition('::dds_::')
    if not found or not base.endswith('_'):
        return name
    return f'{package.replace("::", "/")}/{base[:-1]}'


def service_type_from_dds(name: str) -> str | None:
    """The ROS service type of the DDS type of its request or response, None where it is none."""
    ros_type = type_from_dds(name)
    if ros_type == name:
        return None
    for suffix in ('_Request', '_Response'):
        if ros_type.endswith(suffix):
            return ros_type[: -len(suffix)]
    return None


def _between(name: str, prefix: str, suffix: str) -> str | None:
    if name.startswith(prefix) and name.endswith(suffix) and len(name) > len(prefix + suffix):
        return name[len(prefix) - 1 : -len(suffix)]
    return None
