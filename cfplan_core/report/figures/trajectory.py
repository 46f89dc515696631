"""Figure 6: the joint-space trajectory with its corners."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.model import Problem
from cfplan_core.report.figures.drawing import axes_at, new_figure
from cfplan_core.report.figures.labels import Label, place_labels, point_boxes
from cfplan_core.report.figures.timeline import style_axes, timeline
from cfplan_core.report.style import (
    FONT_SIZE,
    INK,
    MUTED,
    PAPER,
    SMALL_FONT_SIZE,
    STABILITY,
    joint_colours,
    stability_style,
)
from cfplan_core.trajectory.plan_result import PlanResult

CURVE = 'joint curve'
_LEFT = 0.75


@dataclass(frozen=True)
class _CornerMark:
    """How some of the plan's corners are marked.

    Attributes:
        label: What they are.
        part: Which of all corners.
        look: For matplotlib's lines.
    """

    label: str
    part: slice
    look: Mapping[str, Any]


def _marker(shape: str, size: float, fill: str) -> Mapping[str, Any]:
    return {
        'linestyle': 'none',
        'marker': shape,
        'markersize': size,
        'markerfacecolor': fill,
        'markeredgecolor': INK,
    }


_CORNERS = (
    _CornerMark('start', slice(0, 1), _marker('o', 6.5, INK)),
    _CornerMark('corner with frame number', slice(1, -1), _marker('o', 5.0, PAPER)),
    _CornerMark('goal', slice(-1, None), _marker('s', 6.0, INK)),
)


def trajectory_figure(problem: Problem, result: PlanResult) -> Figure:
    """Joint space for two joints, joint angles over time for any other number of joints.

    Args:
        problem: For the joints' limits and colours.
        result: A solved one.
    """
    if len(result.joint_names) == 2:
        return _joint_plane(problem, result)
    return _joint_angles(problem, result)


def _joint_plane(problem: Problem, result: PlanResult) -> Figure:
    """One joint against the other; line width says stability, numbers are frames."""
    figure = new_figure(5.2, 4.7)
    axes = axes_at(figure, _LEFT, 0.5, 4.3, 3.7)
    degrees = np.rad2deg(result.joints)
    for segment in result.segments:
        stretch = degrees[segment.first_frame : segment.last_frame + 1]
        axes.plot(
            stretch[:, 0],
            stretch[:, 1],
            color=INK,
            linewidth=stability_style(segment.stability).width,
            solid_capstyle='butt',
            gid=CURVE,
        )
    low, high = degrees.min(axis=0), degrees.max(axis=0)
    pad = 0.09 * np.maximum(high - low, 1.0)
    axes.set_xlim(low[0] - pad[0], high[0] + pad[0])
    axes.set_ylim(low[1] - pad[1], high[1] + pad[1])
    corners = sorted({k for s in result.segments for k in (s.first_frame, s.last_frame)})
    for mark in _CORNERS:
        chosen = degrees[corners[mark.part]]
        axes.plot(chosen[:, 0], chosen[:, 1], **mark.look, zorder=4)
    _draw_heading(axes, result, degrees)
    labels = [
        Label(
            str(k),
            degrees[k],
            _outside_of_corner(axes, degrees, k),
            {'fontsize': FONT_SIZE, 'color': INK, 'zorder': 5},
        )
        for k in corners
    ]
    taken = np.vstack(
        [point_boxes(axes, degrees[corners], 4.0), point_boxes(axes, _dense(degrees), 2.0)]
    )
    place_labels(axes, labels, taken)
    names = [f'{name} (deg)' for name in result.joint_names]
    axes.set_xlabel(names[0], fontsize=FONT_SIZE, color=INK)
    axes.set_ylabel(names[1], fontsize=FONT_SIZE, color=INK)
    style_axes(axes)
    _draw_limits(axes, problem)
    _legends(figure, result)
    return figure


def _outside_of_corner(axes: Axes, degrees: FloatArray, frame: int) -> FloatArray:
    """Direction on paper away from the curve on both sides of a frame, shape (2,)."""
    before = degrees[max(frame - 1, 0)]
    after = degrees[min(frame + 1, len(degrees) - 1)]
    points = axes.transData.transform(np.array([before, degrees[frame], after]))
    rays = points[[0, 2]] - points[1]
    lengths = np.hypot(rays[:, 0], rays[:, 1])
    away = -sum(
        (ray / length for ray, length in zip(rays, lengths, strict=True) if length > 0.0),
        start=np.zeros(2),
    )
    if np.hypot(*away) > 0.05:
        return np.asarray(away)
    along = rays[1] - rays[0]
    return np.array([along[1], -along[0]])


def _dense(points: FloatArray, parts: int = 8) -> FloatArray:
    """Points along a polyline, shape ((p - 1) * parts + 1, 2)."""
    at = np.arange((len(points) - 1) * parts + 1) / parts
    return np.column_stack([np.interp(at, np.arange(len(points)), c) for c in points.T])


def _draw_heading(axes: Axes, result: PlanResult, degrees: FloatArray) -> None:
    """Arrows in the middle of the segments that are long on paper."""
    points = axes.transData.transform(degrees)
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    for segment in result.segments:
        start, end = length[[segment.first_frame, segment.last_frame]]
        if end - start <= 0.1 * length[-1]:
            continue
        k = int(np.searchsorted(length, (start + end) / 2.0))
        width = stability_style(segment.stability).width
        axes.annotate(
            '',
            xy=tuple(degrees[k]),
            xytext=tuple(degrees[k - 1]),
            arrowprops={
                'arrowstyle': '-|>',
                'color': INK,
                'linewidth': 0.0,
                'mutation_scale': 10.0 + 3.0 * width,
            },
        )


def _draw_limits(axes: Axes, problem: Problem) -> None:
    """Dashed lines at joint limits that are in view."""
    for joint, draw, interval in zip(
        problem.hand.joints,
        (axes.axvline, axes.axhline),
        (axes.get_xlim(), axes.get_ylim()),
        strict=True,
    ):
        for limit in np.rad2deg([joint.lower, joint.upper]):
            if interval[0] < limit < interval[1]:
                draw(limit, color=MUTED, linewidth=0.8, linestyle='--')


def _legends(figure: Figure, result: PlanResult) -> None:
    """What line widths mean, and below it what marks mean."""
    across, up = figure.get_size_inches()
    occurring = {segment.stability for segment in result.segments}
    lines = [
        Line2D([], [], color=INK, linewidth=style.width, label=style.label)
        for stability, style in STABILITY.items()
        if stability in occurring
    ]
    marks = [Line2D([], [], label=mark.label, **mark.look) for mark in _CORNERS]
    for row, handles in enumerate((lines, marks)):
        figure.legend(
            handles=handles,
            loc='upper left',
            bbox_to_anchor=(_LEFT / across, 1.0 - (0.06 + 0.2 * row) / up),
            ncols=len(handles),
            frameon=False,
            fontsize=SMALL_FONT_SIZE,
            handlelength=1.8,
            borderaxespad=0.0,
            borderpad=0.0,
        )


def _joint_angles(problem: Problem, result: PlanResult) -> Figure:
    """A panel per joint over time."""
    figure, panels = timeline(result, panel=1.15)
    colours = joint_colours(problem.hand)
    ends = sorted({k for s in result.segments for k in (s.first_frame, s.last_frame)})
    for k, (axes, joint) in enumerate(zip(panels, problem.hand.joints, strict=True)):
        degrees = np.rad2deg(result.joints[:, k])
        axes.plot(result.times, degrees, color=colours[joint.name], linewidth=1.6, gid=CURVE)
        axes.plot(
            result.times[ends],
            degrees[ends],
            linestyle='none',
            marker='o',
            markersize=4.0,
            markerfacecolor=PAPER,
            markeredgecolor=colours[joint.name],
            clip_on=False,
            zorder=4,
        )
        axes.margins(y=0.12)
        low, high = axes.get_ylim()
        for limit in np.rad2deg([joint.lower, joint.upper]):
            if low < limit < high:
                axes.axhline(limit, color=MUTED, linewidth=0.8, linestyle='--')
        axes.set_ylabel(f'{joint.name}\n(deg)', fontsize=SMALL_FONT_SIZE, color=INK)
    figure.align_ylabels(panels)
    return figure
