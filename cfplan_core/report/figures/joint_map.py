"""The joint space coloured by contact formation: what can be reached strong, the rest pale."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cfplan_core.contact.formation import Formation
from cfplan_core.exploration import Exploration, configurations
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.equations import is_second_order
from cfplan_core.planning.pieces import Piece
from cfplan_core.planning.sheet_graph import Sheet
from cfplan_core.planning.sheets import Sheets
from cfplan_core.report.figures.drawing import axes_at, new_figure
from cfplan_core.report.figures.timeline import style_axes
from cfplan_core.report.style import FAINT, FONT_SIZE, INK, PAPER, SMALL_FONT_SIZE
from cfplan_core.trajectory.plan_result import PlanResult

# Paul Tol's muted scheme and four darker colours, told apart with colour blindness too.
COLOURS = (
    '#332288', '#88CCEE', '#44AA99', '#117733', '#999933', '#DDCC77',
    '#CC6677', '#882255', '#AA4499', '#EE8866', '#4477AA', '#777777',
)  # fmt: skip
_STRONG, _PALE = 0.85, 0.25
_SIDE, _LEFT, _BOTTOM, _TOP = 5.2, 0.75, 0.5, 0.3
_ROW, _LINE = 0.26, 0.108
_LEGEND = 1.9
_MARGIN = 0.05


def joint_map(explored: Exploration, result: PlanResult | None = None) -> Figure:
    """Draw the joint space of a hand of one or two joints.

    Args:
        explored: What can be reached.
        result: Its plan is drawn if it has one.

    Returns:
        Two joints: the plane of their angles, regions as areas, curves as lines, points as dots.
        One joint: a strip for each contact formation.
    """
    reached, others = explored.pieces(), explored.others()
    known = {piece.index for piece in reached}
    others = [piece for piece in others if piece.index not in known]
    colours = _colours([*reached, *others])
    two = explored.system.joint_count == 2
    height = _SIDE if two else max(1.2, _ROW * len(colours))
    entries = list(colours)[: len(COLOURS)]
    legend = sum(_LINE * (len(_lines(explored, entry)) + 0.7) for entry in entries) + 0.7
    inner = max(height, legend)
    figure = new_figure(_LEFT + _SIDE + 0.15 + _LEGEND, _BOTTOM + inner + _TOP)
    axes = axes_at(figure, _LEFT, _BOTTOM + inner - height, _SIDE, height)
    style_axes(axes)
    for pieces, strength in ((others, _PALE), (reached, _STRONG)):
        if two:
            _draw_plane(axes, explored, pieces, colours, strength)
        else:
            _draw_strips(axes, pieces, colours, strength)
    _draw_grasps(axes, explored, result, len(colours))
    _frame(axes, explored, [*reached, *others], len(colours))
    _add_legend(figure, axes, explored, colours)
    return figure


def _colours(pieces: Sequence[Piece]) -> dict[Formation, str]:
    """Colour of every formation, those with most configurations first; grey when none is left."""
    size: dict[Formation, tuple[int, int]] = defaultdict(lambda: (0, 0))
    for piece in pieces:
        count = len(configurations(piece))
        dimension, total = size[piece.formation]
        size[piece.formation] = (max(dimension, piece.dimension), total + count)
    ranked = sorted(size, key=lambda formation: (*(-n for n in size[formation]), formation))
    return {f: COLOURS[k] if k < len(COLOURS) else FAINT for k, f in enumerate(ranked)}


def _draw_plane(
    axes: Axes,
    explored: Exploration,
    pieces: Sequence[Piece],
    colours: dict[Formation, str],
    strength: float,
) -> None:
    for piece in pieces:
        if isinstance(piece, Sheet):
            axes.add_collection(
                PolyCollection(
                    list(_cells(explored, piece)),
                    facecolors=colours[piece.formation],
                    edgecolors='none',
                    alpha=0.8 * strength,
                    zorder=1.0,
                )
            )
    for piece in pieces:
        colour = colours[piece.formation]
        if piece.dimension == 1:
            line = [piece.points[:, 3:5]]
            axes.add_collection(
                LineCollection(line, colors=colour, linewidths=1.6, alpha=strength, zorder=2.0)
            )
        elif piece.dimension == 0:
            x, y = piece.points[0, 3:5]
            axes.plot(x, y, 'o', color=colour, markersize=3.5, alpha=strength, zorder=2.5)


def _cells(explored: Exploration, sheet: Sheet) -> FloatArray:
    """Rectangles around the vertices of a sheet, shape (s, 4, 2)."""
    regions = explored.roadmap.regions
    assert isinstance(regions, Sheets)
    half = np.full(len(sheet.vertices), 0.5 * regions.grid.finest)
    for vertex, beside in enumerate(sheet.edges):
        steps = [np.abs(sheet.vertices[vertex] - sheet.vertices[k])[3:].max() for k in beside]
        half[vertex] = 0.5 * min(steps, default=regions.grid.finest)
    corners = half[:, None, None] * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    cells = np.array(sheet.vertices)[:, None, 3:5] + corners
    return np.asarray(np.clip(cells, explored.system.lower, explored.system.upper))


def _draw_strips(
    axes: Axes, pieces: Sequence[Piece], colours: dict[Formation, str], strength: float
) -> None:
    rows = {formation: row for row, formation in enumerate(colours)}
    for piece in pieces:
        angles = piece.points[:, 3]
        row, colour = rows[piece.formation], colours[piece.formation]
        if piece.dimension == 0:
            axes.plot(angles, [row], 'o', color=colour, markersize=5, alpha=strength)
        else:
            low, high = float(angles.min()), float(angles.max())
            axes.barh(row, high - low, 0.6, low, color=colour, alpha=strength)


def _draw_grasps(axes: Axes, explored: Exploration, result: PlanResult | None, rows: int) -> None:
    problem = explored.problem
    goal = problem.goal.grasp(problem.hand)
    marks = [('start', 'o', problem.start.joints)]
    if goal is not None:
        marks.append(('goal', 's', goal.joints))
    two = explored.system.joint_count == 2
    middle = 0.5 * (rows - 1)
    if result is not None and result.solved:
        path = result.joints
        x, y = (path[:, 0], path[:, 1]) if two else (path[:, 0], np.full(len(path), middle))
        axes.plot(x, y, color=INK, linewidth=1.1, zorder=4.0, label='plan')
        if goal is None:
            marks.append(('goal', 's', path[-1]))
    for label, marker, joints in marks:
        y_mark = joints[1] if two else middle
        axes.plot(
            joints[0],
            y_mark,
            linestyle='none',
            marker=marker,
            markersize=7,
            markerfacecolor=PAPER,
            markeredgecolor=INK,
            markeredgewidth=1.4,
            zorder=5.0,
            label=label,
        )


def _view(explored: Exploration, drawn: Sequence[Piece]) -> tuple[FloatArray, FloatArray]:
    """Joint angles between which everything drawn lies, with a margin."""
    goal = explored.problem.goal.grasp(explored.problem.hand)
    grasps = [explored.problem.start, *([goal] if goal is not None else [])]
    points = np.concatenate(
        [*(configurations(piece)[:, 3:] for piece in drawn), *(g.joints[None] for g in grasps)]
    )
    low, high = points.min(axis=0), points.max(axis=0)
    margin = _MARGIN * np.maximum(high - low, 0.2)
    return low - margin, high + margin


def _frame(axes: Axes, explored: Exploration, drawn: Sequence[Piece], rows: int) -> None:
    system = explored.system
    names = explored.problem.hand.joint_names
    low, high = _view(explored, drawn)
    axes.set_xlim(low[0], high[0])
    axes.set_xlabel(f'{names[0]} (rad)', fontsize=FONT_SIZE, color=INK)
    for limit in (system.lower[0], system.upper[0]):
        axes.axvline(limit, color=FAINT, linewidth=0.7, zorder=0.5)
    if system.joint_count == 2:
        axes.set_ylim(low[1], high[1])
        axes.set_ylabel(f'{names[1]} (rad)', fontsize=FONT_SIZE, color=INK)
        for limit in (system.lower[1], system.upper[1]):
            axes.axhline(limit, color=FAINT, linewidth=0.7, zorder=0.5)
    else:
        axes.set_ylim(rows - 0.5, -0.5)
        axes.set_yticks([])
    axes.set_title(
        f'{explored.problem.name}: reachable formations',
        fontsize=FONT_SIZE,
        color=INK,
        loc='left',
    )


def _lines(explored: Exploration, formation: Formation) -> list[str]:
    """What the legend says of a formation."""
    names = list(explored.system.contact_names(formation.pairs))
    return [*names, '(second order)'] if is_second_order(formation) else names


def _add_legend(
    figure: Figure, axes: Axes, explored: Exploration, colours: dict[Formation, str]
) -> None:
    handles, labels = axes.get_legend_handles_labels()
    for formation in list(colours)[: len(COLOURS)]:
        handles.append(Line2D([], [], color=colours[formation], linewidth=5, alpha=_STRONG))
        labels.append('\n'.join(_lines(explored, formation)))
    if len(colours) > len(COLOURS):
        handles.append(Line2D([], [], color=FAINT, linewidth=5, alpha=_STRONG))
        labels.append(f'{len(colours) - len(COLOURS)} other formations')
    figure.legend(
        handles,
        labels,
        loc='upper left',
        bbox_to_anchor=axes_corner(figure, axes),
        fontsize=SMALL_FONT_SIZE - 1.0,
        frameon=False,
        labelspacing=0.6,
        borderaxespad=0.0,
    )


def axes_corner(figure: Figure, axes: Axes) -> tuple[float, float]:
    """Where the legend begins: right of the axes' upper corner, in parts of the figure."""
    box = axes.get_position()
    return float(box.x1 + 0.12 / figure.get_size_inches()[0]), float(box.y1)
