"""Figure 3: the start and the goal grasp, and Table 1: their contact formations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.path import Path

from cfplan_core.contact.elements import parse_contact
from cfplan_core.geometry.polygon import FloatArray, centroid
from cfplan_core.model import Grasp, Problem
from cfplan_core.report.figures.drawing import (
    CONTACT_LAYER,
    axes_at,
    draw_bodies,
    draw_contacts,
    figure_header,
    header_width,
    new_figure,
    text_widths,
    world_axes,
)
from cfplan_core.report.figures.labels import Label, letter, place_labels, point_boxes
from cfplan_core.report.scene import (
    ContactMark,
    contact_marks,
    elements,
    frame_contacts,
    plan_grasps,
    view_of,
)
from cfplan_core.report.style import FAINT, FONT_SIZE, INK, MUTED, SMALL_FONT_SIZE
from cfplan_core.trajectory.plan_result import PlanResult

_PANEL = 3.4
_GAP = 0.25
_ROW = 0.17


def grasps_figure(problem: Problem, result: PlanResult) -> Figure:
    """Start and goal grasp side by side, contacts lettered, each with its table of contacts.

    The goal of a search without a plan is drawn only if the problem gives it in full.

    Raises:
        CfplanError: A contact's name does not fit the problem.
    """
    panels = grasps_of(problem, result)
    view = view_of(problem, [grasp for _, grasp, _ in panels], margin=0.1)
    rows = max(len(contacts) for _, _, contacts in panels)
    columns = [_column_widths(contacts) for _, _, contacts in panels]
    panel = max(_PANEL, *(sum(widths) + 0.2 * len(widths) for widths in columns))
    if len(panels) == 1:
        # The scale bar in the header grows with the panel, by at most a fifth of it.
        panel = max(panel, (header_width(problem, view, panel) - 0.2 * panel) / 0.8)
    scene = panel * view.height / view.width
    table = _ROW * (rows + 1) + 0.1 if rows else 0.0
    width = 0.2 + len(panels) * (panel + _GAP) - _GAP
    figure = new_figure(width, 0.1 + table + 0.3 + scene + 0.3)
    for k, (title, grasp, contacts) in enumerate(panels):
        left = 0.1 + k * (panel + _GAP)
        axes = world_axes(figure, left, 0.1 + table + 0.3, panel, view)
        marks = contact_marks(problem, grasp, contacts)
        _draw_grasp(axes, problem, grasp, marks, view.width / 150.0)
        if k == 0:
            figure_header(figure, problem, axes, view)
        axes.set_xlabel(title, fontsize=FONT_SIZE + 1.0, color=INK, labelpad=4.0)
        if contacts:
            _draw_table(axes_at(figure, left, 0.1, panel, table), contacts, rows, panel)
    return figure


def grasps_of(
    problem: Problem, result: PlanResult
) -> tuple[tuple[str, Grasp, tuple[str, ...]], ...]:
    """Title, grasp and contacts of the start and, where it is known, of the goal.

    Contacts are those at the roots of the trees; for a plan without trees, those of its ends.
    """
    initial, goal = (tree[0].contacts if tree else () for tree in result.trees)
    if result.solved:
        grasps = plan_grasps(result)
        initial = initial or frame_contacts(result.segments, 0)
        goal = goal or frame_contacts(result.segments, len(grasps) - 1)
        return (('(a) start', grasps[0], initial), ('(b) goal', grasps[-1], goal))
    panels = (('(a) start', problem.start, initial),)
    last = problem.goal.grasp(problem.hand)
    return panels if last is None else (*panels, ('(b) goal', last, goal))


def _draw_grasp(
    axes: Axes, problem: Problem, grasp: Grasp, marks: Sequence[ContactMark], spacing: float
) -> None:
    draw_bodies(axes, problem, grasp)
    arrow = 0.3 * problem.object.size
    draw_contacts(axes, marks, arrow)
    vertices = problem.object.world_vertices(grasp.object_pose)
    points = np.array([mark.point for mark in marks]).reshape(-1, 2)
    normals = np.array([mark.normal for mark in marks]).reshape(-1, 2)
    outlines = [vertices, *problem.hand.world_vertices(grasp.joints).values()]
    taken = np.vstack(
        [
            point_boxes(axes, points, 4.0),
            *(point_boxes(axes, points + part * arrow * normals, 3.0) for part in (0.4, 0.7, 1.0)),
            *(point_boxes(axes, along(outline, spacing), 1.2) for outline in outlines),
        ]
    )
    hand = np.vstack(
        [point_boxes(axes, inside(outline, 4.0 * spacing), 3.0) for outline in outlines[1:]]
    )
    letters = [
        Label(
            letter(k).lower(),
            mark.point,
            -mark.normal,
            {
                'fontsize': FONT_SIZE + 1.0,
                'fontweight': 'bold',
                'color': INK,
                'zorder': CONTACT_LAYER + 2,
                'bbox': {
                    'boxstyle': 'circle,pad=0.12',
                    'facecolor': 'white',
                    'edgecolor': INK,
                    'linewidth': 0.5,
                },
            },
            distance=13.0,
        )
        for k, mark in enumerate(marks)
    ]
    numbers = [
        Label(
            str(k),
            vertex,
            inward_direction(vertices, k),
            {'fontsize': SMALL_FONT_SIZE, 'color': INK, 'zorder': CONTACT_LAYER + 2},
            avoid=hand,
        )
        for k, vertex in enumerate(vertices)
    ]
    place_labels(axes, [*letters, *numbers], taken)


def along(vertices: FloatArray, spacing: float) -> FloatArray:
    """Points along a polygon's edges, shape (p, 2), at most a spacing apart, m."""
    edges = np.roll(vertices, -1, axis=0) - vertices
    return np.concatenate(
        [
            start + np.linspace(0.0, 1.0, int(np.hypot(*edge) / spacing) + 2)[:, None] * edge
            for start, edge in zip(vertices, edges, strict=True)
        ]
    )


def inside(vertices: FloatArray, spacing: float) -> FloatArray:
    """Points of a square grid that lie in a polygon, shape (p, 2), m."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    counts = np.ceil((high - low) / spacing).astype(int) + 1
    across, up = (np.linspace(a, b, n) for a, b, n in zip(low, high, counts, strict=True))
    grid = np.stack(np.meshgrid(across, up), axis=-1).reshape(-1, 2)
    return np.asarray(grid[Path(vertices).contains_points(grid)])


def inward_direction(vertices: FloatArray, k: int) -> FloatArray:
    """Direction from a vertex into the polygon, shape (2,): the middle of its inner angle."""
    before = vertices[k - 1] - vertices[k]
    after = vertices[(k + 1) % len(vertices)] - vertices[k]
    middle = before / np.hypot(*before) + after / np.hypot(*after)
    if np.hypot(*middle) < 1e-6:
        return np.asarray(centroid(vertices) - vertices[k])
    turns_left = before[1] * after[0] - before[0] * after[1] >= 0.0
    return np.asarray(middle if turns_left else -middle)


def _table_cells(contacts: Sequence[str]) -> list[tuple[str, str, str, str]]:
    """Rows of the paper's Table 1, with the contacts' letters and a heading."""
    cells = [('', 'object element', 'body', 'hand element')]
    for k, name in enumerate(contacts):
        contact = parse_contact(name)
        on_object, on_hand = elements(contact)
        cells.append((letter(k).lower(), on_object, contact.body, on_hand))
    return cells


def _column_widths(contacts: Sequence[str]) -> list[float]:
    """Widths of the table's columns, inches."""
    return [max(text_widths(column)) for column in zip(*_table_cells(contacts), strict=True)]


def _draw_table(axes: Axes, contacts: Sequence[str], rows: int, width: float) -> None:
    """Write the table from the top of axes of a width in inches and a height in rows."""
    axes.set_axis_off()
    axes.set_xlim(0.0, width)
    axes.set_ylim(rows + 1.0, 0.0)
    widths = _column_widths(contacts)
    gap = min(0.3, (width - 0.2 - sum(widths)) / (len(widths) - 1))
    axes.plot([0.05, width - 0.05], [1.0, 1.0], color=FAINT, linewidth=0.6)
    for row, texts in enumerate(_table_cells(contacts)):
        x = 0.1
        for column, text in enumerate(texts):
            axes.text(
                x,
                row + 0.5,
                text,
                fontsize=SMALL_FONT_SIZE,
                fontweight='bold' if row and column == 0 else 'normal',
                color=INK if row else MUTED,
                va='center',
            )
            x += widths[column] + gap
