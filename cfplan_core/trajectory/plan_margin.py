"""The robustness margin of a plan that is there already, from its frames."""

from __future__ import annotations

import numpy as np

from cfplan_core.contact.elements import parse_contact
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.system import ContactSystem
from cfplan_core.errors import CfplanError
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.model import Grasp, Problem
from cfplan_core.planning.robustness import Ratios, Robustness
from cfplan_core.trajectory.plan_result import PlanResult


def plan_ratios(problem: Problem, result: PlanResult) -> tuple[Ratios, ...]:
    """Rate each segment of a plan; the plan's margin is the smallest of their `worst`.

    Args:
        problem: What the plan is for; frictionless.
        result: The plan.

    Raises:
        CfplanError: There is no plan, or a contact is of no body of the problem.
    """
    if not result.solved:
        raise CfplanError(f'status is {result.status.value!r}, expected a plan that is solved')
    system = ContactSystem(problem)
    robustness = Robustness(system, FrictionlessModel(system.load))
    frames = zip(result.object_poses, result.joints, strict=True)
    z = np.array([system.configuration(Grasp(pose, joints)) for pose, joints in frames])
    rated = []
    for segment in result.segments:
        pairs = sorted(system.pair(parse_contact(name)) for name in segment.contacts)
        rows = slice(segment.first_frame, segment.last_frame + 1)
        rated.append(robustness.ratios(Formation(tuple(pairs)), z[rows]))
    return tuple(rated)


def plan_margin(problem: Problem, result: PlanResult) -> float:
    """Worst robustness margin of a plan; see `plan_ratios`."""
    return min(ratios.worst for ratios in plan_ratios(problem, result))
