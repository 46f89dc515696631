"""Where a node's clock gets its time: the system, or /clock when `use_sim_time` is set."""

from __future__ import annotations

import weakref
from typing import TYPE_CHECKING, Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import ROSClock
from rclpy.clock_type import ClockType
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.time import Time
from rosgraph_msgs.msg import Clock as ClockMsg

if TYPE_CHECKING:
    from rclpy.node import Node

CLOCK_TOPIC = '/clock'
USE_SIM_TIME_NAME = 'use_sim_time'


class TimeSource:
    """Feeds clocks of ROS time, and declares `use_sim_time` on a node.

    Args:
        node: The node whose parameter counts; held weakly.
    """

    def __init__(self, *, node: Node | None = None) -> None:
        self._subscription: Any = None
        self._node_reference: weakref.ref[Node] | None = None
        self._clocks: list[ROSClock] = []
        self._last_time = Time(clock_type=ClockType.ROS_TIME)
        self._active = False
        if node is not None:
            self.attach_node(node)

    @property
    def ros_time_is_active(self) -> bool:
        """Whether the time comes from /clock."""
        return self._active

    @ros_time_is_active.setter
    def ros_time_is_active(self, enabled: bool) -> None:
        if self._active == enabled:
            return
        self._active = enabled
        for clock in self._clocks:
            clock._set_ros_time_is_active(enabled)
        if enabled:
            self._subscribe()
        else:
            self._unsubscribe()

    def attach_node(self, node: Node) -> None:
        """Follow a node's `use_sim_time`, declaring it if need be."""
        from rclpy.node import Node

        if not isinstance(node, Node):
            raise TypeError('Node must be of type rclpy.node.Node')
        if self._node_reference is not None:
            self.detach_node()
        self._node_reference = weakref.ref(node)
        if not node.has_parameter(USE_SIM_TIME_NAME):
            node.declare_parameter(USE_SIM_TIME_NAME, False)
        parameter = node.get_parameter(USE_SIM_TIME_NAME)
        if parameter.type_ is Parameter.Type.BOOL:
            self.ros_time_is_active = parameter.value
        else:
            node.get_logger().error(
                f"Invalid type for parameter '{USE_SIM_TIME_NAME}' {parameter.type_!r} "
                'should be bool'
            )
        node.add_on_set_parameters_callback(self._on_set_parameters)

    def detach_node(self) -> None:
        """Follow no node; the clocks return to the system's time."""
        self.ros_time_is_active = False
        node = self._node()
        if node is not None:
            node.remove_on_set_parameters_callback(self._on_set_parameters)
        self._node_reference = None

    def attach_clock(self, clock: ROSClock) -> None:
        """Feed a clock.

        Raises:
            ValueError: If the clock is not of ROS_TIME.
            TypeError: If it is no ROSClock.
        """
        if getattr(clock, 'clock_type', ClockType.ROS_TIME) is not ClockType.ROS_TIME:
            raise ValueError('Only clocks with type ROS_TIME can be attached.')
        if not isinstance(clock, ROSClock):
            raise TypeError('Clock must be of type rclpy.clock.ROSClock')
        clock.set_ros_time_override(self._last_time)
        clock._set_ros_time_is_active(self._active)
        self._clocks.append(clock)

    def clock_callback(self, msg: ClockMsg) -> None:
        """Take a time from /clock."""
        self._last_time = Time.from_msg(msg.clock)
        for clock in self._clocks:
            clock.set_ros_time_override(self._last_time)

    def _node(self) -> Node | None:
        return None if self._node_reference is None else self._node_reference()

    def _subscribe(self) -> None:
        node = self._node()
        if node is not None and self._subscription is None:
            self._subscription = node.create_subscription(
                ClockMsg,
                CLOCK_TOPIC,
                self.clock_callback,
                QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT),
            )

    def _unsubscribe(self) -> None:
        node = self._node()
        if node is not None and self._subscription is not None:
            node.destroy_subscription(self._subscription)
        self._subscription = None

    def _on_set_parameters(self, parameters: list[Parameter]) -> SetParametersResult:
        for parameter in parameters:
            if parameter.name != USE_SIM_TIME_NAME:
                continue
            if parameter.type_ is not Parameter.Type.BOOL:
                reason = f'{USE_SIM_TIME_NAME} parameter set to something besides a bool'
                node = self._node()
                if node is not None:
                    node.get_logger().error(reason)
                return SetParametersResult(successful=False, reason=reason)
            self.ros_time_is_active = parameter.value
        return SetParametersResult(successful=True)
