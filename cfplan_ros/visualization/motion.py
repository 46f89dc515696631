"""A plan message read into arrays: what there is to be shown, instant by instant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from cfplan_msgs.msg import ManipulationPlan, PlanSegment

from cfplan_core.contact.system import ContactSystem
from cfplan_core.errors import CfplanError
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_forces import ContactForces, Stretch, contact_forces
from cfplan_core.model import Grasp, Problem
from cfplan_core.report.scene import segment_at
from cfplan_core.trajectory.plan_result import Segment
from cfplan_ros.conversions.contacts import contact_names
from cfplan_ros.conversions.stabilities import NAMES
from cfplan_ros.conversions.times import nanoseconds_of


@dataclass(frozen=True, eq=False)
class Motion:
    """The points of a plan.

    Attributes:
        times: ns from the plan's start, one for each point.
        joints: Shape (f, n), rad.
        object_poses: Shape (f, 3), of the object's frame: m, m, rad with whole turns counted.
        segments: Cover all points; neighbours share a point.
        segment_of: For each point the index of its segment; of two that share it, the later.
        forces: For each segment its contacts, at all its points.
    """

    times: tuple[int, ...]
    joints: FloatArray
    object_poses: FloatArray
    segments: tuple[Segment, ...]
    segment_of: tuple[int, ...]
    forces: tuple[ContactForces, ...]

    def __len__(self) -> int:
        return len(self.times)

    def grasp(self, point: int) -> Grasp:
        """Configuration at a point."""
        return Grasp(self.object_poses[point], self.joints[point])

    def contacts_at(self, point: int) -> Contacts:
        """Contacts and their forces at a point."""
        index = self.segment_of[point]
        segment, forces = self.segments[index], self.forces[index]
        row = point - segment.first_frame
        return Contacts(
            segment.contacts, forces.points[row], forces.normals[row], forces.forces[row]
        )

    @property
    def largest_force(self) -> float:
        """Largest contact force of all points, N; zero if there is none."""
        finite = [f.forces[np.isfinite(f.forces)] for f in self.forces]
        return float(np.concatenate([*finite, [0.0]]).max())


@dataclass(frozen=True, eq=False)
class Contacts:
    """The k contacts of one configuration; see `ContactForces` for units and frames.

    Attributes:
        names: Of the elemental contacts.
        points: Shape (k, 2).
        normals: Shape (k, 2).
        forces: Shape (k,).
    """

    names: tuple[str, ...]
    points: FloatArray
    normals: FloatArray
    forces: FloatArray


def read_motion(problem: Problem, plan: ManipulationPlan) -> Motion:
    """Read a plan and find its contact forces.

    Args:
        problem: What was planned.
        plan: Its plan; without points if there is none.

    Raises:
        CfplanError: The plan is of another hand or object.
    """
    points = plan.joint_trajectory.points
    names = tuple(plan.joint_trajectory.joint_names)
    if points and names != problem.hand.joint_names:
        raise CfplanError(
            f'plan must have the joints {", ".join(problem.hand.joint_names)} in this order, '
            f'has {", ".join(names)}'
        )
    joints = np.array([p.positions for p in points], dtype=np.float64)
    joints = joints.reshape(len(points), len(problem.hand.joints))
    positions = [(pose.position.x, pose.position.y) for pose in plan.object_poses]
    poses = np.column_stack(
        [np.array(positions, dtype=np.float64).reshape(-1, 2), np.array(plan.object_angles)]
    )
    segments = tuple(_segment(segment) for segment in plan.segments)
    return Motion(
        tuple(nanoseconds_of(point.time_from_start) for point in points),
        joints,
        poses,
        segments,
        tuple(segment_at(segments, k) for k in range(len(points))),
        contact_forces(
            ContactSystem(problem),
            [
                Stretch(
                    s.contacts,
                    poses[s.first_frame : s.last_frame + 1],
                    joints[s.first_frame : s.last_frame + 1],
                )
                for s in segments
            ],
        ),
    )


def _segment(segment: PlanSegment) -> Segment:
    stability = NAMES.get(segment.stability, '')
    contacts = contact_names(segment.contact_formation)
    return Segment(contacts, stability, segment.first_point, segment.last_point)
