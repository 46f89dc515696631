"""What the graph knows of one publisher or subscription."""

from __future__ import annotations

from enum import IntEnum

from rclpy.qos import QoSProfile, qos_profile_unknown
from rclpy.type_hash import TypeHash


class TopicEndpointTypeEnum(IntEnum):
    """Kind of an endpoint, with the values of rmw."""

    INVALID = 0
    PUBLISHER = 1
    SUBSCRIPTION = 2


class TopicEndpointInfo:
    """One publisher or subscription of a topic.

    Args:
        node_name: Base name of its node.
        node_namespace: The node's namespace.
        topic_type: The message type, as 'std_msgs/msg/String'.
        topic_type_hash: The type's hash.
        endpoint_type: Publisher or subscription.
        endpoint_gid: The endpoint's 16 bytes on the wire.
        qos_profile: Its quality of service.
    """

    __slots__ = (
        '_endpoint_gid',
        '_endpoint_type',
        '_node_name',
        '_node_namespace',
        '_qos_profile',
        '_topic_type',
        '_topic_type_hash',
    )

    def __init__(
        self,
        node_name: str = '',
        node_namespace: str = '',
        topic_type: str = '',
        topic_type_hash: TypeHash | None = None,
        endpoint_type: TopicEndpointTypeEnum = TopicEndpointTypeEnum.INVALID,
        endpoint_gid: list[int] | None = None,
        qos_profile: QoSProfile = qos_profile_unknown,
    ) -> None:
        self._node_name = node_name
        self._node_namespace = node_namespace
        self._topic_type = topic_type
        self._topic_type_hash = topic_type_hash or TypeHash()
        self._endpoint_type = TopicEndpointTypeEnum(endpoint_type)
        self._endpoint_gid = list(endpoint_gid or [])
        self._qos_profile = qos_profile

    @property
    def node_name(self) -> str:
        """Base name of the endpoint's node."""
        return self._node_name

    @property
    def node_namespace(self) -> str:
        """Namespace of the endpoint's node."""
        return self._node_namespace

    @property
    def topic_type(self) -> str:
        """The message type."""
        return self._topic_type

    @property
    def topic_type_hash(self) -> TypeHash:
        """The message type's hash."""
        return self._topic_type_hash

    @property
    def endpoint_type(self) -> TopicEndpointTypeEnum:
        """Publisher or subscription."""
        return self._endpoint_type

    @property
    def endpoint_gid(self) -> list[int]:
        """The endpoint's identity, as byte values."""
        return self._endpoint_gid

    @property
    def qos_profile(self) -> QoSProfile:
        """The endpoint's quality of service."""
        return self._qos_profile

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, TopicEndpointInfo):
            return False
        return all(getattr(self, name) == getattr(other, name) for name in self.__slots__)

    __hash__ = None  # type: ignore[assignment]

    def __str__(self) -> str:
        qos = self.qos_profile
        depth = f' ({qos.depth})' if qos.history.name == 'KEEP_LAST' else ''
        return '\n'.join(
            (
                f'Node name: {self.node_name}',
                f'Node namespace: {self.node_namespace}',
                f'Topic type: {self.topic_type}',
                f'Topic type hash: {self.topic_type_hash}',
                f'Endpoint type: {self.endpoint_type.name}',
                f'GID: {".".join(format(byte, "02x") for byte in self.endpoint_gid)}',
                'QoS profile:',
                f'  Reliability: {qos.reliability.name}',
                f'  History (Depth): {qos.history.name}{depth}',
                f'  Durability: {qos.durability.name}',
                f'  Lifespan: {qos.lifespan}',
                f'  Deadline: {qos.deadline}',
                f'  Liveliness: {qos.liveliness.name}',
                f'  Liveliness lease duration: {qos.liveliness_lease_duration}',
            )
        )
