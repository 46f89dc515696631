"""Axes over time: the plan's segments in a strip above, their ends through every panel."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from cfplan_core.report.figures.drawing import axes_at, new_figure, text_widths
from cfplan_core.report.figures.labels import renderer_of
from cfplan_core.report.style import (
    FAINT,
    FONT_SIZE,
    INK,
    MUTED,
    SMALL_FONT_SIZE,
    STABILITY,
    stability_style,
)
from cfplan_core.trajectory.plan_result import PlanResult

SEGMENT_LABEL = 'segment label'
_PAGE = 7.2
_LEFT, _RIGHT, _BOTTOM, _TOP = 0.85, 0.15, 0.5, 0.28
_STRIP = 0.2
_GAP = 0.16


def timeline(
    result: PlanResult, panel: float, names: Sequence[str] | None = None
) -> tuple[Figure, tuple[Axes, ...]]:
    """Make a figure with panels over the plan's time.

    Args:
        result: A solved one.
        panel: Height of a panel, inches; more if a name needs it.
        names: Of the panels; those of the joints if not given.

    Returns:
        The figure and a panel per name, whose time limits are final.
    """
    names = result.joint_names if names is None else names
    joints = len(names)
    panel = max(panel, *text_widths(names))
    rows = _label_rows(result)
    strip = _STRIP * (max(rows, default=0) + 1)
    height = _BOTTOM + joints * (panel + _GAP) + strip + _TOP
    figure = new_figure(_PAGE, height)
    width = _PAGE - _LEFT - _RIGHT
    panels = []
    for k in range(joints):
        bottom = _BOTTOM + (joints - 1 - k) * (panel + _GAP)
        axes = axes_at(figure, _LEFT, bottom, width, panel)
        axes.set_xlim(*time_limits(result))
        style_axes(axes)
        axes.tick_params(labelbottom=k == joints - 1)
        for segment in result.segments[1:]:
            axes.axvline(result.times[segment.first_frame], color=FAINT, linewidth=0.7, zorder=1.5)
        panels.append(axes)
    panels[-1].set_xlabel('time (s)', fontsize=FONT_SIZE, color=INK)
    top = _BOTTOM + joints * (panel + _GAP) - 0.06
    _draw_strip(axes_at(figure, _LEFT, top, width, strip), result, rows)
    _stability_legend(figure, result)
    return figure, tuple(panels)


def time_limits(result: PlanResult) -> tuple[float, float]:
    """First and last instant of a plan, s; a second around a plan that stands still."""
    first, last = float(result.times[0]), float(result.times[-1])
    return (first, last) if last > first else (first - 0.5, last + 0.5)


def style_axes(axes: Axes) -> None:
    """Give axes with ticks thin grey frames and small numbers."""
    axes.tick_params(labelsize=SMALL_FONT_SIZE, color=MUTED, labelcolor=INK, width=0.6)
    for spine in axes.spines.values():
        spine.set_linewidth(0.6)
        spine.set_color(MUTED)


def _label_rows(result: PlanResult) -> list[int]:
    """Row of every segment's number: 0 if it fits into its box, else the first free one above."""
    first, last = time_limits(result)
    across = (_PAGE - _LEFT - _RIGHT) / (last - first)
    taken_to: dict[int, float] = {}
    rows = []
    for k, segment in enumerate(result.segments):
        start, end = result.times[[segment.first_frame, segment.last_frame]]
        middle = across * (start + end) / 2.0
        half = 0.06 * len(str(k + 1)) + 0.02
        fits = across * (end - start) > 2.0 * half
        row = next(r for r in count(0 if fits else 1) if taken_to.get(r, -np.inf) <= middle - half)
        taken_to[row] = middle + half
        rows.append(row)
    return rows


def _draw_strip(axes: Axes, result: PlanResult, rows: Sequence[int]) -> None:
    """Draw segments as boxes on the lowest row, with their numbers in or above them."""
    axes.set_axis_off()
    axes.set_xlim(*time_limits(result))
    axes.set_ylim(0.0, max(rows, default=0) + 1.0)
    for k, (segment, row) in enumerate(zip(result.segments, rows, strict=True)):
        start, end = result.times[segment.first_frame], result.times[segment.last_frame]
        axes.add_patch(
            Rectangle(
                (start, 0.0),
                end - start,
                1.0,
                facecolor=stability_style(segment.stability).tint,
                edgecolor=MUTED,
                linewidth=0.6,
                clip_on=False,
            )
        )
        if row:
            middle = (start + end) / 2
            axes.plot([middle, middle], [0.8, row + 0.1], color=MUTED, linewidth=0.5)
        axes.text(
            (start + end) / 2.0,
            row + 0.5,
            str(k + 1),
            ha='center',
            va='center_baseline',
            fontsize=SMALL_FONT_SIZE,
            color=INK,
            gid=SEGMENT_LABEL,
        )
    axes.annotate(
        'segment',
        xy=(axes.get_xlim()[0], 0.5),
        xycoords='data',
        xytext=(-5.0, 0.0),
        textcoords='offset points',
        ha='right',
        va='center',
        fontsize=SMALL_FONT_SIZE,
        color=MUTED,
        annotation_clip=False,
    )


def _stability_legend(figure: Figure, result: PlanResult) -> None:
    across, up = figure.get_size_inches()
    occurring = {segment.stability for segment in result.segments}
    figure.legend(
        handles=[
            Patch(facecolor=style.tint, edgecolor=MUTED, linewidth=0.6, label=style.label)
            for stability, style in STABILITY.items()
            if stability in occurring
        ],
        loc='upper left',
        bbox_to_anchor=(_LEFT / across, 1.0 - 0.06 / up),
        ncols=3,
        frameon=False,
        fontsize=SMALL_FONT_SIZE,
        handlelength=1.4,
        borderaxespad=0.0,
        borderpad=0.0,
    )


def write_if_it_fits(axes: Axes, text: str, start: float, end: float, height: float) -> bool:
    """Write a text in a stretch of time if it fits there.

    Args:
        axes: Whose limits are final.
        text: To write.
        start: Of the stretch, s.
        end: Of the stretch, s.
        height: Of the text's middle, as a part of the axes' height.

    Returns:
        Whether it fits and was written.
    """
    written = axes.text(
        (start + end) / 2.0,
        height,
        text,
        transform=axes.get_xaxis_transform(),
        ha='center',
        va='center',
        fontsize=SMALL_FONT_SIZE,
        color=INK,
        bbox={'facecolor': 'white', 'edgecolor': 'none', 'pad': 1.0},
    )
    left, right = axes.transData.transform(np.array([[start, 0.0], [end, 0.0]]))[:, 0]
    if written.get_window_extent(renderer_of(axes)).width > 0.95 * (right - left):
        written.remove()
        return False
    return True
