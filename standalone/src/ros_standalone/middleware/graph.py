"""Who is there: nodes, topics, services and their endpoints in all processes of the domain.

DDS's builtin topics tell of participants and endpoints, ROS's discovery message tells which of
them belong to which node; both are merged here.
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ros_standalone.middleware import library, names
from ros_standalone.middleware.builtin_topics import BuiltinReader, Endpoint
from ros_standalone.middleware.discovery_info import NodeEntities, parse_entities
from ros_standalone.middleware.endpoints import Reader
from ros_standalone.middleware.errors import ClosedError, MiddlewareError
from ros_standalone.middleware.qos import DdsQos, profile_from
from ros_standalone.middleware.waiting import GuardCondition, wait_until

if TYPE_CHECKING:
    from rclpy.qos import QoSProfile

NamesAndTypes = list[tuple[str, list[str]]]
Demangle = Callable[[str], 'str | None']

_NO_ROS = '_CREATED_BY_BARE_DDS_APP_'
_NO_NAME, _NO_NAMESPACE = '_NODE_NAME_UNKNOWN_', '_NODE_NAMESPACE_UNKNOWN_'


class UnknownNodeError(MiddlewareError):
    """A node was asked about that is not in the graph."""


@dataclass(frozen=True)
class EndpointRecord:
    """One writer or reader of a topic, as `ros2 topic info -v` shows it.

    Attributes:
        endpoint_type: 'PUBLISHER' or 'SUBSCRIPTION'.
        topic_type_hash: 'RIHS01_...', empty where it did not say.
        endpoint_gid: 16 bytes.
    """

    node_name: str
    node_namespace: str
    topic_type: str
    topic_type_hash: str
    endpoint_type: str
    endpoint_gid: bytes
    qos_profile: QoSProfile


class Graph:
    """The graph as this participant knows it, kept up to date by a thread of its own.

    Args:
        participant: DDS handle of the participant.
        gid: Its identifier, 16 bytes.
        discovery_info: Reader of ROS's discovery messages of other participants.
        local_nodes: Tells the nodes of this participant.
        changed: Is triggered whenever the graph changes.
    """

    def __init__(
        self,
        participant: int,
        gid: bytes,
        discovery_info: Reader,
        local_nodes: Callable[[], tuple[NodeEntities, ...]],
        changed: GuardCondition,
    ) -> None:
        self.changed = changed
        self._gid = gid
        self._discovery_info = discovery_info
        self._local_nodes = local_nodes
        self._participants = BuiltinReader(participant, library.BUILTIN_PARTICIPANTS)
        self._publications = BuiltinReader(participant, library.BUILTIN_PUBLICATIONS)
        self._subscriptions = BuiltinReader(participant, library.BUILTIN_SUBSCRIPTIONS)
        self._lock = threading.RLock()
        self._condition = threading.Condition()
        self._alive: dict[bytes, dict[str, str]] = {}
        self._nodes: dict[bytes, tuple[NodeEntities, ...]] = {}
        self._writers: dict[bytes, Endpoint] = {}
        self._readers: dict[bytes, Endpoint] = {}
        self._stopping = False
        self._stop = library.check(
            library.create_guard_condition(participant), 'create a guard condition'
        )
        self._waitset = library.check(library.create_waitset(participant), 'create a wait set')
        self._thread = threading.Thread(target=self._watch, name='ros graph', daemon=True)
        self._thread.start()

    def node_names_and_namespaces(self) -> list[tuple[str, str]]:
        """Name and namespace of every node; a name that is used twice is there twice."""
        return [(name, space) for name, space, _ in self.node_names_namespaces_and_enclaves()]

    def node_names_namespaces_and_enclaves(self) -> list[tuple[str, str, str]]:
        """Name, namespace and enclave of every node."""
        with self._lock:
            self._collect()
            return [
                (node.name, node.namespace, self._alive.get(gid, {}).get('enclave', '/'))
                for gid, nodes in self._all_nodes()
                for node in nodes
            ]

    def topic_names_and_types(self, no_demangle: bool = False) -> NamesAndTypes:
        """Every topic with its types.

        Args:
            no_demangle: List DDS's names and types, of services and foreign topics too.
        """
        with self._lock:
            self._collect()
            endpoints = [*self._writers.values(), *self._readers.values()]
        if no_demangle:
            return _names_and_types(endpoints, lambda name: name, lambda name: name)
        return _names_and_types(endpoints, names.topic_from_dds, names.type_from_dds)

    def service_names_and_types(self) -> NamesAndTypes:
        """Every service that a server or client is there for, with its types."""
        with self._lock:
            self._collect()
            endpoints = [*self._writers.values(), *self._readers.values()]
        return _names_and_types(
            endpoints,
            lambda name: names.service_from_request(name) or names.service_from_reply(name),
            names.service_type_from_dds,
        )

    def publishers_by_node(
        self, name: str, namespace: str, no_demangle: bool = False
    ) -> NamesAndTypes:
        """Topics and types that a node publishes; UnknownNodeError for a node that is not."""
        writers, _ = self._endpoints_of(name, namespace)
        return _topics(writers, no_demangle)

    def subscribers_by_node(
        self, name: str, namespace: str, no_demangle: bool = False
    ) -> NamesAndTypes:
        """Topics and types that a node listens to; UnknownNodeError for a node that is not."""
        _, readers = self._endpoints_of(name, namespace)
        return _topics(readers, no_demangle)

    def services_by_node(self, name: str, namespace: str) -> NamesAndTypes:
        """Services and types that a node serves; UnknownNodeError for a node that is not."""
        _, readers = self._endpoints_of(name, namespace)
        return _names_and_types(readers, names.service_from_request, names.service_type_from_dds)

    def clients_by_node(self, name: str, namespace: str) -> NamesAndTypes:
        """Services and types that a node calls; UnknownNodeError for a node that is not."""
        _, readers = self._endpoints_of(name, namespace)
        return _names_and_types(readers, names.service_from_reply, names.service_type_from_dds)

    def count_publishers(self, topic: str) -> int:
        """How many writers a topic has."""
        return len(self._on_topic(self._writers, names.topic_to_dds(topic)))

    def count_subscribers(self, topic: str) -> int:
        """How many readers a topic has."""
        return len(self._on_topic(self._readers, names.topic_to_dds(topic)))

    def count_services(self, service: str) -> int:
        """How many servers a service has."""
        return len(self._on_topic(self._readers, names.request_to_dds(service)))

    def count_clients(self, service: str) -> int:
        """How many clients a service has."""
        return len(self._on_topic(self._readers, names.reply_to_dds(service)))

    def publishers_info(self, topic: str, no_mangle: bool = False) -> list[EndpointRecord]:
        """The writers of a topic; with no_mangle the topic is a DDS name."""
        return self._records(self._writers, topic, no_mangle, 'PUBLISHER')

    def subscriptions_info(self, topic: str, no_mangle: bool = False) -> list[EndpointRecord]:
        """The readers of a topic; with no_mangle the topic is a DDS name."""
        return self._records(self._readers, topic, no_mangle, 'SUBSCRIPTION')

    def offered_qos(self, topic: str) -> list[DdsQos]:
        """The policies of a DDS topic's writers."""
        return [endpoint.qos for endpoint in self._on_topic(self._writers, topic)]

    def wait_until(self, predicate: Callable[[], bool], timeout_s: float) -> bool:
        """Wait until something holds that depends on the graph; False when time is over."""
        return wait_until(predicate, self._condition, time.monotonic() + timeout_s)

    def announce_change(self) -> None:
        """Wake those who wait for a change of the graph."""
        self.changed.trigger()
        with self._condition:
            self._condition.notify_all()

    def close(self) -> None:
        """Stop the thread; what is known can still be asked for."""
        self._stopping = True
        library.set_guard_condition(self._stop, True)
        if self._thread is not threading.current_thread():
            self._thread.join()

    def _watch(self) -> None:
        sources = (
            self._stop,
            self._participants.condition,
            self._publications.condition,
            self._subscriptions.condition,
            self._discovery_info.condition,
        )
        for source in sources:
            library.waitset_attach(self._waitset, source, source)
        while not self._stopping:
            if library.waitset_wait(self._waitset, None, 0, library.INFINITE) < 0:
                return
            if not self._stopping:
                with self._lock:
                    self._collect()

    def _collect(self) -> None:
        """Take in what was discovered; called with the lock held."""
        changed = False
        for participant, user_data in self._participants.take_participants():
            changed = True
            if user_data is None:
                self._alive.pop(participant, None)
                self._nodes.pop(participant, None)
            else:
                self._alive[participant] = user_data
        for source, known in (
            (self._publications, self._writers),
            (self._subscriptions, self._readers),
        ):
            for gid, endpoint in source.take_endpoints():
                changed = True
                if endpoint is None:
                    known.pop(gid, None)
                else:
                    known[gid] = endpoint
        changed |= self._collect_nodes()
        if changed:
            self.announce_change()

    def _collect_nodes(self) -> bool:
        changed = False
        # A participant that is being closed hears no more, but can still be asked.
        with contextlib.suppress(ClosedError):
            for payload, _ in self._discovery_info.take_all():
                # Another release of ROS may lay the message out otherwise; its nodes stay unknown.
                with contextlib.suppress(ValueError):
                    participant, nodes = parse_entities(payload)
                    self._nodes[participant] = nodes
                    changed = True
        return changed

    def _all_nodes(self) -> list[tuple[bytes, tuple[NodeEntities, ...]]]:
        others = [(gid, nodes) for gid, nodes in self._nodes.items() if gid in self._alive]
        return [(self._gid, self._local_nodes()), *others]

    def _endpoints_of(self, name: str, namespace: str) -> tuple[list[Endpoint], list[Endpoint]]:
        with self._lock:
            self._collect()
            nodes = [
                node
                for _, nodes in self._all_nodes()
                for node in nodes
                if (node.name, node.namespace) == (name, namespace)
            ]
            if not nodes:
                raise UnknownNodeError(
                    f"there is no node named '{name}' in namespace '{namespace}'"
                )
            writers = [self._writers.get(gid) for node in nodes for gid in node.writers]
            readers = [self._readers.get(gid) for node in nodes for gid in node.readers]
        return (
            [writer for writer in writers if writer is not None],
            [reader for reader in readers if reader is not None],
        )

    def _on_topic(self, endpoints: dict[bytes, Endpoint], topic: str) -> list[Endpoint]:
        with self._lock:
            self._collect()
            return [endpoint for endpoint in endpoints.values() if endpoint.topic == topic]

    def _records(
        self, endpoints: dict[bytes, Endpoint], topic: str, no_mangle: bool, kind: str
    ) -> list[EndpointRecord]:
        with self._lock:
            found = self._on_topic(endpoints, names.topic_to_dds(topic, no_mangle))
            owners = {
                gid: node
                for _, nodes in self._all_nodes()
                for node in nodes
                for gid in (*node.readers, *node.writers)
            }
            participants = {gid for gid, _ in self._all_nodes()}
        records = []
        for endpoint in found:
            owner = owners.get(endpoint.gid)
            if owner is None and endpoint.participant in participants:
                owner = NodeEntities(_NO_NAMESPACE, _NO_NAME)
            elif owner is None:
                owner = NodeEntities(_NO_ROS, _NO_ROS)
            records.append(
                EndpointRecord(
                    owner.name,
                    owner.namespace,
                    names.type_from_dds(endpoint.type_name),
                    endpoint.user_data.get('typehash', ''),
                    kind,
                    endpoint.gid,
                    profile_from(endpoint.qos),
                )
            )
        return records


def _topics(endpoints: Iterable[Endpoint], no_demangle: bool) -> NamesAndTypes:
    if no_demangle:
        return _names_and_types(endpoints, lambda name: name, lambda name: name)
    return _names_and_types(endpoints, names.topic_from_dds, names.type_from_dds)


def _names_and_types(
    endpoints: Iterable[Endpoint], demangle_name: Demangle, demangle_type: Demangle
) -> NamesAndTypes:
    found: dict[str, set[str]] = {}
    for endpoint in endpoints:
        name, type_name = demangle_name(endpoint.topic), demangle_type(endpoint.type_name)
        if name is not None and type_name is not None:
            found.setdefault(name, set()).add(type_name)
    return [(name, sorted(found[name])) for name in sorted(found)]
