"""Figure 7: between which torques every joint must stay, over time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.model import Problem
from cfplan_core.report.figures.timeline import timeline, write_if_it_fits
from cfplan_core.report.style import INK, MUTED, SMALL_FONT_SIZE, joint_colours
from cfplan_core.trajectory.plan_result import PlanResult, Segment

LOWER, UPPER, UNBOUNDED = 'lower limit', 'upper limit', 'unbounded'
NOMINAL = 'nominal torque'
_NONE = np.empty(0)
_TYPICAL = 85.0
_HATCH = '////'


def torque_figure(problem: Problem, result: PlanResult) -> Figure:
    """A panel per joint: the band between its limits, hatched where a side is unbounded.

    A dashed line shows the nominal torques where they were planned.

    A limit tends to infinity where form closure begins; the panels show typical values and let
    such limits leave them. Limits jump where a segment ends.

    Args:
        problem: For colours.
        result: A solved one.
    """
    figure, panels = timeline(result, panel=1.7)
    colours = joint_colours(problem.hand)
    for k, (axes, name) in enumerate(zip(panels, result.joint_names, strict=True)):
        lower, upper = result.torque_lower[:, k], result.torque_upper[:, k]
        nominal = result.torque_nominal[:, k] if len(result.torque_nominal) else _NONE
        low, high = torque_view(lower, upper, nominal)
        axes.set_ylim(low, high)
        axes.axhline(0.0, color=MUTED, linewidth=0.6, zorder=1.5)
        at = np.repeat(result.times, 2)[1:-1]
        lows, highs = (interval_limits(values, result.segments) for values in (lower, upper))
        _draw_band(axes, at, lows, highs, colours[name])
        for values, held, label in ((lower, lows, LOWER), (upper, highs, UPPER)):
            for run in finite_runs(held):
                axes.plot(at[run], held[run], color=colours[name], linewidth=1.5, gid=label)
            alone = np.isfinite(values) & ~np.isin(result.times, at[np.isfinite(held)])
            if alone.any():
                points = result.times[alone], values[alone]
                axes.plot(*points, '.', color=colours[name], gid=label)
        if len(nominal):
            axes.plot(result.times, nominal, color=INK, linewidth=1.0, dashes=(4, 2), gid=NOMINAL)
        axes.set_ylabel(f'{name}\ntorque (N·m)', fontsize=SMALL_FONT_SIZE, color=INK)
    if len(result.torque_nominal):
        _nominal_legend(figure)
    figure.align_ylabels(panels)
    return figure


def torque_view(
    lower: FloatArray, upper: FloatArray, nominal: FloatArray = _NONE
) -> tuple[float, float]:
    """Vertical limits that show the typical size of limits, all nominal torques, and zero, N·m.

    Args:
        lower: Shape (f,), N·m, may be infinite.
        upper: Shape (f,), N·m, may be infinite.
        nominal: Shape (f,), N·m, or (0,).
    """
    values = [v[np.isfinite(v)] for v in (lower, upper)]
    ends = [0.0]
    for v in values:
        if len(v):
            ends += [float(np.percentile(v, 100.0 - _TYPICAL)), float(np.percentile(v, _TYPICAL))]
    low, high = min(ends), max(ends)
    if high - low < 1e-9 and not nominal.any():
        return -1.0, 1.0
    pad = 0.3 * (high - low)
    low, high = low - pad, high + pad
    if not len(nominal):
        return low, high
    pad = 0.05 * float(max(high, nominal.max()) - min(low, nominal.min()))
    return min(low, float(nominal.min()) - pad), max(high, float(nominal.max()) + pad)


def interval_limits(values: FloatArray, segments: Sequence[Segment]) -> FloatArray:
    """Limits just after and just before the frames, as each segment has them.

    A frame that two segments share carries the limit of the earlier one. The later one starts
    with the limit of its first own frame, so that limits jump at the shared frame. Where a limit
    becomes infinite on the way to the next frame, the finite one is held, in form closure the
    infinite one.

    Args:
        values: Shape (f,), N·m, may be infinite: a limit at every frame.
        segments: Of the plan; they cover all frames.

    Returns:
        Shape (2 (f - 1),), N·m: for every step between frames the limit at its start and its end.
    """
    ends = np.repeat(values, 2)[1:-1]
    for k, segment in enumerate(segments):
        part = ends[2 * segment.first_frame : 2 * segment.last_frame].reshape(-1, 2)
        if k and len(part):
            part[0, 0] = part[0, 1]
        holds = np.isinf(part) if segment.stability == 'form_closure' else np.isfinite(part)
        part[:] = np.where(holds.any(axis=1, keepdims=True) & ~holds, part[:, ::-1], part)
    return ends


def _nominal_legend(figure: Figure) -> None:
    """Say right above the panels what the dashed line is."""
    across, up = figure.get_size_inches()
    figure.legend(
        handles=[Line2D([], [], color=INK, linewidth=1.0, dashes=(4, 2), label=NOMINAL)],
        loc='upper right',
        bbox_to_anchor=(1.0 - 0.15 / across, 1.0 - 0.06 / up),
        frameon=False,
        fontsize=SMALL_FONT_SIZE,
        borderaxespad=0.0,
        borderpad=0.0,
    )


def finite_runs(values: FloatArray) -> Iterator[slice]:
    """Longest stretches of successive finite values."""
    yield from _runs(np.isfinite(values))


def _runs(mask: NDArray[np.bool_]) -> Iterator[slice]:
    """Longest stretches where a mask is true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        yield slice(int(start), int(stop))


def _draw_band(
    axes: Axes, at: FloatArray, lower: FloatArray, upper: FloatArray, colour: str
) -> None:
    """Fill between limits as from `interval_limits`, out of the panel where one is infinite."""
    low, high = axes.get_ylim()
    beyond = 0.2 * (high - low)
    open_below, open_above = (~np.isfinite(limits[::2]) for limits in (lower, upper))
    bottom = np.where(np.isfinite(lower), lower, low - beyond)
    top = np.where(np.isfinite(upper), upper, high + beyond)
    axes.fill_between(at, bottom, top, facecolor=colour, alpha=0.25, linewidth=0.0)
    for run in _runs(open_below | open_above):
        part = slice(2 * run.start, 2 * run.stop)
        axes.fill_between(
            at[part],
            bottom[part],
            top[part],
            facecolor='none',
            edgecolor=colour,
            alpha=0.35,
            linewidth=0.0,
            hatch=_HATCH,
            gid=UNBOUNDED,
        )
    for sides, height, direction in ((open_above, 1.0, 1.0), (open_below, 0.0, -1.0)):
        for run in _runs(sides):
            start, end = at[2 * run.start], at[2 * run.stop - 1]
            _mark_unbounded(axes, start, end, height, direction)


def _mark_unbounded(axes: Axes, start: float, end: float, edge: float, direction: float) -> None:
    """An arrow out of the panel in the middle of a stretch, with a word where there is room."""
    middle = (start + end) / 2.0
    axes.annotate(
        '',
        xy=(middle, edge - 0.02 * direction),
        xytext=(middle, edge - 0.17 * direction),
        xycoords=axes.get_xaxis_transform(),
        arrowprops={'arrowstyle': '-|>', 'color': INK, 'linewidth': 1.0, 'shrinkA': 0.0},
    )
    write_if_it_fits(axes, 'unbounded', start, end, edge - 0.24 * direction)
