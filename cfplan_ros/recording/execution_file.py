"""An execution as an MCAP file, with the topics of a recorded run."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from cfplan_msgs.msg import JointTorqueLimits, JointTorqueLimitsPoint, ManipulationPlan
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from visualization_msgs.msg import MarkerArray

from cfplan_core.contact.elements import parse_contact
from cfplan_core.contact.system import ContactSystem
from cfplan_core.errors import CfplanError
from cfplan_core.execution.execute import Execution
from cfplan_core.model import Grasp
from cfplan_core.report.scene import contact_marks
from cfplan_core.trajectory.plan_result import PlanResult
from cfplan_ros.conversions.plans import plan_message
from cfplan_ros.conversions.poses import pose_message
from cfplan_ros.conversions.times import stamp_of
from cfplan_ros.planning_service import plan_messages
from cfplan_ros.recording.provenance import RECORD, provenance
from cfplan_ros.recording.run_file import RunFile, failure_reason
from cfplan_ros.recording.topics import full_name, qos_by_topic
from cfplan_ros.visualization.frames import (
    WORLD_FRAME,
    moving_transforms,
    static_transforms,
)
from cfplan_ros.visualization.markers import ContactPainter, scene_markers
from cfplan_ros.visualization.motion import Contacts, read_motion
from cfplan_ros.visualization.preview import (
    CONTACT_MARKERS,
    JOINT_STATES,
    OBJECT_POSE,
    TORQUE_LIMITS,
    TRANSFORMS,
)

NODE = '/cfplan_planner'
# Forces below this are rounding, N.
_LEAST_FORCE = 1e-9


def write_execution(path: Path, result: PlanResult, execution: Execution, start_time: int) -> None:
    """Write the plan, and what was measured in place of the plan played in time.

    Args:
        path: Ends in ``.mcap``; there may be no such file yet. Its folder is made if missing.
        result: The plan.
        execution: Of the plan.
        start_time: When it began, ns since the epoch.

    Raises:
        CfplanError: The file exists already or cannot be written.
    """
    plan = plan_message(result, WORLD_FRAME, stamp_of(start_time))
    qos = qos_by_topic(NODE)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        file = RunFile([path])
    except OSError as error:
        raise CfplanError(f'cannot write {failure_reason(error, path)}') from None
    try:
        metadata = {'execution': {'engine': 'mujoco', 'friction': execution.world.friction}}
        file.add_metadata(RECORD, provenance(NODE, start_time, metadata))
        for topic, message in plan_messages(plan):
            name = full_name(topic, NODE)
            file.add(name, message, start_time, qos[name])
        for time, topic, message in _measured(execution, plan, start_time):
            name = full_name(topic, NODE)
            file.add(name, message, time, qos[name])
        file.close()
    except OSError as error:
        file.abandon()
        raise CfplanError(f'cannot write {failure_reason(error, path)}') from None


def _measured(
    execution: Execution, plan: ManipulationPlan, start_time: int
) -> Iterator[tuple[int, str, Any]]:
    """Time in ns, topic and message of all that viewers are shown, in the order of time."""
    problem, run = execution.world.problem, execution.run
    world, hand = plan.header.frame_id, problem.hand
    motion = read_motion(problem, plan)
    yield start_time, '/tf_static', static_transforms(hand, world, plan.header.stamp)
    yield start_time, 'markers', scene_markers(problem, plan)
    painter = ContactPainter(problem, motion)
    system = ContactSystem(problem)
    ends = np.array([segment.last_frame for segment in motion.segments])
    times = np.array(motion.times)
    for k, elapsed in enumerate(run.times):
        time = start_time + round(elapsed * 1e9)
        stamp = stamp_of(time)
        header = Header(stamp=stamp, frame_id=world)
        grasp = Grasp(run.object_poses[k], run.joints[k])
        yield time, TRANSFORMS, moving_transforms(hand, grasp, world, stamp)
        yield (
            time,
            JOINT_STATES,
            JointState(
                header=Header(stamp=stamp),
                name=list(hand.joint_names),
                position=run.joints[k].tolist(),
                velocity=run.joint_velocities[k].tolist(),
                effort=run.torques[k].tolist(),
            ),
        )
        pose = pose_message(grasp.object_pose)
        yield time, OBJECT_POSE, PoseStamped(header=header, pose=pose)

        number = int(execution.reference.segments[run.rows[k]])
        contacts = _pressing(system, grasp, motion.segments[number].contacts, run.forces[k])
        frame = min(int(np.searchsorted(times, elapsed * 1e9)), int(ends[number]))
        bounds = plan.torque_limits.points[frame]
        limits = dict(
            zip(hand.joint_names, zip(bounds.lower, bounds.upper, strict=True), strict=True)
        )
        markers = painter.paint(contacts, header)
        markers += painter.removals(markers, header)
        markers.append(painter.caption(contacts, number, limits, header))
        yield time, CONTACT_MARKERS, MarkerArray(markers=markers)
        yield (
            time,
            TORQUE_LIMITS,
            JointTorqueLimits(
                header=Header(stamp=stamp),
                joint_names=list(hand.joint_names),
                points=[
                    JointTorqueLimitsPoint(
                        lower=bounds.lower, upper=bounds.upper, nominal=run.torques[k].tolist()
                    )
                ],
            ),
        )


def _pressing(
    system: ContactSystem, grasp: Grasp, planned: tuple[str, ...], forces: Any
) -> Contacts:
    """Those of the planned contacts that press, with the forces that were measured."""
    pairs = [system.pair(parse_contact(name)) for name in planned]
    vertices = system.pair_vertex[pairs]
    bodies = system.body_of[system.pair_edge[pairs]]
    pressing = forces[vertices, bodies]
    kept = [k for k in range(len(planned)) if pressing[k] > _LEAST_FORCE]
    marks = contact_marks(system.problem, grasp, [planned[k] for k in kept])
    return Contacts(
        tuple(mark.name for mark in marks),
        np.array([mark.point for mark in marks]).reshape(-1, 2),
        np.array([mark.normal for mark in marks]).reshape(-1, 2),
        pressing[kept],
    )
