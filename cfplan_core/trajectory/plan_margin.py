"""The robustness margin of a plan that is there already, from its frames."""

from __future__ import annotations

import numpy as np

from cfplan_core.contact.elements import parse_contact
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.system import ContactSystem
from cfplan_core.errors import CfplanError
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.model import Grasp, Problem
from cfplan_core.planning.robustness import Ratios, Robustness
from cfplan_core.trajectory.plan_result import PlanResult


def plan_ratios(problem: Problem, result: PlanResult) -> tuple[Ratios, ...]:
    """Rate each segment of a plan by itself.

    Args:
        problem: What the plan is for; frictionless.
        result: The plan.

    Raises:
        CfplanError: There is no plan, or a contact is of no body of the problem.
    """
    robustness, motions = _measured(problem, result)
    return tuple(robustness.ratios(formation, z) for formation, z in motions)


def plan_margin(problem: Problem, result: PlanResult) -> float:
    """Worst robustness margin of a plan; arguments and errors are those of `plan_ratios`.

    No larger than the smallest `worst` of the segments: a near miss may take more than one.
    """
    robustness, motions = _measured(problem, result)
    return robustness.margin(motions)


def _measured(
    problem: Problem, result: PlanResult
) -> tuple[Robustness, list[tuple[Formation, FloatArray]]]:
    """What measures a plan, and the plan's motions."""
    if not result.solved:
        raise CfplanError(f'status is {result.status.value!r}, expected a plan that is solved')
    system = ContactSystem(problem)
    frames = zip(result.object_poses, result.joints, strict=True)
    z = np.array([system.configuration(Grasp(pose, joints)) for pose, joints in frames])
    motions = []
    for segment in result.segments:
        pairs = sorted(system.pair(parse_contact(name)) for name in segment.contacts)
        rows = slice(segment.first_frame, segment.last_frame + 1)
        motions.append((Formation(tuple(pairs)), z[rows]))
    return Robustness(system, FrictionlessModel(system.load)), motions
