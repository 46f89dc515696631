"""Service servers."""

from __future__ import annotations

import contextlib
import inspect
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING, Any

from rclpy.exceptions import InvalidHandle
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_or_drop, serialize_message
from ros_standalone.middleware import ClosedError

if TYPE_CHECKING:
    from rclpy._executor import Executor
    from rclpy.callback_groups import CallbackGroup
    from ros_standalone.middleware import RequestId, Server


class Service:
    """Answers the requests to a service; made by `Node.create_service`.

    Args:
        server: The middleware's server.
        srv_type: The service class.
        srv_name: The service's name as it was given.
        service_name: The full name after expansion and remapping.
        callback: Called with the request and an empty response; returns the response.
        callback_group: The group that the callback belongs to.
        qos_profile: The quality of service.
    """

    def __init__(
        self,
        server: Server,
        srv_type: Any,
        srv_name: str,
        service_name: str,
        callback: Callable[[Any, Any], Any],
        callback_group: CallbackGroup,
        qos_profile: QoSProfile,
    ) -> None:
        self._server = server
        self._service_name = service_name
        self._destroyed = False
        self.srv_type = srv_type
        self.srv_name = srv_name
        self.callback = callback
        self.callback_group = callback_group
        self.qos_profile = qos_profile

    @property
    def service_name(self) -> str:
        """The full name of the service."""
        return self._service_name

    def send_response(self, response: Any, header: RequestId) -> None:
        """Answer the request that came with this header.

        Raises:
            TypeError: if the response is not of the service's response type.
            InvalidHandle: if the service was destroyed.
        """
        if not isinstance(response, self.srv_type.Response):
            raise TypeError(f'Expected {self.srv_type.Response}, got {type(response)}')
        if self._destroyed:
            raise InvalidHandle('cannot use Destroyable because destruction was requested')
        self._server.send(header, serialize_message(response))

    def destroy(self) -> None:
        """End the service; prefer `Node.destroy_service`."""
        if not self._destroyed:
            self._destroyed = True
            self._server.close()

    @property
    def _source(self) -> Server:
        return self._server

    def _take_job(self, executor: Executor) -> Callable[[], Any] | None:
        """Return what answers the next request, None if there is none."""
        arrived = self._take()
        if arrived is None:
            return None
        header, request = arrived
        callback, response = self.callback, self.srv_type.Response()

        def answer() -> None:
            self._respond(callback(request, response), header)

        async def answer_later() -> None:
            self._respond(await callback(request, response), header)

        return answer_later if inspect.iscoroutinefunction(callback) else answer

    def _respond(self, response: Any, header: RequestId) -> None:
        # Where the service was destroyed while the callback ran, there is nobody to be told.
        with contextlib.suppress(InvalidHandle, ClosedError):
            self.send_response(response, header)

    def _take(self) -> tuple[RequestId, Any] | None:
        """Return the next request with its header, None if there is none."""
        sample = None if self._destroyed else self._server.take()
        if sample is None:
            return None
        header, data = sample
        request = deserialize_or_drop(data, self.srv_type.Request, self._service_name)
        return None if request is None else (header, request)

    def __enter__(self) -> Service:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.destroy()
