"""A plan played in time, as the messages that a viewer animates.

The same messages are published live, recorded, and added to a run that was cut short.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from cfplan_msgs.msg import JointTorqueLimits, ManipulationPlan
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from visualization_msgs.msg import MarkerArray

from cfplan_core.model import Problem
from cfplan_ros.conversions.poses import pose_message
from cfplan_ros.conversions.times import stamp_of
from cfplan_ros.visualization.frames import moving_transforms
from cfplan_ros.visualization.markers import ContactPainter
from cfplan_ros.visualization.motion import read_motion

TRANSFORMS = '/tf'
JOINT_STATES = '~/joint_states'
OBJECT_POSE = '~/object_pose'
CONTACT_MARKERS = '~/contact_markers'
TORQUE_LIMITS = '~/preview/torque_limits'


def preview(
    problem: Problem, plan: ManipulationPlan, start_time: int, speed: float = 1.0
) -> Iterator[tuple[int, str, Any]]:
    """Play a plan.

    Args:
        problem: What was planned.
        plan: Its plan; its frame id is the world's. Without points there is nothing to play.
        start_time: When the plan starts, ns since the epoch.
        speed: How many seconds of the plan pass in one second.

    Yields:
        Time in ns since the epoch, topic, and message: for each point of the plan one message of
        each topic, in the order of time. The time is also the message's stamp.

    Raises:
        CfplanError: The plan is of another hand or object.
    """
    motion = read_motion(problem, plan)
    if not len(motion):
        return
    world_frame, hand = plan.header.frame_id, problem.hand
    painter = ContactPainter(problem, motion)
    shown: set[tuple[str, int]] | None = None
    for k, elapsed in enumerate(motion.times):
        time = start_time + (elapsed if speed == 1.0 else round(elapsed / speed))
        stamp = stamp_of(time)
        header = Header(stamp=stamp, frame_id=world_frame)
        grasp = motion.grasp(k)
        yield time, TRANSFORMS, moving_transforms(hand, grasp, world_frame, stamp)

        point = plan.joint_trajectory.points[k]
        yield (
            time,
            JOINT_STATES,
            JointState(
                header=Header(stamp=stamp),
                name=list(hand.joint_names),
                position=point.positions,
                velocity=point.velocities,
            ),
        )
        pose = pose_message(grasp.object_pose)
        yield time, OBJECT_POSE, PoseStamped(header=header, pose=pose)

        contacts = motion.contacts_at(k)
        markers = painter.paint(contacts, header)
        present = {(marker.ns, marker.id) for marker in markers}
        if shown is None or not shown <= present:
            markers += painter.removals(markers, header)
        shown = present
        bounds = plan.torque_limits.points[k]
        limits = dict(
            zip(hand.joint_names, zip(bounds.lower, bounds.upper, strict=True), strict=True)
        )
        markers.append(painter.caption(contacts, motion.segment_of[k], limits, header))
        yield time, CONTACT_MARKERS, MarkerArray(markers=markers)

        yield (
            time,
            TORQUE_LIMITS,
            JointTorqueLimits(
                header=Header(stamp=stamp),
                joint_names=list(hand.joint_names),
                points=[bounds],
            ),
        )
