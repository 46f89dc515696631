"""What was planned and what happened, over time: the object's pose and the joints' torques."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from cfplan_core.execution.execute import Execution
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.model import Problem
from cfplan_core.report.figures.timeline import timeline
from cfplan_core.report.figures.torque import interval_limits, torque_view
from cfplan_core.report.style import INK, MUTED, OBJECT, SMALL_FONT_SIZE, joint_colours
from cfplan_core.trajectory.plan_result import PlanResult

PLANNED, EXECUTED, LIMITS = 'planned', 'executed', 'torque limits'
_USUAL = (1.0, 99.0)
_POSE = (('x (mm)', 1e3), ('y (mm)', 1e3), ('angle (rad)', 1.0))


def execution_figure(problem: Problem, result: PlanResult, execution: Execution) -> Figure:
    """Panels of the object's position and angle and of each joint's torque, with its limits.

    Args:
        problem: What was planned.
        result: Its plan.
        execution: Of the plan.
    """
    names = [f'object\n{label}' for label, _ in _POSE]
    names += [f'{name}\ntorque (N·m)' for name in result.joint_names]
    figure, panels = timeline(result, panel=1.05, names=names)
    run, reference = execution.run, execution.reference
    at = run.times + result.times[0]
    for k, (_, unit) in enumerate(_POSE):
        _compare(
            panels[k],
            at,
            unit * reference.object_poses[run.rows, k],
            unit * run.object_poses[:, k],
            OBJECT,
        )
    colours = joint_colours(problem.hand)
    for k, name in enumerate(result.joint_names):
        axes = panels[len(_POSE) + k]
        lower, upper = result.torque_lower[:, k], result.torque_upper[:, k]
        planned = reference.torques[run.rows, k]
        # Blows at contact events may stick out.
        usual = np.percentile(run.torques[:, k], _USUAL)
        low, high = torque_view(lower, upper, np.append(planned, usual))
        axes.set_ylim(low, high)
        ends = np.repeat(result.times, 2)[1:-1]
        bottom, top = (interval_limits(v, result.segments) for v in (lower, upper))
        axes.fill_between(
            ends,
            np.maximum(bottom, low),
            np.minimum(top, high),
            facecolor=colours[name],
            alpha=0.2,
            linewidth=0.0,
        )
        axes.axhline(0.0, color=MUTED, linewidth=0.6, zorder=1.5)
        _compare(axes, at, planned, run.torques[:, k], colours[name])
    for axes, label in zip(panels, names, strict=True):
        axes.set_ylabel(label, fontsize=SMALL_FONT_SIZE, color=INK)
    figure.align_ylabels(panels)
    _legend(figure, panels[0].get_position().x1)
    return figure


def _compare(
    axes: Axes, at: FloatArray, planned: FloatArray, executed: FloatArray, colour: str
) -> None:
    axes.plot(at, planned, color=colour, linewidth=3.0, solid_capstyle='butt', gid=PLANNED)
    axes.plot(at, executed, color=INK, linewidth=0.9, gid=EXECUTED)


def _legend(figure: Figure, right: float) -> None:
    figure.legend(
        handles=[
            Patch(facecolor=MUTED, alpha=0.3, label=LIMITS),
            Line2D([], [], color=MUTED, linewidth=3.0, label=PLANNED),
            Line2D([], [], color=INK, linewidth=0.9, label=EXECUTED),
        ],
        loc='upper right',
        bbox_to_anchor=(right, 1.0),
        ncols=3,
        frameon=False,
        fontsize=SMALL_FONT_SIZE,
        borderaxespad=0.2,
        borderpad=0.0,
    )
