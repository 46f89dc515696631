"""A participant of a domain: what one rclpy context is on the wire."""

from __future__ import annotations

import atexit
import os
import threading
import weakref
from dataclasses import replace
from typing import TYPE_CHECKING

from ros_standalone.middleware import discovery_info, library, names
from ros_standalone.middleware.discovery_info import NodeEntities
from ros_standalone.middleware.discovery_range import checked_domain_id, domain_id_from
from ros_standalone.middleware.domains import enter_domain, leave_domain
from ros_standalone.middleware.endpoints import EndpointPlan, Reader, Writer
from ros_standalone.middleware.entities import Entity
from ros_standalone.middleware.errors import ClosedError
from ros_standalone.middleware.graph import Graph
from ros_standalone.middleware.qos import (
    DdsQos,
    best_available,
    dds_qos_from,
    deep,
    native_qos,
    unlimited,
)
from ros_standalone.middleware.services import CLIENT_KEY, SERVER_KEY, Client, Server
from ros_standalone.middleware.topics import Topics
from ros_standalone.middleware.user_data import dotted_hex, pack_user_data
from ros_standalone.middleware.waiting import GuardCondition, WaitSet

if TYPE_CHECKING:
    from rclpy.qos import QoSProfile

_FAREWELL_S = 0.2
_UNCONFIRMED = 1000

_participants: weakref.WeakSet[Participant] = weakref.WeakSet()


class NodeHandle:
    """A node of a participant and the identifiers of its endpoints."""

    def __init__(self, name: str, namespace: str) -> None:
        self.name = name
        self.namespace = namespace
        self.readers: list[bytes] = []
        self.writers: list[bytes] = []

    def entities(self) -> NodeEntities:
        """The node as ROS's discovery message tells it."""
        return NodeEntities(self.namespace, self.name, tuple(self.readers), tuple(self.writers))


class Participant:
    """Takes part in a domain, holds nodes and makes their endpoints.

    Args:
        domain_id: The domain, 0..232; None takes it from ROS_DOMAIN_ID.
        enclave: The security enclave's name, which other processes are told.

    Attributes:
        domain_id: The domain.
        gid: Its globally unique identifier, 16 bytes.
        graph: What it knows of all processes.

    Raises:
        ConfigurationError: An environment variable holds what it cannot.
    """

    def __init__(self, domain_id: int | None = None, enclave: str = '/') -> None:
        if domain_id is None:
            domain_id = domain_id_from(os.environ)
        self.domain_id = checked_domain_id(domain_id)
        self._lock = threading.RLock()
        self._nodes: list[NodeHandle] = []
        self._entities: list[Entity] = []
        self._services = 0
        self._open = True
        enter_domain(self.domain_id)
        try:
            with native_qos(None, pack_user_data({'enclave': enclave})) as qos:
                self._handle = library.check(
                    library.create_participant(self.domain_id, qos, None),
                    f'join domain {self.domain_id}',
                )
        except BaseException:
            leave_domain(self.domain_id)
            raise
        try:
            self._set_up()
        except BaseException:
            library.delete(self._handle)
            leave_domain(self.domain_id)
            raise
        _participants.add(self)

    def _set_up(self) -> None:
        self.gid = library.guid_of(self._handle)
        self._topics = Topics(self._handle)
        plan = EndpointPlan(
            discovery_info.TOPIC,
            names.type_to_dds(discovery_info.TYPE_NAME),
            DdsQos(durability=1),
            pack_user_data({'typehash': discovery_info.TYPE_HASH}),
        )
        heard = EndpointPlan(
            plan.topic,
            plan.type_name,
            DdsQos(durability=1, history=1, depth=-1),
            plan.user_data,
            True,
        )
        self._announcer = Writer(self._handle, self._topics, plan, _nothing)
        self._listener = Reader(self._handle, self._topics, heard, _nothing)
        self.graph = Graph(
            self._handle, self.gid, self._listener, self._local_nodes, GuardCondition(self)
        )

    @property
    def is_open(self) -> bool:
        """Whether it has not been closed."""
        return self._open

    def add_node(self, name: str, namespace: str) -> NodeHandle:
        """Show a node in the graph."""
        node = NodeHandle(name, namespace)
        with self._lock:
            self._require_open()
            self._nodes.append(node)
            self._announce()
        return node

    def remove_node(self, node: NodeHandle) -> None:
        """Take a node off the graph; a second call does nothing."""
        with self._lock:
            if node in self._nodes:
                self._nodes.remove(node)
                self._announce()

    def create_writer(
        self, node: NodeHandle, topic: str, type_name: str, type_hash: str, qos: QoSProfile
    ) -> Writer:
        """A writer of a node on a fully qualified topic.

        Args:
            node: Whose it is in the graph.
            topic: '/namespace/name'.
            type_name: 'package/msg/Name'.
            type_hash: 'RIHS01_...', told to other processes.
            qos: The policies.

        Raises:
            ValueError: A policy cannot be.
            MiddlewareError: DDS refuses it.
        """
        name = names.topic_to_dds(topic, qos.avoid_ros_namespace_conventions)
        plan = EndpointPlan(
            name,
            names.type_to_dds(type_name),
            dds_qos_from(qos),
            pack_user_data({'typehash': type_hash}),
        )
        with self._lock:
            self._require_open()
            writer = Writer(
                self._handle, self._topics, plan, lambda: self._drop(node, writer, None, writer)
            )
            self._adopt(node, writer, None, writer)
        return writer

    def create_reader(
        self, node: NodeHandle, topic: str, type_name: str, type_hash: str, qos: QoSProfile
    ) -> Reader:
        """A reader of a node on a fully qualified topic; see `create_writer`."""
        name = names.topic_to_dds(topic, qos.avoid_ros_namespace_conventions)
        plan = EndpointPlan(
            name,
            names.type_to_dds(type_name),
            best_available(qos, self.graph.offered_qos(name)),
            pack_user_data({'typehash': type_hash}),
        )
        with self._lock:
            self._require_open()
            reader = Reader(
                self._handle, self._topics, plan, lambda: self._drop(node, reader, reader, None)
            )
            self._adopt(node, reader, reader, None)
        return reader

    def create_server(
        self, node: NodeHandle, service: str, type_name: str, type_hash: str, qos: QoSProfile
    ) -> Server:
        """A server of a node for a fully qualified service.

        Args:
            node: Whose it is in the graph.
            service: '/namespace/name'.
            type_name: 'package/srv/Name'.
            type_hash: 'RIHS01_...' of the service, told to other processes.
            qos: The policies of both directions.

        Raises:
            ValueError: A policy cannot be.
            MiddlewareError: DDS refuses it.
        """
        with self._lock:
            self._require_open()
            request, reply = self._service_plans(SERVER_KEY, service, type_name, type_hash, qos)
            reader, writer = self._pair(request, reply)
            server = Server(
                f'the server of {service}',
                reader,
                writer,
                lambda: self._drop(node, server, reader, writer),
            )
            self._adopt(node, server, reader, writer)
        return server

    def create_client(
        self, node: NodeHandle, service: str, type_name: str, type_hash: str, qos: QoSProfile
    ) -> Client:
        """A client of a node for a fully qualified service; see `create_server`."""
        with self._lock:
            self._require_open()
            request, reply = self._service_plans(CLIENT_KEY, service, type_name, type_hash, qos)
            reader, writer = self._pair(reply, request)
            client = Client(
                f'the client of {service}',
                reader,
                writer,
                lambda: self._drop(node, client, reader, writer),
            )
            self._adopt(node, client, reader, writer)
        return client

    def create_guard_condition(self) -> int:
        """DDS handle of a new guard condition."""
        self._require_open()
        return library.check(
            library.create_guard_condition(self._handle), 'create a guard condition'
        )

    def create_waitset(self) -> int:
        """DDS handle of a new wait set."""
        self._require_open()
        return library.check(library.create_waitset(self._handle), 'create a wait set')

    def remember(self, entity: Entity) -> None:
        """Close an entity together with the participant."""
        with self._lock:
            self._entities.append(entity)

    def forget(self, entity: Entity) -> None:
        """An entity was closed: wake who may wait for it."""
        with self._lock:
            if entity in self._entities:
                self._entities.remove(entity)
            waiting = [other for other in self._entities if isinstance(other, WaitSet)]
        for waitset in waiting:
            waitset.interrupt()

    def close(self) -> None:
        """Leave: nodes go off the graph at once, endpoints are closed; a second call is empty."""
        with self._lock:
            if not self._open:
                return
            self._open = False
            self._nodes.clear()
            self._announce()
            entities = list(self._entities)
        self._announcer.wait_for_acks(_FAREWELL_S)
        self.graph.close()
        # A wait set that still waits holds on to what it waits for.
        for entity in sorted(entities, key=lambda entity: not isinstance(entity, WaitSet)):
            entity.close()
        self._listener.close()
        self._announcer.close()
        library.delete(self._handle)
        leave_domain(self.domain_id)
        _participants.discard(self)

    def _service_plans(
        self, key: str, service: str, type_name: str, type_hash: str, qos: QoSProfile
    ) -> tuple[EndpointPlan, EndpointPlan]:
        self._services += 1
        identifier = self.gid[:12] + self._services.to_bytes(4, 'big')
        user_data = pack_user_data({key: dotted_hex(identifier), 'typehash': type_hash})
        policies = dds_qos_from(qos)
        return (
            EndpointPlan(
                names.request_to_dds(service),
                names.type_to_dds(type_name, '_Request'),
                policies,
                user_data,
            ),
            EndpointPlan(
                names.reply_to_dds(service),
                names.type_to_dds(type_name, '_Response'),
                policies,
                user_data,
            ),
        )

    def _pair(self, heard: EndpointPlan, said: EndpointPlan) -> tuple[Reader, Writer]:
        # All clients of a service share its topics: a reader that kept only the last messages
        # would lose one that is not taken yet when others are quicker. A writer that kept all
        # would wait for a client that hangs, and every other client with it.
        heard = replace(heard, qos=unlimited(heard.qos))
        said = replace(said, qos=deep(said.qos, _UNCONFIRMED))
        reader = Reader(self._handle, self._topics, heard, _nothing)
        try:
            return reader, Writer(self._handle, self._topics, said, _nothing)
        except BaseException:
            reader.close()
            raise

    def _adopt(
        self, node: NodeHandle, entity: Entity, reader: Reader | None, writer: Writer | None
    ) -> None:
        if reader is not None:
            node.readers.append(reader.gid)
        if writer is not None:
            node.writers.append(writer.gid)
        self._entities.append(entity)
        self._announce()

    def _drop(
        self, node: NodeHandle, entity: Entity, reader: Reader | None, writer: Writer | None
    ) -> None:
        with self._lock:
            if reader is not None:
                node.readers.remove(reader.gid)
            if writer is not None:
                node.writers.remove(writer.gid)
            if self._open:
                self._announce()
        self.forget(entity)

    def _announce(self) -> None:
        """Tell other participants of the nodes; called with the lock held."""
        self._announcer.publish(discovery_info.pack_entities(self.gid, self._local_nodes()))
        self.graph.announce_change()

    def _local_nodes(self) -> tuple[NodeEntities, ...]:
        with self._lock:
            return tuple(node.entities() for node in self._nodes)

    def _require_open(self) -> None:
        if not self._open:
            raise ClosedError('the participant has been closed')


def _nothing() -> None:
    """What happens when an endpoint closes that no node shows."""


@atexit.register
def _close_all() -> None:
    # A process that ends without a word leaves its nodes in the graph for seconds.
    for participant in list(_participants):
        participant.close()
