"""Figure 7: between which torques every joint must stay, over time."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.model import Problem
from cfplan_core.report.figures.timeline import timeline, write_if_it_fits
from cfplan_core.report.style import INK, MUTED, SMALL_FONT_SIZE, joint_colours
from cfplan_core.trajectory.plan_result import PlanResult

LOWER, UPPER, UNBOUNDED = 'lower limit', 'upper limit', 'unbounded'
_TYPICAL = 85.0
_HATCH = '////'


def torque_figure(problem: Problem, result: PlanResult) -> Figure:
    """A panel per joint: the band between its limits, hatched where a side is unbounded.

    A limit tends to infinity where form closure begins; the panels show typical values and let
    such limits leave them.

    Args:
        problem: For colours.
        result: A solved one.
    """
    figure, panels = timeline(result, panel=1.7)
    colours = joint_colours(problem.hand)
    for k, (axes, name) in enumerate(zip(panels, result.joint_names, strict=True)):
        lower, upper = result.torque_lower[:, k], result.torque_upper[:, k]
        low, high = torque_view(lower, upper)
        axes.set_ylim(low, high)
        axes.axhline(0.0, color=MUTED, linewidth=0.6, zorder=1.5)
        _draw_band(axes, result.times, lower, upper, colours[name])
        for values, label in ((lower, LOWER), (upper, UPPER)):
            for run in finite_runs(values):
                axes.plot(
                    result.times[run],
                    values[run],
                    color=colours[name],
                    linewidth=1.5,
                    marker='.' if run.stop - run.start == 1 else '',
                    gid=label,
                )
        axes.set_ylabel(f'{name}\ntorque (N·m)', fontsize=SMALL_FONT_SIZE, color=INK)
    figure.align_ylabels(panels)
    return figure


def torque_view(lower: FloatArray, upper: FloatArray) -> tuple[float, float]:
    """Vertical limits that show the typical size of limits, and zero, N·m.

    Args:
        lower: Shape (f,), N·m, may be infinite.
        upper: Shape (f,), N·m, may be infinite.
    """
    values = [v[np.isfinite(v)] for v in (lower, upper)]
    ends = [0.0]
    for v in values:
        if len(v):
            ends += [float(np.percentile(v, 100.0 - _TYPICAL)), float(np.percentile(v, _TYPICAL))]
    low, high = min(ends), max(ends)
    if high - low < 1e-9:
        return -1.0, 1.0
    pad = 0.3 * (high - low)
    return low - pad, high + pad


def finite_runs(values: FloatArray) -> Iterator[slice]:
    """Longest stretches of successive finite values."""
    yield from _runs(np.isfinite(values))


def _runs(mask: NDArray[np.bool_]) -> Iterator[slice]:
    """Longest stretches where a mask is true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        yield slice(int(start), int(stop))


def _draw_band(
    axes: Axes, times: FloatArray, lower: FloatArray, upper: FloatArray, colour: str
) -> None:
    """Fill the band; a step with an infinite end on a side counts as unbounded on that side."""
    low, high = axes.get_ylim()
    beyond = 0.2 * (high - low)
    open_below = ~(np.isfinite(lower[:-1]) & np.isfinite(lower[1:]))
    open_above = ~(np.isfinite(upper[:-1]) & np.isfinite(upper[1:]))
    at = np.repeat(times, 2)[1:-1]
    bottom = np.where(np.repeat(open_below, 2), low - beyond, np.repeat(lower, 2)[1:-1])
    top = np.where(np.repeat(open_above, 2), high + beyond, np.repeat(upper, 2)[1:-1])
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
            _mark_unbounded(axes, times[run.start], times[run.stop], height, direction)


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
