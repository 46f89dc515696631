"""The topics of a run file, with type and quality of service."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from cfplan_msgs.msg import JointTorqueLimits, ManipulationPlan
from cfplan_msgs.srv import PlanManipulation
from geometry_msgs.msg import PoseStamped
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_services_default
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import MarkerArray

REQUEST = 'plan/request'
RESPONSE = 'plan/response'
PLAN = 'plan_result'

COMMAND = QoSProfile(depth=1)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
STREAM = QoSProfile(depth=10)


@dataclass(frozen=True)
class RecordedTopic:
    """A topic of a run file.

    Attributes:
        name: Below the node's name, or from the root if it starts with a slash.
        message_class: Type of its messages.
        qos: What the topic's publisher offers, and what playback shall offer.
    """

    name: str
    message_class: type[Any]
    qos: QoSProfile

    def full_name(self, node_name: str) -> str:
        """Name from the root, for a node's fully qualified name."""
        return full_name(self.name, node_name)


def full_name(topic: str, node_name: str) -> str:
    """Name from the root of a topic named from the root, after ``~/`` or below the node."""
    return topic if topic.startswith('/') else f'{node_name}/{topic.removeprefix("~/")}'


# What a plan consists of; complete in the file before the planner answers.
ESSENTIAL = (
    RecordedTopic(REQUEST, PlanManipulation.Request, qos_profile_services_default),
    RecordedTopic(RESPONSE, PlanManipulation.Response, qos_profile_services_default),
    RecordedTopic('joint_trajectory', JointTrajectory, COMMAND),
    RecordedTopic('torque_limits', JointTorqueLimits, COMMAND),
    RecordedTopic(PLAN, ManipulationPlan, LATCHED),
)
# What viewers are shown: the scene, then the plan played in time.
PREVIEW = (
    RecordedTopic('/tf_static', TFMessage, LATCHED),
    RecordedTopic('markers', MarkerArray, LATCHED),
    RecordedTopic('/tf', TFMessage, QoSProfile(depth=100)),
    RecordedTopic('joint_states', JointState, STREAM),
    RecordedTopic('object_pose', PoseStamped, STREAM),
    RecordedTopic('contact_markers', MarkerArray, STREAM),
    RecordedTopic('preview/torque_limits', JointTorqueLimits, STREAM),
)


def qos_by_topic(node_name: str) -> dict[str, QoSProfile]:
    """Quality of service of every topic, by full name, for a node's fully qualified name."""
    return {topic.full_name(node_name): topic.qos for topic in (*ESSENTIAL, *PREVIEW)}
