"""The service by which others learn the message types that a node uses."""

from __future__ import annotations

import weakref
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_services_default
from rclpy.type_hash import TypeHash
from ros_standalone.interfaces import definition_text, type_description, type_hash
from type_description_interfaces.msg import (
    Field,
    FieldType,
    IndividualTypeDescription,
    TypeDescription,
    TypeSource,
)
from type_description_interfaces.srv import GetTypeDescription

if TYPE_CHECKING:
    from rclpy.node import Node

START_TYPE_DESCRIPTION_SERVICE_PARAM = 'start_type_description_service'
_IMPLICIT_PARTS = ('_Request', '_Response', '_Event')


class TypeDescriptionService:
    """Offers `<node>/get_type_description`, unless a parameter says not to.

    Args:
        node: The node; held weakly, its service holds this object.
    """

    def __init__(self, node: Node) -> None:
        self._node_reference = weakref.ref(node)
        if not node.has_parameter(START_TYPE_DESCRIPTION_SERVICE_PARAM):
            node.declare_parameter(
                START_TYPE_DESCRIPTION_SERVICE_PARAM,
                True,
                ParameterDescriptor(
                    description='If enabled, start the ~/get_type_description service.',
                    read_only=True,
                ),
            )
        parameter = node.get_parameter(START_TYPE_DESCRIPTION_SERVICE_PARAM)
        if parameter.type_ is not Parameter.Type.BOOL:
            node.get_logger().error(
                f"Invalid type for parameter '{START_TYPE_DESCRIPTION_SERVICE_PARAM}' "
                f'{parameter.type_!r} should be bool'
            )
        self.enabled = parameter.value is True
        if self.enabled:
            node.create_service(
                GetTypeDescription,
                f'{node.get_name()}/get_type_description',
                self._answer,
                qos_profile=qos_profile_services_default,
            )

    def _answer(
        self, request: GetTypeDescription.Request, response: GetTypeDescription.Response
    ) -> GetTypeDescription.Response:
        if TypeHash.from_text(request.type_hash) == TypeHash():
            response.failure_reason = 'Failed to parse type hash'
            return response
        for interface in self._used_types():
            if type_hash(interface) == request.type_hash:
                description = describe(interface)
                response.type_description = description
                if request.include_type_sources:
                    response.type_sources = _sources(description)
                response.successful = True
                return response
        response.failure_reason = 'Type not currently in use by this node'
        return response

    def _used_types(self) -> Iterator[type[Any]]:
        node = self._node_reference()
        if node is None:
            raise ReferenceError('Expected valid node weak reference')
        yield from (publisher.msg_type for publisher in node.publishers)
        yield from (subscription.msg_type for subscription in node.subscriptions)
        yield from (service.srv_type for service in node.services)
        yield from (client.srv_type for client in node.clients)


def describe(interface: type[Any]) -> TypeDescription:
    """A message or service class as type_description_interfaces/TypeDescription."""
    description = type_description(interface)
    return TypeDescription(
        type_description=_individual(description['type_description']),
        referenced_type_descriptions=[
            _individual(referenced) for referenced in description['referenced_type_descriptions']
        ],
    )


def _individual(description: dict[str, Any]) -> IndividualTypeDescription:
    return IndividualTypeDescription(
        type_name=description['type_name'],
        fields=[
            Field(
                name=field['name'],
                type=FieldType(**field['type']),
                default_value=field['default_value'],
            )
            for field in description['fields']
        ],
    )


def _sources(description: TypeDescription) -> list[TypeSource]:
    names = [
        individual.type_name
        for individual in (
            description.type_description,
            *description.referenced_type_descriptions,
        )
    ]
    return [_source(name) for name in names]


def _source(type_name: str) -> TypeSource:
    if type_name.endswith(_IMPLICIT_PARTS):
        return TypeSource(type_name=type_name, encoding='implicit')
    return TypeSource(
        type_name=type_name,
        encoding=type_name.split('/')[1],
        raw_file_contents=definition_text(type_name),
    )
