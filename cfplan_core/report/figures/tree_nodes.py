"""Draw nodes and arcs of CF-trees: shape says dimension, fill stability, outline the path."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import pi

from matplotlib.axes import Axes
from matplotlib.patches import Circle, Patch, PathPatch, RegularPolygon
from matplotlib.path import Path

from cfplan_core.report.style import FAINT, INK, MUTED, SMALL_FONT_SIZE, STABILITY, stability_style
from cfplan_core.trajectory.plan_result import TreeNode

NODE_LABEL = 'node label'
PATH_RADIUS = 0.12
_RADIUS = 0.1
_EDGE_LAYER, _NODE_LAYER, _TEXT_LAYER = 1, 3, 4


@dataclass(frozen=True)
class Place:
    """A point on paper, inches from the axes' lower left corner."""

    x: float
    y: float


def draw_tree(
    axes: Axes,
    tree: Sequence[TreeNode],
    places: Sequence[Place],
    letters: Mapping[frozenset[str], str],
) -> None:
    """Draw a tree into axes whose data are inches.

    Args:
        axes: To draw into.
        tree: Parents before children.
        places: Of the nodes.
        letters: What to write on a node of a formation.
    """
    for node, place in zip(tree, places, strict=True):
        if node.parent is not None:
            on_path = node.on_path and tree[node.parent].on_path
            _draw_arc(axes, places[node.parent], place, on_path)
        draw_node(axes, place, node, letters[frozenset(node.contacts)])


def draw_node(axes: Axes, place: Place, node: TreeNode, letter: str) -> None:
    """Draw one node with its letter; a node that is in both trees has a ring around."""
    radius = PATH_RADIUS if node.on_path else _RADIUS
    if node.shared:
        axes.add_patch(
            Circle(
                (place.x, place.y),
                radius + 0.035,
                facecolor='none',
                edgecolor=INK,
                linewidth=0.7,
                zorder=_NODE_LAYER,
            )
        )
    axes.add_patch(_node_patch(place, node, radius))
    axes.text(
        place.x,
        place.y,
        letter,
        ha='center',
        va='center_baseline',
        fontsize=(SMALL_FONT_SIZE if node.on_path else 7.0) - 0.8 * (len(letter) - 1),
        fontweight='bold' if node.on_path else 'normal',
        color=stability_style(node.stability).text,
        zorder=_TEXT_LAYER,
        gid=NODE_LABEL,
    )


def draw_meeting(axes: Axes, start: Place, end: Place) -> None:
    """Draw the line on which the trees meet."""
    axes.plot(
        [start.x, end.x],
        [start.y, end.y],
        color=INK,
        linewidth=2.2,
        linestyle=(0, (2.0, 1.2)),
        zorder=_EDGE_LAYER,
    )


def _node_patch(place: Place, node: TreeNode, radius: float) -> Patch:
    centre = (place.x, place.y)
    if node.dimension == 1:
        patch: Patch = Circle(centre, radius)
    elif node.dimension == 0:
        patch = RegularPolygon(centre, 4, radius=1.2 * radius, orientation=pi / 4.0)
    else:
        patch = RegularPolygon(centre, 6, radius=1.2 * radius)
    patch.set_facecolor(stability_style(node.stability).fill)
    patch.set_edgecolor(INK if node.on_path else MUTED)
    patch.set_linewidth(2.0 if node.on_path else 0.7)
    patch.set_linestyle('-' if node.stability in STABILITY else (0, (1.5, 1.0)))
    patch.set_zorder(_NODE_LAYER)
    return patch


def _draw_arc(axes: Axes, start: Place, end: Place, on_path: bool) -> None:
    middle = (start.x + end.x) / 2.0
    points = [(start.x, start.y), (middle, start.y), (middle, end.y), (end.x, end.y)]
    axes.add_patch(
        PathPatch(
            Path(points, [Path.MOVETO, Path.CURVE4, Path.CURVE4, Path.CURVE4]),
            fill=False,
            edgecolor=INK if on_path else FAINT,
            linewidth=2.2 if on_path else 0.9,
            zorder=_EDGE_LAYER,
        )
    )
