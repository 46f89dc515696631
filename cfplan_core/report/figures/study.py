"""Success of a study against each of its parameters."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from cfplan_core.report.style import DPI, FAINT, FINGERS, INK, MUTED, SMALL_FONT_SIZE
from cfplan_core.study.record import Record
from cfplan_core.study.success import Dependence, dependences, success_of

_MOST_COLUMNS = 3
_PANEL = (2.5, 2.3)
_RATE = 'rate'


def study_figure(records: Sequence[Record]) -> Figure:
    """A panel for each parameter that takes more than one value, with Wilson's intervals.

    Args:
        records: Of a study, at least one.
    """
    panels = dependences(records)
    total = success_of(records)
    columns = min(_MOST_COLUMNS, max(1, len(panels)))
    rows = max(1, math.ceil(len(panels) / columns))
    width, height = _PANEL
    figure = Figure(
        figsize=(max(4.0, width * columns), height * rows + 0.4), dpi=DPI, layout='constrained'
    )
    figure.suptitle(
        f'in the goal grasp {total.successes} of {total.trials} times',
        fontsize=SMALL_FONT_SIZE,
        color=INK,
    )
    grid = figure.subplots(rows, columns, sharey=True, squeeze=False)
    for axes, panel in zip(grid.flat, panels, strict=False):
        _draw(axes, panel)
        axes.axhline(total.successes / total.trials, color=FAINT, linewidth=0.8, zorder=1)
    for axes in list(grid.flat)[len(panels) :]:
        axes.set_visible(False)
    for axes in grid[:, 0]:
        axes.set_ylabel('in the goal grasp', fontsize=SMALL_FONT_SIZE, color=INK)
    return figure


def _draw(axes: Axes, panel: Dependence) -> None:
    levels = panel.levels
    numbers = [level.position for level in levels if level.position is not None]
    if len(numbers) == len(levels):
        at = np.array(numbers)
    else:
        at = np.arange(float(len(levels)))
        labels = [level.label for level in levels]
        turned = sum(len(label) for label in labels) > 20
        axes.set_xticks(
            at, labels, rotation=30 if turned else 0, ha='right' if turned else 'center'
        )
        axes.set_xlim(-0.5, len(levels) - 0.5)
    rates = np.array([level.success.successes / level.success.trials for level in levels])
    ends = np.array([level.success.interval for level in levels])
    colour = FINGERS[0]
    axes.errorbar(
        at,
        rates,
        yerr=np.maximum(0.0, [rates - ends[:, 0], ends[:, 1] - rates]),
        fmt='o',
        color=colour,
        markersize=4.0,
        linewidth=1.2,
        capsize=2.5,
        gid=_RATE,
    )
    axes.set_ylim(-0.03, 1.03)
    axes.yaxis.set_major_formatter(PercentFormatter(1.0))
    axes.set_xlabel(panel.name, fontsize=SMALL_FONT_SIZE, color=INK)
    axes.tick_params(labelsize=SMALL_FONT_SIZE, colors=MUTED)
    axes.grid(axis='y', color=FAINT, linewidth=0.4)
    axes.spines[['top', 'right']].set_visible(False)
