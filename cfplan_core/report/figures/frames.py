"""Figure 4: numbered frames of action."""

from __future__ import annotations

from math import ceil
from typing import Literal

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cfplan_core.model import Problem
from cfplan_core.report.figures.drawing import (
    draw_bodies,
    draw_contacts,
    figure_header,
    header_width,
    new_figure,
    world_axes,
)
from cfplan_core.report.scene import (
    contact_marks,
    frame_contacts,
    plan_grasps,
    story_frames,
    view_of,
)
from cfplan_core.report.style import FONT_SIZE, INK, MUTED, SMALL_FONT_SIZE
from cfplan_core.trajectory.plan_result import PlanResult

_PAGE = 7.2
_COLUMNS = 4
_CAPTION = 0.23
_NOTE = 0.2


def frames_figure(problem: Problem, result: PlanResult) -> Figure:
    """Frames of a plan in a grid: the ends of its segments, in bold, and some between.

    Every frame has its number in the plan below it on the left and its time on the right.

    Args:
        problem: Hand and object.
        result: A solved one.

    Raises:
        CfplanError: A contact's name does not fit the problem.
    """
    grasps = plan_grasps(result)
    frames = story_frames(result.segments)
    ends = {s.first_frame for s in result.segments} | {s.last_frame for s in result.segments}
    view = view_of(problem, [grasps[k] for k in frames])
    columns = min(_COLUMNS, len(frames))
    rows = ceil(len(frames) / columns)
    width = (_PAGE - 0.1) / _COLUMNS - 0.1
    height = width * view.height / view.width
    across = max(0.1 + columns * (width + 0.1), header_width(problem, view, width) + 0.2)
    page_height = rows * (height + _CAPTION) + 0.32 + _NOTE
    figure = new_figure(across, page_height)
    figure.text(
        0.1 / across,
        0.07 / page_height,
        'bold: a segment begins or ends',
        fontsize=SMALL_FONT_SIZE,
        color=MUTED,
    )
    for k, frame in enumerate(frames):
        row, column = divmod(k, columns)
        top = page_height - 0.3 - row * (height + _CAPTION)
        axes = world_axes(figure, 0.1 + column * (width + 0.1), top - height, width, view)
        grasp = grasps[frame]
        draw_bodies(axes, problem, grasp)
        marks = contact_marks(problem, grasp, frame_contacts(result.segments, frame))
        draw_contacts(axes, marks, 0.22 * problem.object.size, size=2.4)
        if k == 0:
            figure_header(figure, problem, axes, view)
        _write_below(axes, 'left', str(frame), 'bold' if frame in ends else 'normal')
        _write_below(axes, 'right', f'{result.times[frame]:.2f} s', 'normal')
    return figure


def _write_below(axes: Axes, side: Literal['left', 'right'], text: str, weight: str) -> None:
    axes.annotate(
        text,
        xy=(0.0 if side == 'left' else 1.0, 0.0),
        xycoords='axes fraction',
        xytext=(1.0 if side == 'left' else -1.0, -3.0),
        textcoords='offset points',
        ha=side,
        va='top',
        fontsize=FONT_SIZE if side == 'left' else SMALL_FONT_SIZE,
        fontweight=weight,
        color=INK if side == 'left' else MUTED,
    )
