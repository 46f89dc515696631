"""Writers and readers of serialized messages."""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

from ros_standalone.middleware import library
from ros_standalone.middleware.entities import Entity
from ros_standalone.middleware.qos import DdsQos, native_qos, read_user_data
from ros_standalone.middleware.topics import Topics
from ros_standalone.middleware.user_data import parse_user_data

_SHORTEST_PAYLOAD = 5


@dataclass(frozen=True)
class EndpointPlan:
    """What a writer or reader is made of: DDS names, user data and policies."""

    topic: str
    type_name: str
    qos: DdsQos
    user_data: bytes = b''
    ignore_own_participant: bool = False


@dataclass(frozen=True)
class MessageInfo:
    """What is known of a message beyond its content; times in nanoseconds since 1970.

    DDS does not pass on the sender's count of a message, so the sequence number is None.
    """

    source_timestamp: int
    received_timestamp: int
    publication_sequence_number: int | None = None
    publication_handle: int = 0


class Endpoint(Entity):
    """A writer or reader on a topic of a participant.

    Attributes:
        gid: Its globally unique identifier, 16 bytes.
        qos: The policies that it has.
    """

    _kind: ClassVar[str]
    _list_matched: ClassVar[Callable[..., int]]
    _describe_matched: ClassVar[Callable[..., Any]]
    _read_incompatible: ClassVar[Callable[..., int]]

    def __init__(
        self,
        participant: int,
        topics: Topics,
        plan: EndpointPlan,
        on_close: Callable[[], None],
    ) -> None:
        super().__init__(f'the {self._kind} on {plan.topic}', on_close)
        self._topics = topics
        self._plan = plan
        topic = topics.acquire(plan.topic, plan.type_name)
        try:
            with native_qos(plan.qos, plan.user_data, plan.ignore_own_participant) as qos:
                self._handle = self._create(participant, topic, qos)
                self.gid = library.guid_of(self._handle)
        except BaseException:
            topics.release(plan.topic, plan.type_name)
            raise
        self.qos = plan.qos

    def matched(self) -> list[int]:
        """Instance handles of the endpoints that it exchanges messages with."""
        capacity = 8
        while True:
            handles = (ctypes.c_uint64 * capacity)()
            result = self._list_matched(self._handle, handles, capacity)
            count = self._check(result, 'count the matched endpoints')
            if count <= capacity:
                return list(handles[:count])
            capacity = count

    def matched_count(self) -> int:
        """How many endpoints it exchanges messages with."""
        return len(self.matched())

    def matched_user_data(self, instance: int) -> dict[str, str] | None:
        """What a matched endpoint says of itself; None where it has gone."""
        endpoint = self._describe_matched(self._handle, instance)
        if not endpoint:
            return None
        try:
            qos = endpoint.contents.qos
            return parse_user_data(read_user_data(qos)) if qos else {}
        finally:
            library.free_endpoint(endpoint)

    def incompatible_qos(self) -> tuple[int, int]:
        """How many endpoints were refused for their policies, and DDS's id of the last policy."""
        status = library.IncompatibleQosStatus()
        self._check(self._read_incompatible(self._handle, status), 'read the status')
        return int(status.total_count), int(status.last_policy_id)

    def _create(self, participant: int, topic: int, qos: int) -> int:
        raise NotImplementedError

    def _delete(self) -> None:
        library.delete(self._handle)
        self._topics.release(self._plan.topic, self._plan.type_name)

    def _check(self, result: int, doing: str) -> int:
        if result < 0:
            self._require_open()
        return library.check(result, f'{doing} on {self._plan.topic}')


class Writer(Endpoint):
    """Sends serialized messages to the readers of a topic."""

    _kind = 'writer'
    _list_matched = library.get_matched_subscriptions
    _describe_matched = library.get_matched_subscription_data
    _read_incompatible = library.get_offered_incompatible_qos_status

    def publish(self, cdr: bytes) -> None:
        """Send a message; waits where a reliable reader is too slow to take more.

        Args:
            cdr: The message with its 4-byte CDR header.

        Raises:
            ValueError: The bytes are too few to be a message.
            ClosedError: The writer has been closed.
            MiddlewareError: DDS cannot send it.
        """
        self._require_open()
        if len(cdr) < _SHORTEST_PAYLOAD:
            raise ValueError(
                f'a serialized message has at least {_SHORTEST_PAYLOAD} bytes, got {len(cdr)}'
            )
        # Cyclone sends whole words and would read past the end of a payload that ends within one.
        payload = bytes(cdr) + bytes(-len(cdr) % 4)
        sample = library.Sample(
            ctypes.cast(ctypes.c_char_p(payload), ctypes.c_void_p), len(payload)
        )
        self._check(library.write(self._handle, sample), 'publish')

    def wait_for_acks(self, timeout_s: float) -> bool:
        """Wait until every matched reliable reader has confirmed all; False when time is over."""
        result = library.wait_for_acks(self._handle, int(timeout_s * 1e9))
        if library.is_timeout(result):
            return False
        self._check(result, 'wait for confirmation')
        return True

    def assert_liveliness(self) -> None:
        """Say that the writer is alive, where its liveliness is to be asserted by hand."""
        self._check(library.assert_liveliness(self._handle), 'assert liveliness')

    def _create(self, participant: int, topic: int, qos: int) -> int:
        result = library.create_writer(participant, topic, qos, None)
        return library.check(result, f'create a writer on {self._plan.topic}')


class Reader(Endpoint):
    """Receives serialized messages of the writers of a topic.

    Attributes:
        condition: DDS handle of the condition that there are messages.
    """

    condition: int

    _kind = 'reader'
    _list_matched = library.get_matched_publications
    _describe_matched = library.get_matched_publication_data
    _read_incompatible = library.get_requested_incompatible_qos_status

    def take(self) -> tuple[bytes, MessageInfo] | None:
        """The oldest message that was not taken yet; None where there is none.

        Raises:
            ClosedError: The reader has been closed.
        """
        self._require_open()
        while True:
            sample, info = library.Sample(), library.SampleInfo()
            target = ctypes.pointer(sample)
            count = self._check(
                library.take_next(self._handle, ctypes.byref(target), info), 'take a message'
            )
            if not count:
                return None
            try:
                payload = ctypes.string_at(sample.data, sample.size) if sample.data else b''
            finally:
                library.free(sample.data)
            # A sample without data only says that a writer has gone.
            if info.valid_data:
                return payload, MessageInfo(
                    source_timestamp=int(info.source_timestamp),
                    received_timestamp=time.time_ns(),
                    publication_handle=int(info.publication_handle),
                )

    def take_all(self) -> Iterator[tuple[bytes, MessageInfo]]:
        """Take messages until none is left."""
        while (message := self.take()) is not None:
            yield message

    def _create(self, participant: int, topic: int, qos: int) -> int:
        result = library.create_reader(participant, topic, qos, None)
        handle = library.check(result, f'create a reader on {self._plan.topic}')
        self.condition = library.check(
            library.create_read_condition(handle, library.ANY_STATE),
            f'create a condition for {self._plan.topic}',
        )
        return handle

    def _wait_handle(self) -> int | None:
        return self.condition
