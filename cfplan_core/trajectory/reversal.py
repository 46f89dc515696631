"""A plan backwards: from the goal to the start."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cfplan_core.errors import CfplanError
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.trajectory.plan_result import PlanResult
from cfplan_core.trajectory.timing import NANOSECONDS


def reversed_plan(result: PlanResult) -> PlanResult:
    """Turn a plan round; see `PlanResult.reversed`."""
    if not result.solved:
        raise CfplanError(f'status is {result.status.value!r}, expected a plan that is solved')
    if not result.reversible:
        raise CfplanError(
            f'plan {result.problem!r}: expected one as planned under a reversible contact model; '
            'this one is not, or was read from a file or a message, which do not tell'
        )
    last = len(result.times) - 1
    firsts = [segment.first_frame for segment in result.segments]
    lasts = [segment.last_frame for segment in result.segments]
    initial, goal = result.trees
    statistics = result.statistics
    return replace(
        result,
        times=_turned_times(result.times),
        joints=result.joints[::-1].copy(),
        object_poses=result.object_poses[::-1].copy(),
        # A shared frame carries the limits of the segment that now comes first.
        torque_lower=_with_rows(result.torque_lower, firsts, result.entry_lower)[::-1].copy(),
        torque_upper=_with_rows(result.torque_upper, firsts, result.entry_upper)[::-1].copy(),
        entry_lower=result.torque_lower[lasts][::-1].copy(),
        entry_upper=result.torque_upper[lasts][::-1].copy(),
        torque_nominal=_with_rows(result.torque_nominal, firsts, result.entry_nominal)[
            ::-1
        ].copy(),
        entry_nominal=result.torque_nominal[lasts][::-1].copy(),
        segments=tuple(
            replace(
                segment,
                first_frame=last - segment.last_frame,
                last_frame=last - segment.first_frame,
            )
            for segment in reversed(result.segments)
        ),
        statistics=replace(
            statistics,
            initial_tree_nodes=statistics.goal_tree_nodes,
            goal_tree_nodes=statistics.initial_tree_nodes,
        ),
        trees=(goal, initial),
        alternatives=(),
        # Friction has another direction.
        margin=None,
        margin_bound=None,
    )


def _turned_times(times: FloatArray) -> FloatArray:
    """Times with the steps in reverse order, whole nanoseconds."""
    ticks = np.rint(times * NANOSECONDS)
    return np.asarray((ticks[-1] - ticks[::-1]) / NANOSECONDS)


def _with_rows(values: FloatArray, rows: list[int], replacement: FloatArray) -> FloatArray:
    changed = values.copy()
    changed[rows] = replacement
    return changed
