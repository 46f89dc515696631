"""What a node can ask about the graph: nodes, topics, services and their endpoints."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from rclpy.exceptions import NodeNameNonExistentError
from rclpy.topic_endpoint_info import TopicEndpointInfo, TopicEndpointTypeEnum
from rclpy.type_hash import TypeHash
from rclpy.validate_node_name import validate_node_name
from ros_standalone.middleware.graph import EndpointRecord, NamesAndTypes, UnknownNodeError

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy._remapping import Names
    from rclpy.context import Context
    from ros_standalone.middleware import Graph

_POLL_SEC = 0.05


class GraphQueries:
    """The part of `rclpy.node.Node` that looks at the graph."""

    _names: Names
    _context: Context

    @property
    def _graph(self) -> Graph:
        return self._context.participant.graph

    def get_node_names(self) -> list[str]:
        """Return the names of all nodes, without namespaces."""
        return [name for name, _ in self.get_node_names_and_namespaces()]

    def get_fully_qualified_node_names(self) -> list[str]:
        """Return the names of all nodes, with namespaces."""
        return [
            f'{namespace.rstrip("/")}/{name}'
            for name, namespace in self.get_node_names_and_namespaces()
        ]

    def get_node_names_and_namespaces(self) -> list[tuple[str, str]]:
        """Return (name, namespace) of all nodes."""
        return self._graph.node_names_and_namespaces()

    def get_node_names_and_namespaces_with_enclaves(self) -> list[tuple[str, str, str]]:
        """Return (name, namespace, enclave) of all nodes."""
        return self._graph.node_names_namespaces_and_enclaves()

    def get_topic_names_and_types(self, no_demangle: bool = False) -> NamesAndTypes:
        """Return (topic, [types]) of all topics; with `no_demangle` DDS's own names."""
        return self._graph.topic_names_and_types(no_demangle)

    def get_service_names_and_types(self) -> NamesAndTypes:
        """Return (service, [types]) of all services."""
        return self._graph.service_names_and_types()

    def get_publisher_names_and_types_by_node(
        self, node_name: str, node_namespace: str, no_demangle: bool = False
    ) -> NamesAndTypes:
        """Return (topic, [types]) of what a node publishes."""
        return _of_node(
            lambda: self._graph.publishers_by_node(node_name, node_namespace, no_demangle),
            'publisher names and types',
        )

    def get_subscriber_names_and_types_by_node(
        self, node_name: str, node_namespace: str, no_demangle: bool = False
    ) -> NamesAndTypes:
        """Return (topic, [types]) of what a node subscribes to."""
        return _of_node(
            lambda: self._graph.subscribers_by_node(node_name, node_namespace, no_demangle),
            'subscriber names and types',
        )

    def get_service_names_and_types_by_node(
        self, node_name: str, node_namespace: str
    ) -> NamesAndTypes:
        """Return (service, [types]) of the services that a node offers."""
        return _of_node(
            lambda: self._graph.services_by_node(node_name, node_namespace),
            'service names and types',
        )

    def get_client_names_and_types_by_node(
        self, node_name: str, node_namespace: str
    ) -> NamesAndTypes:
        """Return (service, [types]) of the services that a node calls."""
        return _of_node(
            lambda: self._graph.clients_by_node(node_name, node_namespace),
            'client names and types',
        )

    def count_publishers(self, topic_name: str) -> int:
        """Return how many publishers a topic has. The name is expanded, not remapped."""
        return self._graph.count_publishers(self._names.topic(topic_name, only_expand=True))

    def count_subscribers(self, topic_name: str) -> int:
        """Return how many subscriptions a topic has. The name is expanded, not remapped."""
        return self._graph.count_subscribers(self._names.topic(topic_name, only_expand=True))

    def count_services(self, service_name: str) -> int:
        """Return how many servers a service has. The name is expanded, not remapped."""
        return self._graph.count_services(self._names.service(service_name, only_expand=True))

    def count_clients(self, service_name: str) -> int:
        """Return how many clients a service has. The name is expanded, not remapped."""
        return self._graph.count_clients(self._names.service(service_name, only_expand=True))

    def get_publishers_info_by_topic(
        self, topic_name: str, no_mangle: bool = False
    ) -> list[TopicEndpointInfo]:
        """Return node, type and QoS of every publisher of a topic.

        Args:
            topic_name: The topic, expanded and remapped like that of a publisher.
            no_mangle: The name is DDS's own and taken as it is.
        """
        name = topic_name if no_mangle else self._names.topic(topic_name)
        return [_info(record) for record in self._graph.publishers_info(name, no_mangle)]

    def get_subscriptions_info_by_topic(
        self, topic_name: str, no_mangle: bool = False
    ) -> list[TopicEndpointInfo]:
        """Return node, type and QoS of every subscription of a topic.

        Args:
            topic_name: The topic, expanded and remapped like that of a subscription.
            no_mangle: The name is DDS's own and taken as it is.
        """
        name = topic_name if no_mangle else self._names.topic(topic_name)
        return [_info(record) for record in self._graph.subscriptions_info(name, no_mangle)]

    def wait_for_node(self, fully_qualified_node_name: str, timeout: float) -> bool:
        """Wait until a node is in the graph; return whether it is.

        Args:
            fully_qualified_node_name: Namespace and name; a missing first slash is added.
            timeout: How long to wait at most [s].
        """
        name = '/' + fully_qualified_node_name.lstrip('/')
        validate_node_name(name.rpartition('/')[2])
        end = time.monotonic() + timeout
        while name not in self.get_fully_qualified_node_names():
            left = end - time.monotonic()
            if left <= 0 or self._context._wait_for_end(min(left, _POLL_SEC)):
                return False
        return True


def _of_node(query: Callable[[], NamesAndTypes], what: str) -> NamesAndTypes:
    try:
        return query()
    except UnknownNodeError as error:
        raise NodeNameNonExistentError(f'Failed to get {what}: {error}') from None


def _info(record: EndpointRecord) -> TopicEndpointInfo:
    return TopicEndpointInfo(
        node_name=record.node_name,
        node_namespace=record.node_namespace,
        topic_type=record.topic_type,
        topic_type_hash=TypeHash.from_text(record.topic_type_hash),
        endpoint_type=TopicEndpointTypeEnum[record.endpoint_type],
        endpoint_gid=list(record.endpoint_gid),
        qos_profile=record.qos_profile,
    )
