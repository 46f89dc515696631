"""Torques that a plan's drives are fed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cfplan_core.contact.elements import parse_contact
from cfplan_core.contact.gaps import gap_gradients
from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_forces import configurations, least_forces
from cfplan_core.trajectory.plan_result import PlanResult, Segment

FeedForward = Callable[[ContactSystem, PlanResult], tuple[FloatArray, ...]]
"""Takes a plan's system and the plan to torques for each segment, of shape (f, n), N·m."""


def segment_gradients(
    system: ContactSystem, result: PlanResult, segment: Segment
) -> tuple[FloatArray, FloatArray]:
    """Configurations and gap gradients of a segment's contacts at its frames.

    Args:
        system: Of the plan's problem.
        result: A solved plan.
        segment: One of its segments.

    Returns:
        Shapes (f, 3 + n) and (f, k, 3 + n), without units as `ContactSystem` has them.
    """
    frames = slice(segment.first_frame, segment.last_frame + 1)
    z = configurations(system, result.object_poses[frames], result.joints[frames])
    pairs = [system.pair(parse_contact(name)) for name in segment.contacts]
    gradients = gap_gradients(system, system.place(z), np.array(pairs, dtype=np.intp))
    return z, gradients


def least_torques(system: ContactSystem, result: PlanResult) -> tuple[FloatArray, ...]:
    """Torques of the equilibrium whose largest contact force is least.

    Returns:
        For each segment shape (f, n), N·m, with the links' weight.
    """
    torques = []
    for segment in result.segments:
        z, gradients = segment_gradients(system, result, segment)
        forces = least_forces(gradients[..., :3], system.load)
        pushed = -np.einsum('skn,sk->sn', gradients[..., 3:], forces)
        torques.append((pushed + system.link_weight_torques(z)) * system.force_unit * system.size)
    return tuple(torques)


def planned_torques(system: ContactSystem, result: PlanResult) -> tuple[FloatArray, ...]:
    """Nominal torques of the plan; of one without, as `least_torques`.

    Returns:
        For each segment shape (f, n), N·m. A frame shared by two segments has one torque, as in
        a plan file, so that a plan from a file runs as it would have before it was written.
    """
    if not len(result.torque_nominal):
        return least_torques(system, result)
    return tuple(
        result.torque_nominal[segment.first_frame : segment.last_frame + 1]
        for segment in result.segments
    )
