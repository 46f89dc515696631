"""The node: a name in the graph that publishers, services and the rest belong to."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Iterator
from types import TracebackType
from typing import TYPE_CHECKING, Any, TypeVar

from rcl_interfaces.msg import Log, ParameterDescriptor, ParameterEvent
from rclpy import _arguments, type_support
from rclpy._node_graph import GraphQueries
from rclpy._node_parameter_methods import ParameterMethods
from rclpy._node_parameters import NodeParameters
from rclpy._remapping import Names
from rclpy._rosout import ROSOUT_TOPIC, Rosout
from rclpy.callback_groups import CallbackGroup, MutuallyExclusiveCallbackGroup
from rclpy.client import Client
from rclpy.clock import Clock, ROSClock
from rclpy.constants import S_TO_NS
from rclpy.context import Context
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.exceptions import InvalidHandle, NotInitializedException
from rclpy.guard_condition import GuardCondition
from rclpy.logging import get_logger
from rclpy.parameter import Parameter
from rclpy.parameter_service import ParameterService
from rclpy.publisher import Publisher
from rclpy.qos import (
    QoSProfile,
    qos_profile_parameter_events,
    qos_profile_rosout_default,
    qos_profile_services_default,
)
from rclpy.service import Service
from rclpy.subscription import Subscription, callback_type
from rclpy.time_source import TimeSource
from rclpy.timer import Rate, Timer
from rclpy.type_description_service import TypeDescriptionService
from rclpy.utilities import get_default_context
from ros_standalone import interfaces

if TYPE_CHECKING:
    from rclpy.executors import Executor
    from rclpy.impl.rcutils_logger import RcutilsLogger

EntityT = TypeVar('EntityT')


class Node(ParameterMethods, GraphQueries):
    """A node.

    Args:
        node_name: Its name, which remapping may change.
        context: The context; None for the default one.
        cli_args: Arguments for this node alone, ROS's after '--ros-args'.
        namespace: Its namespace, which remapping may change.
        use_global_arguments: Whether the process's arguments count, too.
        enable_rosout: Whether what the node logs is published on /rosout.
        rosout_qos_profile: Quality of service or depth of that publisher.
        start_parameter_services: Whether others can read and set the parameters.
        parameter_overrides: Values for parameters, before those of their declarations.
        allow_undeclared_parameters: Whether parameters need no declaration.
        automatically_declare_parameters_from_overrides: Declare all parameters that were given.
        enable_logger_service: Services for the log level; not covered.

    Raises:
        NotInitializedException: if the context is not initialised or was shut down.
        InvalidNodeNameException: if the name is not valid.
        InvalidNamespaceException: if the namespace is not valid.
    """

    def __init__(
        self,
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
    ) -> None:
        self._context = get_default_context() if context is None else context
        self._publishers: list[Publisher[Any]] = []
        self._subscriptions: list[Subscription[Any]] = []
        self._clients: list[Client] = []
        self._services: list[Service] = []
        self._timers: list[Timer] = []
        self._guards: list[GuardCondition] = []
        self._rates: dict[Rate, Timer] = {}
        self._executor: weakref.ref[Executor] | None = None
        self._rosout: Rosout | None = None
        self._destroyed = True
        self._default_callback_group: CallbackGroup = MutuallyExclusiveCallbackGroup()
        if not self._context.ok():
            raise NotInitializedException('cannot create node')
        if enable_logger_service:
            raise NotImplementedError(
                'enable_logger_service is not part of the standalone rclpy; '
                'use --log-level or rclpy.logging.set_logger_level'
            )
        arguments = _effective_arguments(self._context, cli_args, use_global_arguments)
        self._names = Names(node_name, namespace, arguments.remappings)
        self._handle = self._context.participant.add_node(self._names.name, self._names.namespace)
        self._destroyed = False
        self._context.track_node(self)
        try:
            self._set_up(
                arguments,
                rosout_qos_profile if enable_rosout and arguments.rosout_logs else None,
                parameter_overrides or [],
                allow_undeclared_parameters,
                automatically_declare_parameters_from_overrides,
                start_parameter_services,
            )
        except BaseException:
            self.destroy_node()
            raise

    def _set_up(
        self,
        arguments: _arguments.Arguments,
        rosout_qos_profile: QoSProfile | int | None,
        parameter_overrides: list[Parameter],
        allow_undeclared_parameters: bool,
        declare_overrides: bool,
        start_parameter_services: bool,
    ) -> None:
        """Create what every node has: clock, logger, parameters and their services."""
        self._clock = ROSClock()
        self._logger = get_logger(self._names.logger_name)
        if rosout_qos_profile is not None:
            log = self.create_publisher(Log, ROSOUT_TOPIC, rosout_qos_profile)
            self._rosout = Rosout(self._names.logger_name, log.publish)
        events = self.create_publisher(
            ParameterEvent, '/parameter_events', qos_profile_parameter_events
        )
        full_name = self.get_fully_qualified_name()
        overrides = {
            name: Parameter(name, value=value)
            for name, value in arguments.parameter_overrides(full_name).items()
        }
        overrides.update({parameter.name: parameter for parameter in parameter_overrides})
        self._parameters = NodeParameters(
            full_name,
            events.publish,
            self._clock.now,
            overrides=overrides,
            allow_undeclared=allow_undeclared_parameters,
        )
        if declare_overrides:
            self._parameters.declare_parameters(
                '',
                [
                    (name, parameter.value, ParameterDescriptor(dynamic_typing=True))
                    for name, parameter in overrides.items()
                ],
                ignore_override=True,
            )
        self._time_source = TimeSource(node=self)
        self._time_source.attach_clock(self._clock)
        if start_parameter_services:
            self._parameter_service = ParameterService(self)
        self._type_description_service = TypeDescriptionService(self)

    @property
    def publishers(self) -> Iterator[Publisher[Any]]:
        """The publishers that the node has."""
        yield from list(self._publishers)

    @property
    def subscriptions(self) -> Iterator[Subscription[Any]]:
        """The subscriptions that the node has."""
        yield from list(self._subscriptions)

    @property
    def clients(self) -> Iterator[Client]:
        """The service clients that the node has."""
        yield from list(self._clients)

    @property
    def services(self) -> Iterator[Service]:
        """The services that the node offers."""
        yield from list(self._services)

    @property
    def timers(self) -> Iterator[Timer]:
        """The timers that the node has."""
        yield from list(self._timers)

    @property
    def guards(self) -> Iterator[GuardCondition]:
        """The guard conditions that the node has."""
        yield from list(self._guards)

    @property
    def context(self) -> Context:
        """The context that the node lives in."""
        return self._context

    @property
    def default_callback_group(self) -> CallbackGroup:
        """The group of callbacks that are given none: one runs at a time."""
        return self._default_callback_group

    @property
    def executor(self) -> Executor | None:
        """The executor that serves the node; assigning moves the node to another."""
        return None if self._executor is None else self._executor()

    @executor.setter
    def executor(self, new_executor: Executor | None) -> None:
        current = self.executor
        if current is new_executor:
            return
        if current is not None:
            current.remove_node(self)
        self._executor = None
        if new_executor is not None:
            self._executor = weakref.ref(new_executor)
            new_executor.add_node(self)

    @property
    def handle(self) -> Any:
        """Not covered: there is no C library behind this node."""
        raise NotImplementedError('Node.handle is not part of the standalone rclpy')

    def get_name(self) -> str:
        """Return the name."""
        return self._names.name

    def get_namespace(self) -> str:
        """Return the namespace, '/' for none."""
        return self._names.namespace

    def get_fully_qualified_name(self) -> str:
        """Return namespace and name."""
        return self._names.fully_qualified_name

    def get_clock(self) -> Clock:
        """Return the node's clock: the time of day, or /clock where use_sim_time is true."""
        return self._clock

    def get_logger(self) -> RcutilsLogger:
        """Return the node's logger."""
        return self._logger

    def resolve_topic_name(self, topic: str, *, only_expand: bool = False) -> str:
        """Return the full name of a topic, remapped unless `only_expand` is set."""
        return self._names.topic(topic, only_expand=only_expand)

    def resolve_service_name(self, service: str, *, only_expand: bool = False) -> str:
        """Return the full name of a service, remapped unless `only_expand` is set."""
        return self._names.service(service, only_expand=only_expand)

    def create_publisher(
        self,
        msg_type: type[Any],
        topic: str,
        qos_profile: QoSProfile | int,
        *,
        callback_group: CallbackGroup | None = None,
        event_callbacks: PublisherEventCallbacks | None = None,
        qos_overriding_options: Any = None,
        publisher_class: type[Publisher[Any]] = Publisher,
    ) -> Publisher[Any]:
        """Create a publisher.

        Args:
            msg_type: The message class.
            topic: The topic's name: absolute, relative to the namespace, or '~/' for private.
            qos_profile: Quality of service, or the depth of a reliable volatile history.
            callback_group: The group that event callbacks would belong to.
            event_callbacks: QoS events; not covered.
            qos_overriding_options: QoS by parameters; not covered.
            publisher_class: A subclass of Publisher to be made instead.
        """
        qos = _qos_or_depth(qos_profile)
        _refuse_qos_overriding(qos_overriding_options)
        type_name = type_support.check_is_valid_msg_type(msg_type)
        full_name = self._names.topic(topic)
        writer = self._context.participant.create_writer(
            self._checked_handle(), full_name, type_name, interfaces.type_hash(msg_type), qos
        )
        publisher = publisher_class(
            writer,
            msg_type,
            topic,
            full_name,
            qos,
            callback_group or self._default_callback_group,
            self._context,
        )
        self._publishers.append(publisher)
        return publisher

    def create_subscription(
        self,
        msg_type: type[Any],
        topic: str,
        callback: Callable[..., Any],
        qos_profile: QoSProfile | int,
        *,
        callback_group: CallbackGroup | None = None,
        event_callbacks: SubscriptionEventCallbacks | None = None,
        qos_overriding_options: Any = None,
        raw: bool = False,
    ) -> Subscription[Any]:
        """Create a subscription.

        Args:
            msg_type: The message class.
            topic: The topic's name: absolute, relative to the namespace, or '~/' for private.
            callback: Called with the message, or with the message and its MessageInfo.
            qos_profile: Quality of service, or the depth of a reliable volatile history.
            callback_group: The group that the callback belongs to.
            event_callbacks: QoS events; not covered.
            qos_overriding_options: QoS by parameters; not covered.
            raw: Give the callback the CDR bytes instead of the message.
        """
        qos = _qos_or_depth(qos_profile)
        _refuse_qos_overriding(qos_overriding_options)
        callback_type(callback)
        type_name = type_support.check_is_valid_msg_type(msg_type)
        full_name = self._names.topic(topic)
        reader = self._context.participant.create_reader(
            self._checked_handle(), full_name, type_name, interfaces.type_hash(msg_type), qos
        )
        group = callback_group or self._default_callback_group
        subscription = Subscription(reader, msg_type, topic, full_name, callback, group, qos, raw)
        return self._adopt(subscription, self._subscriptions, group)

    def create_client(
        self,
        srv_type: Any,
        srv_name: str,
        *,
        qos_profile: QoSProfile = qos_profile_services_default,
        callback_group: CallbackGroup | None = None,
    ) -> Client:
        """Create a service client.

        Args:
            srv_type: The service class.
            srv_name: The service's name: absolute, relative to the namespace, or '~/'.
            qos_profile: Quality of service.
            callback_group: The group that the arrival of responses belongs to.
        """
        type_name = type_support.check_is_valid_srv_type(srv_type)
        full_name = self._names.service(srv_name)
        client = self._context.participant.create_client(
            self._checked_handle(),
            full_name,
            type_name,
            interfaces.type_hash(srv_type),
            qos_profile,
        )
        group = callback_group or self._default_callback_group
        return self._adopt(
            Client(self._context, client, srv_type, srv_name, full_name, qos_profile, group),
            self._clients,
            group,
        )

    def create_service(
        self,
        srv_type: Any,
        srv_name: str,
        callback: Callable[[Any, Any], Any],
        *,
        qos_profile: QoSProfile = qos_profile_services_default,
        callback_group: CallbackGroup | None = None,
    ) -> Service:
        """Offer a service.

        Args:
            srv_type: The service class.
            srv_name: The service's name: absolute, relative to the namespace, or '~/'.
            callback: Called with the request and an empty response; returns the response.
            qos_profile: Quality of service.
            callback_group: The group that the callback belongs to.
        """
        type_name = type_support.check_is_valid_srv_type(srv_type)
        full_name = self._names.service(srv_name)
        server = self._context.participant.create_server(
            self._checked_handle(),
            full_name,
            type_name,
            interfaces.type_hash(srv_type),
            qos_profile,
        )
        group = callback_group or self._default_callback_group
        return self._adopt(
            Service(server, srv_type, srv_name, full_name, callback, group, qos_profile),
            self._services,
            group,
        )

    def create_timer(
        self,
        timer_period_sec: float,
        callback: Callable[..., Any] | None,
        callback_group: CallbackGroup | None = None,
        clock: Clock | None = None,
        autostart: bool = True,
    ) -> Timer:
        """Call `callback` once every period.

        Args:
            timer_period_sec: The period [s].
            callback: Function or coroutine function, without arguments or with a TimerInfo.
            callback_group: The group that the callback belongs to.
            clock: The clock that counts; None for the node's.
            autostart: Whether to start at once; else `Timer.reset` starts it.
        """
        self._checked_handle()
        group = callback_group or self._default_callback_group
        timer = Timer(
            callback,
            group,
            int(float(timer_period_sec) * S_TO_NS),
            self._clock if clock is None else clock,
            context=self._context,
            autostart=autostart,
            wake=self._wake_executor,
        )
        return self._adopt(timer, self._timers, group)

    def create_guard_condition(
        self,
        callback: Callable[[], Any] | None,
        callback_group: CallbackGroup | None = None,
    ) -> GuardCondition:
        """Have `callback` run by the executor whenever the guard condition was triggered."""
        self._checked_handle()
        group = callback_group or self._default_callback_group
        guard = GuardCondition(callback, group, self._context, wake=self._wake_executor)
        return self._adopt(guard, self._guards, group)

    def create_rate(self, frequency: float, clock: Clock | None = None) -> Rate:
        """Return what sleeps to a beat, while the node's executor spins in another thread.

        Args:
            frequency: Beats per second, above zero.
            clock: The clock that counts; None for the node's.

        Raises:
            ValueError: if the frequency is not above zero.
        """
        if frequency <= 0:
            raise ValueError('frequency must be > 0')
        timer = self.create_timer(
            1.0 / frequency, None, callback_group=MutuallyExclusiveCallbackGroup(), clock=clock
        )
        rate = Rate(timer, context=self._context)
        self._rates[rate] = timer
        return rate

    def destroy_publisher(self, publisher: Publisher[Any]) -> bool:
        """Destroy a publisher of this node; return whether it is one."""
        return self._destroy(publisher, self._publishers)

    def destroy_subscription(self, subscription: Subscription[Any]) -> bool:
        """Destroy a subscription of this node; return whether it is one."""
        return self._destroy(subscription, self._subscriptions)

    def destroy_client(self, client: Client) -> bool:
        """Destroy a client of this node; return whether it is one."""
        return self._destroy(client, self._clients)

    def destroy_service(self, service: Service) -> bool:
        """Destroy a service of this node; return whether it is one."""
        return self._destroy(service, self._services)

    def destroy_timer(self, timer: Timer) -> bool:
        """Destroy a timer of this node; return whether it is one."""
        return self._destroy(timer, self._timers)

    def destroy_guard_condition(self, guard: GuardCondition) -> bool:
        """Destroy a guard condition of this node; return whether it is one."""
        return self._destroy(guard, self._guards)

    def destroy_rate(self, rate: Rate) -> bool:
        """Destroy a rate of this node and wake who sleeps on it; return whether it is one."""
        timer = self._rates.pop(rate, None)
        if timer is None:
            return False
        rate.destroy()
        return self.destroy_timer(timer)

    def destroy_node(self) -> None:
        """Destroy everything that the node has and take it off the graph."""
        if self._destroyed:
            return
        self._destroyed = True
        self._context.untrack_node(self)
        if self._rosout is not None:
            self._rosout.close()
        for rate in list(self._rates):
            self.destroy_rate(rate)
        for owned in (
            self._services,
            self._clients,
            self._subscriptions,
            self._timers,
            self._guards,
            self._publishers,
        ):
            for entity in list(owned):
                self._destroy(entity, owned)
        self._context.participant.remove_node(self._handle)
        self._wake_executor()

    def _adopt(self, entity: EntityT, owned: list[EntityT], group: CallbackGroup) -> EntityT:
        group.add_entity(entity)
        owned.append(entity)
        self._wake_executor()
        return entity

    def _destroy(self, entity: Any, owned: list[Any]) -> bool:
        if entity not in owned:
            return False
        owned.remove(entity)
        entity.destroy()
        self._wake_executor()
        return True

    def _entities(self) -> list[Any]:
        """Return what an executor waits for, in the order in which it is served."""
        return [
            *self._timers,
            *self._subscriptions,
            *self._guards,
            *self._clients,
            *self._services,
        ]

    def _wake_executor(self) -> None:
        executor = self.executor
        if executor is not None:
            executor.wake()

    def _checked_handle(self) -> Any:
        if self._destroyed:
            raise InvalidHandle('cannot use Destroyable because destruction was requested')
        return self._handle

    def __enter__(self) -> Node:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.destroy_node()


def _effective_arguments(
    context: Context, cli_args: list[str] | None, use_global: bool
) -> _arguments.Arguments:
    """Return the node's own arguments and then, if they count, those of the process."""
    own = _arguments.parse(cli_args or [])
    if not use_global:
        return own
    shared = context.arguments
    return _arguments.Arguments(
        remappings=own.remappings + shared.remappings,
        # Of parameters the last one counts, of remappings the first.
        parameters=shared.parameters + own.parameters,
        rosout_logs=own.rosout_logs and shared.rosout_logs,
    )


def _qos_or_depth(value: QoSProfile | int) -> QoSProfile:
    if isinstance(value, QoSProfile):
        return value
    if not isinstance(value, int):
        raise TypeError(f'Expected QoSProfile or int, but received {type(value)!r}')
    if value < 0:
        raise ValueError('history depth must be greater than or equal to zero')
    return QoSProfile(depth=value)


def _refuse_qos_overriding(options: Any) -> None:
    if options is not None:
        raise NotImplementedError(
            'qos_overriding_options is not part of the standalone rclpy; '
            'give the QoSProfile itself'
        )
