"""Draw a hand, an object and contacts into axes whose scale is that of the world."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon

from cfplan_core.model import Grasp, Problem
from cfplan_core.report.scene import ContactMark, View, scale_length
from cfplan_core.report.style import (
    DPI,
    FONT_SIZE,
    INK,
    MUTED,
    OBJECT,
    PALM,
    PAPER,
    SMALL_FONT_SIZE,
    body_colours,
    finger_colours,
)

CONTACTS = 'contacts'
OBJECT_LAYER = 2
HAND_LAYER = 3
CONTACT_LAYER = 5
_LEGEND_COLUMNS = 6


def new_figure(width: float, height: float) -> Figure:
    """Make a figure of a size in inches, with a canvas that can measure text."""
    figure = Figure(figsize=(width, height), dpi=DPI)
    FigureCanvasAgg(figure)
    return figure


def axes_at(figure: Figure, left: float, bottom: float, width: float, height: float) -> Axes:
    """Add axes at a place given in inches from the figure's lower left corner."""
    across, up = figure.get_size_inches()
    return figure.add_axes((left / across, bottom / up, width / across, height / up))


def text_widths(texts: Sequence[str]) -> list[float]:
    """Widths of small texts, inches."""
    figure = new_figure(1.0, 1.0)
    canvas: Any = figure.canvas
    renderer = canvas.get_renderer()
    written = [figure.text(0.0, 0.0, text, fontsize=SMALL_FONT_SIZE) for text in texts]
    return [text.get_window_extent(renderer).width / figure.dpi for text in written]


def world_axes(
    figure: Figure, left: float, bottom: float, width: float, view: View, boxed: bool = True
) -> Axes:
    """Add axes that show a view of the world at equal scales.

    Args:
        figure: To add to.
        left: Of the axes, inches from the figure's left.
        bottom: Of the axes, inches from the figure's bottom.
        width: Of the axes, inches; the height follows from the view.
        view: What they show.
        boxed: True for a thin frame around.
    """
    axes = axes_at(figure, left, bottom, width, width * view.height / view.width)
    axes.set_xlim(view.left, view.right)
    axes.set_ylim(view.bottom, view.top)
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set_visible(boxed)
        spine.set_color(MUTED)
        spine.set_linewidth(0.5)
    return axes


def draw_bodies(axes: Axes, problem: Problem, grasp: Grasp) -> dict[str, Polygon]:
    """Draw the object and the hand.

    Returns:
        Body name (``object`` for the object) to its polygon, whose corners may be moved later.
    """
    colours = body_colours(problem.hand)
    placed = {'object': problem.object.world_vertices(grasp.object_pose)}
    placed |= problem.hand.world_vertices(grasp.joints)
    polygons = {}
    for name, vertices in placed.items():
        polygons[name] = Polygon(
            vertices,
            closed=True,
            facecolor=colours[name],
            edgecolor=INK,
            linewidth=0.6,
            joinstyle='round',
            zorder=OBJECT_LAYER if name == 'object' else HAND_LAYER,
        )
        polygons[name].set_gid(name)
        axes.add_patch(polygons[name])
    return polygons


def draw_contacts(
    axes: Axes, marks: Sequence[ContactMark], arrow: float, size: float = 4.0
) -> tuple[Artist, ...]:
    """Mark contacts by a dot, and by an arrow along the normal into the object.

    Args:
        axes: To draw into.
        marks: Contacts.
        arrow: Length of the arrows, m.
        size: Diameter of the dots, points.

    Returns:
        What was drawn.
    """
    drawn: list[Artist] = [
        axes.annotate(
            '',
            xy=tuple(mark.point + arrow * mark.normal),
            xytext=tuple(mark.point),
            arrowprops={
                'arrowstyle': '-|>,head_length=0.35,head_width=0.16',
                'color': INK,
                'linewidth': 0.25 * size,
                'shrinkA': 0.0,
                'shrinkB': 0.0,
                'mutation_scale': 2.6 * size,
            },
            zorder=CONTACT_LAYER,
        )
        for mark in marks
    ]
    points = np.array([mark.point for mark in marks]).reshape(-1, 2)
    drawn += axes.plot(
        points[:, 0],
        points[:, 1],
        linestyle='none',
        marker='o',
        markersize=size,
        markerfacecolor=PAPER,
        markeredgecolor=INK,
        markeredgewidth=0.25 * size,
        zorder=CONTACT_LAYER + 1,
        gid=CONTACTS,
    )
    return tuple(drawn)


def header_width(problem: Problem, view: View, panel: float) -> float:
    """Width that `figure_header` needs, inches.

    Args:
        problem: Whose bodies.
        view: What the axes show.
        panel: Width of the axes, inches.
    """
    em = FONT_SIZE / 72.0
    names = text_widths([name for name, _ in _legend_entries(problem)])
    columns = [width * FONT_SIZE / SMALL_FONT_SIZE + 4.2 * em for width in names]
    bar = panel * scale_length(view) / view.width
    return sum(sorted(columns)[-_LEGEND_COLUMNS:]) + max(text_widths(['0000 mm'])) + bar + 0.2


def _legend_entries(problem: Problem) -> list[tuple[str, str]]:
    """Names and colours of the palm, the fingers and the object."""
    palm = [('palm', PALM)] if problem.hand.palm else []
    return [*palm, *finger_colours(problem.hand).items(), ('object', OBJECT)]


def figure_header(figure: Figure, problem: Problem, axes: Axes, view: View) -> None:
    """Say in one row at the top which colour is which body, and how long a length of the view is.

    Args:
        figure: To write on.
        problem: Whose bodies.
        axes: Any that shows the view.
        view: What the axes show.
    """
    across, up = figure.get_size_inches()
    top = up - 0.08
    entries = _legend_entries(problem)
    figure.legend(
        handles=[
            Patch(facecolor=colour, edgecolor=INK, linewidth=0.6, label=name)
            for name, colour in entries
        ],
        loc='upper left',
        bbox_to_anchor=(0.1 / across, top / up),
        ncols=min(len(entries), _LEGEND_COLUMNS),
        frameon=False,
        fontsize=FONT_SIZE,
        handlelength=1.4,
        borderaxespad=0.0,
        borderpad=0.0,
    )
    length = scale_length(view)
    right = across - 0.1
    left = right - length / view.width * axes.get_position().width * across
    height = top - 0.03
    figure.add_artist(
        Line2D([left / across, right / across], [height / up] * 2, color=INK, linewidth=1.5)
    )
    figure.text(
        left / across - 0.06 / across,
        height / up,
        f'{1000.0 * length:g} mm',
        ha='right',
        va='center',
        fontsize=SMALL_FONT_SIZE,
        color=INK,
    )
