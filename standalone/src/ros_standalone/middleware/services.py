"""Servers and clients of services: a topic of requests and a topic of replies.

A request starts with the client's identifier (8 bytes) and a count (8 bytes); the server copies
both into its reply, and a client drops what does not carry its identifier. Both together are 16
bytes, so what follows keeps the alignment that it has without them.
"""

from __future__ import annotations

import itertools
import secrets
import struct
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from ros_standalone.middleware.endpoints import Reader, Writer
from ros_standalone.middleware.entities import Entity

CLIENT_KEY, SERVER_KEY = 'clientid', 'serviceid'

_HEADER = bytes((0, 1, 0, 0))
_ENCAPSULATION = 4
_LONGEST_WAIT_FOR_CLIENT_S = 1.0
_PAUSE_S = 0.002


@dataclass(frozen=True)
class RequestId:
    """Whose request it is and which one.

    Attributes:
        client: The client's identifier.
        sequence: The client's count of the request.
        writer: DDS instance handle of the client's writer, of this process alone.
    """

    client: int
    sequence: int
    writer: int


class _Pair(Entity):
    """A reader and a writer that belong together."""

    def __init__(
        self, what: str, reader: Reader, writer: Writer, on_close: Callable[[], None]
    ) -> None:
        super().__init__(what, on_close)
        self._reader = reader
        self._writer = writer

    def _delete(self) -> None:
        self._writer.close()
        self._reader.close()

    def _wait_handle(self) -> int | None:
        return self._reader._wait_handle()


class Server(_Pair):
    """Takes requests and sends replies."""

    def take(self) -> tuple[RequestId, bytes] | None:
        """The oldest request that was not taken yet, as CDR with header; None for none."""
        self._require_open()
        for payload, info in self._reader.take_all():
            parts = _split(payload)
            if parts is not None:
                client, sequence, request = parts
                return RequestId(client, sequence, info.publication_handle), request
        return None

    def send(self, request_id: RequestId, cdr: bytes) -> bool:
        """Answer a request.

        A client that has gone is no error. One whose reader is not known here yet is waited for.

        Args:
            request_id: Of the request, from `take`.
            cdr: The reply with its 4-byte CDR header.

        Returns:
            False where the client's reader was not found in time: the client gets no reply.
        """
        self._require_open()
        end = time.monotonic() + _LONGEST_WAIT_FOR_CLIENT_S
        while (reachable := self._is_reachable(request_id.writer)) is None:
            if time.monotonic() > end:
                return False
            time.sleep(_PAUSE_S)
        if reachable:
            self._writer.publish(_join(request_id.client, request_id.sequence, cdr))
        return True

    def _is_reachable(self, client_writer: int) -> bool | None:
        """Whether a client hears replies; False if it has gone, None if it may do so soon."""
        client = self._reader.matched_user_data(client_writer)
        if client is None:
            return False
        if CLIENT_KEY not in client:
            return True
        for instance in self._writer.matched():
            peer = self._writer.matched_user_data(instance)
            if peer is not None and peer.get(CLIENT_KEY) == client[CLIENT_KEY]:
                return True
        return None


class Client(_Pair):
    """Sends requests and takes the replies to them."""

    def __init__(
        self, what: str, reader: Reader, writer: Writer, on_close: Callable[[], None]
    ) -> None:
        super().__init__(what, reader, writer, on_close)
        self._identifier = secrets.randbits(64)
        self._numbers = itertools.count(1)
        self._sending = threading.Lock()

    def send(self, cdr: bytes) -> int:
        """Send a request (CDR with header); returns its number, which the reply carries."""
        self._require_open()
        with self._sending:
            number = next(self._numbers)
            self._writer.publish(_join(self._identifier, number, cdr))
        return number

    def take(self) -> tuple[int, bytes] | None:
        """The oldest reply to this client that was not taken yet: its request's number, CDR."""
        self._require_open()
        for payload, _ in self._reader.take_all():
            parts = _split(payload)
            if parts is not None and parts[0] == self._identifier:
                return parts[1], parts[2]
        return None

    def is_ready(self) -> bool:
        """Whether one server is there whose reader and writer are both known here."""
        self._require_open()
        readers = _server_ids(self._writer)
        writers = _server_ids(self._reader)
        named = {server for server in readers if server}
        return bool(named & set(writers)) if named else bool(readers and writers)


def _server_ids(endpoint: Reader | Writer) -> list[str]:
    peers = (endpoint.matched_user_data(instance) for instance in endpoint.matched())
    return [peer.get(SERVER_KEY, '') for peer in peers if peer is not None]


def _join(client: int, sequence: int, cdr: bytes) -> bytes:
    if bytes(cdr[:2]) != _HEADER[:2]:
        raise ValueError('a request or reply must be little-endian CDR with its 4-byte header')
    return _HEADER + struct.pack('<Qq', client, sequence) + bytes(cdr[_ENCAPSULATION:])


def _split(payload: bytes) -> tuple[int, int, bytes] | None:
    if len(payload) < _ENCAPSULATION + 16:
        return None
    order = '<' if payload[1] & 1 else '>'
    client, sequence = struct.unpack_from(order + 'Qq', payload, _ENCAPSULATION)
    return client, sequence, payload[:_ENCAPSULATION] + payload[_ENCAPSULATION + 16 :]
