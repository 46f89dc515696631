"""Service clients."""

from __future__ import annotations

import functools
import threading
import time
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING, Any

from rclpy.exceptions import InvalidHandle
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_or_drop, serialize_message
from rclpy.task import Future

if TYPE_CHECKING:
    from rclpy._executor import Executor
    from rclpy.callback_groups import CallbackGroup
    from rclpy.context import Context
    from ros_standalone.middleware import Client as MiddlewareClient

_DISCOVERY_POLL_SEC = 0.01


class Client:
    """Sends requests to a service; made by `Node.create_client`.

    Args:
        context: The context of the node.
        client: The middleware's client.
        srv_type: The service class.
        srv_name: The service's name as it was given.
        service_name: The full name after expansion and remapping.
        qos_profile: The quality of service.
        callback_group: The group that the arrival of responses belongs to.
    """

    def __init__(
        self,
        context: Context,
        client: MiddlewareClient,
        srv_type: Any,
        srv_name: str,
        service_name: str,
        qos_profile: QoSProfile,
        callback_group: CallbackGroup,
    ) -> None:
        self.context = context
        self._client = client
        self._service_name = service_name
        self._destroyed = False
        self._pending: dict[int, Future[Any]] = {}
        self._lock = threading.Lock()
        self.srv_type = srv_type
        self.srv_name = srv_name
        self.qos_profile = qos_profile
        self.callback_group = callback_group

    @property
    def service_name(self) -> str:
        """The full name of the service."""
        return self._service_name

    def call(self, request: Any, timeout_sec: float | None = None) -> Any:
        """Send a request and wait for the response, which an executor must receive meanwhile.

        In a callback of the same executor thread this would wait for ever: use `call_async`.

        Args:
            request: An instance of the service's Request.
            timeout_sec: How long to wait at most; None for as long as it takes.

        Raises:
            TypeError: if the request is not of the service's request type.
            TimeoutError: if no response came in time.
        """
        arrived = threading.Event()
        future = self.call_async(request)
        future._add_waiter(arrived.set)
        if not arrived.wait(timeout_sec):
            self.remove_pending_request(future)
            raise TimeoutError()
        return future.result()

    def call_async(self, request: Any) -> Future[Any]:
        """Send a request and return the future of its response.

        Raises:
            TypeError: if the request is not of the service's request type.
            InvalidHandle: if the client was destroyed.
        """
        if not isinstance(request, self.srv_type.Request):
            raise TypeError(f'Expected {self.srv_type.Request}, got {type(request)}')
        self._check()
        data = serialize_message(request)
        future: Future[Any] = Future()
        # The response may arrive before the number of the request is noted: hence the lock.
        with self._lock:
            self._pending[self._client.send(data)] = future
        future._add_waiter(functools.partial(self.remove_pending_request, future))
        return future

    def get_pending_request(self, sequence_number: int) -> Future[Any]:
        """Return the future of the request with this number; KeyError if it is not awaited."""
        with self._lock:
            return self._pending[sequence_number]

    def remove_pending_request(self, future: Future[Any]) -> None:
        """Give up waiting for a response: its future will not be completed."""
        with self._lock:
            for number, pending in self._pending.items():
                if pending is future:
                    del self._pending[number]
                    return

    def service_is_ready(self) -> bool:
        """Return whether a server would receive a request."""
        self._check()
        return self._client.is_ready()

    def wait_for_service(self, timeout_sec: float | None = None) -> bool:
        """Wait for a server.

        Args:
            timeout_sec: How long at most; None for as long as it takes.

        Returns:
            Whether there is one; False also if the context was shut down meanwhile.
        """
        end = float('inf') if timeout_sec is None else time.monotonic() + timeout_sec
        while self.context.ok() and not self.service_is_ready():
            left = end - time.monotonic()
            if left <= 0:
                break
            self.context._wait_for_end(min(left, _DISCOVERY_POLL_SEC))
        return self.service_is_ready()

    @property
    def _source(self) -> MiddlewareClient:
        return self._client

    def _take_job(self, executor: Executor) -> Callable[[], Any] | None:
        """Return what completes the future that awaits the next response, None without one."""
        arrived = self._take()
        if arrived is None:
            return None
        future, response = arrived
        future._set_executor(executor)
        return functools.partial(future.set_result, response)

    def destroy(self) -> None:
        """End the use of the client; prefer `Node.destroy_client`."""
        if not self._destroyed:
            self._destroyed = True
            self._client.close()

    def _take(self) -> tuple[Future[Any], Any] | None:
        """Return the next response with the future that awaits it, None if there is none."""
        while not self._destroyed:
            sample = self._client.take()
            if sample is None:
                return None
            number, data = sample
            with self._lock:
                future = self._pending.pop(number, None)
            if future is None:
                continue
            response = deserialize_or_drop(data, self.srv_type.Response, self._service_name)
            if response is not None:
                return future, response
        return None

    def _check(self) -> None:
        if self._destroyed:
            raise InvalidHandle('cannot use Destroyable because destruction was requested')

    def __enter__(self) -> Client:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.destroy()
