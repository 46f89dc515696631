"""Figure 5: the two CF-trees, the plan's path through them, and a key to the formations."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cfplan_core.model import Problem
from cfplan_core.report.figures.drawing import axes_at, new_figure
from cfplan_core.report.figures.tree_key import (
    LEGEND_LINE,
    LINE,
    draw_legend,
    formation_letters,
    key_lines,
    key_width,
    legend_rows,
    write_key,
)
from cfplan_core.report.figures.tree_layout import lay_out, path_of
from cfplan_core.report.figures.tree_nodes import PATH_RADIUS, Place, draw_meeting, draw_tree
from cfplan_core.report.style import FONT_SIZE, INK
from cfplan_core.trajectory.plan_result import PlanResult

_PAGE = 7.2
_MARGIN = 0.14
_LEVEL = 0.38
_WIDEST_LEVEL = 0.9
_ROW = 0.26
_MEETING = 2
_HEADER = 0.22


def trees_figure(problem: Problem, result: PlanResult) -> Figure:
    """Both trees along the plan's path, which is a straight line from start to goal.

    The initial tree grows from the left above that line, the goal tree from the right below it.
    Nodes carry letters, the same for the same set of contacts in both trees; a key says which
    contacts a letter stands for.

    Args:
        problem: For the names of bodies.
        result: Of any status, with at least one node in one tree.

    Raises:
        CfplanError: A contact's name is malformed.
    """
    letters = formation_letters(result.trees)
    layouts = [lay_out(tree) if tree else () for tree in result.trees]
    deepest = [max((level for level, _ in layout), default=0) for layout in layouts]
    on_path = sum(len(path_of(tree)) - 1 for tree in result.trees if tree)
    levels = max(*deepest, on_path + _MEETING)
    key = key_lines(problem, letters)
    inside = max(_PAGE - 2.0 * _MARGIN, _LEVEL * levels + 2.0 * PATH_RADIUS, key_width(key))
    width = inside + 2.0 * _MARGIN
    pitch = min(_WIDEST_LEVEL, (inside - 2.0 * PATH_RADIUS) / levels)
    above, below = (
        max((row for _, row in layout), default=0.0) * _ROW + PATH_RADIUS + 0.1
        for layout in layouts
    )
    columns = min(int(inside / key_width(key)), len(key))
    legend = legend_rows(result)
    key_height = LINE * (-(-len(key) // columns) + 1.0)
    spine = _MARGIN + key_height + 0.1 + _HEADER + below
    height = spine + above + _HEADER + 0.1 + LEGEND_LINE * len(legend)

    figure = new_figure(width, height)
    axes = axes_at(figure, 0.0, 0.0, width, height)
    axes.set_xlim(0.0, width)
    axes.set_ylim(0.0, height)
    axes.set_axis_off()
    unused = inside - 2.0 * PATH_RADIUS - pitch * levels
    first = _MARGIN + PATH_RADIUS + unused / 2.0
    last = width - first
    ends = []
    for tree, layout, start, across, up in zip(
        result.trees, layouts, (first, last), (pitch, -pitch), (_ROW, -_ROW), strict=True
    ):
        places = [Place(start + across * level, spine + up * row) for level, row in layout]
        draw_tree(axes, tree, places, letters)
        if tree:
            ends.append(places[path_of(tree)[-1]])
    if result.solved and len(ends) == 2:
        draw_meeting(axes, *ends)
    names = [f'{len(tree)} node' + ('' if len(tree) == 1 else 's') for tree in result.trees]
    left = first - PATH_RADIUS
    _write(axes, left, spine + above + _HEADER / 2.0, 'left', f'initial tree, {names[0]}')
    _write(axes, width - left, spine - below - _HEADER / 2.0, 'right', f'goal tree, {names[1]}')
    draw_legend(axes, legend, _MARGIN, height - LEGEND_LINE / 2.0 - 0.03)
    write_key(axes, key, columns, _MARGIN, _MARGIN + key_height - LINE / 2.0)
    return figure


def _write(axes: Axes, x: float, y: float, side: str, text: str) -> None:
    axes.text(x, y, text, ha=side, va='center', fontsize=FONT_SIZE, color=INK)
