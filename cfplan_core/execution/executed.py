"""An execution in the form of a plan, for what draws plans."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cfplan_core.execution.execute import Execution
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.trajectory.plan_result import PlanResult


def executed_motion(result: PlanResult, execution: Execution) -> PlanResult:
    """Put what happened in place of what was planned.

    Args:
        result: The plan.
        execution: Of the plan.

    Returns:
        A result whose frames are the measurements, without torque limits and without contacts;
        its segments are those of the plan that the drives were in.
    """
    run = execution.run
    starts = np.searchsorted(execution.reference.segments[run.rows], range(len(result.segments)))
    last = len(run.times) - 1
    bounds = [0, *(min(int(k), last) for k in starts[1:]), last]
    unknown: FloatArray = np.full(run.joints.shape, np.inf)
    return replace(
        result,
        times=run.times,
        joints=run.joints,
        object_poses=run.object_poses,
        torque_lower=-unknown,
        torque_upper=unknown,
        torque_nominal=run.torques,
        segments=tuple(
            replace(segment, contacts=(), first_frame=first, last_frame=end)
            for segment, first, end in zip(result.segments, bounds, bounds[1:], strict=False)
        ),
    )
