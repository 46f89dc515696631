"""ROS 2's client library for Python (the interface of Jazzy) on Cyclone DDS, without ROS 2."""

from __future__ import annotations

from rclpy._beside_ros import refuse_beside_real_rclpy

refuse_beside_real_rclpy()

from types import TracebackType  # noqa: E402
from typing import Any  # noqa: E402

from rclpy import _unsupported, utilities  # noqa: E402
from rclpy.context import Context  # noqa: E402
from rclpy.executors import Executor, SingleThreadedExecutor  # noqa: E402
from rclpy.node import Node  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from rclpy.qos import QoSProfile, qos_profile_rosout_default  # noqa: E402
from rclpy.signals import (  # noqa: E402
    SignalHandlerOptions,
    install_signal_handlers,
    uninstall_signal_handlers,
)
from rclpy.task import Future  # noqa: E402
from rclpy.utilities import (  # noqa: E402
    get_available_rmw_implementations,
    get_default_context,
    get_rmw_implementation_identifier,
    ok,
)

__all__ = [
    'Context',
    'Executor',
    'Future',
    'InitContextManager',
    'Node',
    'Parameter',
    'SignalHandlerOptions',
    'create_node',
    'get_available_rmw_implementations',
    'get_default_context',
    'get_global_executor',
    'get_rmw_implementation_identifier',
    'init',
    'ok',
    'shutdown',
    'spin',
    'spin_once',
    'spin_until_future_complete',
    'try_shutdown',
]

_unsupported.explain_missing_modules()
__getattr__ = _unsupported.module_getattr(__name__)

_global_executor: Executor | None = None


class InitContextManager:
    """What `init` returns: a `with` block on it shuts down at its end.

    Args:
        args: Command line, the program's name first; None takes the process's own.
        context: The context to initialise; None for the default one.
        domain_id: DDS domain; None takes ROS_DOMAIN_ID, or 0.
        signal_handler_options: Signals to handle; None means all for the default context and
            none for another.
    """

    def __init__(
        self,
        args: list[str] | None,
        context: Context | None,
        domain_id: int | None,
        signal_handler_options: SignalHandlerOptions | None,
    ) -> None:
        self._given = context
        self.context = get_default_context() if context is None else context
        if signal_handler_options is None:
            is_default = context is None
            signal_handler_options = (
                SignalHandlerOptions.ALL if is_default else SignalHandlerOptions.NO
            )
        self.context.init(args, domain_id=domain_id)
        install_signal_handlers(signal_handler_options)

    def __enter__(self) -> InitContextManager:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try_shutdown(context=self._given)


def init(
    *,
    args: list[str] | None = None,
    context: Context | None = None,
    domain_id: int | None = None,
    signal_handler_options: SignalHandlerOptions | None = None,
) -> InitContextManager:
    """Begin: read the arguments, join the DDS domain, handle signals.

    Args:
        args: Command line, the program's name first; None takes the process's own.
        context: The context to initialise; None for the default one.
        domain_id: DDS domain; None takes ROS_DOMAIN_ID, or 0.
        signal_handler_options: Signals to handle; None means all for the default context and
            none for another.

    Returns:
        A context manager that shuts down when its block ends.
    """
    return InitContextManager(args, context, domain_id, signal_handler_options)


def get_global_executor() -> Executor:
    """Return the executor of `spin` and its relatives where none is given."""
    global _global_executor
    context = get_default_context()
    executor = _global_executor
    if executor is None or executor.context is not context:
        executor = _global_executor = SingleThreadedExecutor()
        # This calls back at once if a signal has ended the context before.
        context.on_shutdown(_drop_global_executor)
    return executor


def _drop_global_executor() -> None:
    global _global_executor
    if _global_executor is not None:
        executor, _global_executor = _global_executor, None
        executor.shutdown(0)


def shutdown(*, context: Context | None = None, uninstall_handlers: bool | None = None) -> None:
    """End what `init` began; an error if it has ended before.

    Args:
        context: The context to shut down; None for the default one.
        uninstall_handlers: Put the signal handlers back; None means for the default context.
    """
    utilities.shutdown(context=context)
    if uninstall_handlers or (uninstall_handlers is None and context is None):
        uninstall_signal_handlers()


def try_shutdown(
    *, context: Context | None = None, uninstall_handlers: bool | None = None
) -> None:
    """End what `init` began, if it has not ended before.

    Args:
        context: The context to shut down; None for the default one.
        uninstall_handlers: Put the signal handlers back; None means for the default context.
    """
    utilities.try_shutdown(context=context)
    if uninstall_handlers or (uninstall_handlers is None and context is None):
        uninstall_signal_handlers()


def create_node(
    node_name: str,
    *,
    context: Context | None = None,
    cli_args: list[str] | None = None,
    namespace: str | None = None,
    use_global_arguments: bool = True,
    enable_rosout: bool = True,
    rosout_qos_profile: QoSProfile | int = qos_profile_rosout_default,
    start_parameter_services: bool = True,
    parameter_overrides: list[Parameter] | None = None,
    allow_undeclared_parameters: bool = False,
    automatically_declare_parameters_from_overrides: bool = False,
    enable_logger_service: bool = False,
) -> Node:
    """Create a node; the arguments are those of rclpy.node.Node."""
    return Node(
        node_name,
        context=context,
        cli_args=cli_args,
        namespace=namespace,
        use_global_arguments=use_global_arguments,
        enable_rosout=enable_rosout,
        rosout_qos_profile=rosout_qos_profile,
        start_parameter_services=start_parameter_services,
        parameter_overrides=parameter_overrides,
        allow_undeclared_parameters=allow_undeclared_parameters,
        automatically_declare_parameters_from_overrides=(
            automatically_declare_parameters_from_overrides
        ),
        enable_logger_service=enable_logger_service,
    )


def spin_once(
    node: Node, *, executor: Executor | None = None, timeout_sec: float | None = None
) -> None:
    """Run one callback of a node, or wait in vain for `timeout_sec`.

    Args:
        node: The node to serve.
        executor: The executor; None for the global one.
        timeout_sec: How long to wait at most [s]; None and negative mean for ever.
    """
    executor = get_global_executor() if executor is None else executor
    try:
        executor.add_node(node)
        executor.spin_once(timeout_sec=timeout_sec)
    finally:
        executor.remove_node(node)


def spin(node: Node, executor: Executor | None = None) -> None:
    """Run a node's callbacks until the context is shut down.

    Args:
        node: The node to serve.
        executor: The executor; None for the global one.

    Raises:
        ExternalShutdownException: if a signal or another thread shuts the context down.
    """
    executor = get_global_executor() if executor is None else executor
    try:
        executor.add_node(node)
        while executor.context.ok():
            executor.spin_once()
    finally:
        executor.remove_node(node)


def spin_until_future_complete(
    node: Node,
    future: Future[Any],
    executor: Executor | None = None,
    timeout_sec: float | None = None,
) -> None:
    """Run a node's callbacks until a future is done or the time is over.

    Args:
        node: The node to serve.
        future: What to wait for.
        executor: The executor; None for the global one.
        timeout_sec: How long at most [s]; None and negative mean for ever.
    """
    executor = get_global_executor() if executor is None else executor
    try:
        executor.add_node(node)
        executor.spin_until_future_complete(future, timeout_sec)
    finally:
        executor.remove_node(node)
