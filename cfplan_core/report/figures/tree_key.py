"""The letters of contact formations in the tree figure, and what its marks mean."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any

from matplotlib.axes import Axes

from cfplan_core.contact.elements import ElementalContact, parse_contact
from cfplan_core.model import Problem
from cfplan_core.report.figures.drawing import text_widths
from cfplan_core.report.figures.labels import letter
from cfplan_core.report.figures.tree_layout import path_of
from cfplan_core.report.figures.tree_nodes import PATH_RADIUS, Place, draw_meeting, draw_node
from cfplan_core.report.scene import elements, short_body_names
from cfplan_core.report.style import INK, MUTED, SMALL_FONT_SIZE, STABILITY, stability_style
from cfplan_core.trajectory.plan_result import PlanResult, TreeNode

LINE = 0.165
LEGEND_LINE = 0.28
_LETTER_WIDTH = 0.27
_SHAPES = {0: '0, a single grasp', 1: '1, a curve', 2: '2 or more'}

LegendEntry = tuple[TreeNode | None, str]
LegendRow = tuple[str, tuple[LegendEntry, ...]]


def formation_letters(trees: Sequence[Sequence[TreeNode]]) -> dict[frozenset[str], str]:
    """Formations to letters: those on the path first, from start to goal, then tree by tree."""
    paths = [[tree[k] for k in path_of(tree)] if tree else [] for tree in trees]
    order = [*paths[0], *reversed(paths[1]), *(node for tree in trees for node in tree)]
    found = dict.fromkeys(frozenset(node.contacts) for node in order)
    return {formation: letter(k) for k, formation in enumerate(found)}


def key_lines(problem: Problem, letters: Mapping[frozenset[str], str]) -> list[tuple[str, str]]:
    """Letter and contacts, body by body: ``palm v0·e2 v1·e2, left v3·e0``.

    Raises:
        CfplanError: A contact's name is malformed.
    """
    short = short_body_names(problem)
    order = {body: k for k, body in enumerate(problem.hand.body_names)}
    lines = []
    for formation, name in letters.items():
        contacts = sorted(
            (parse_contact(contact) for contact in formation),
            key=lambda c: (order.get(c.body, len(order)), c.body, elements(c)),
        )
        parts = [
            short.get(body, body) + ''.join(f' {_pair(contact)}' for contact in group)
            for body, group in groupby(contacts, key=lambda c: c.body)
        ]
        lines.append((name, ', '.join(parts) or 'no contact'))
    return lines


def _pair(contact: ElementalContact) -> str:
    """Element of the object and of the hand: ``v3·e0``."""
    return '·'.join(word[0] + word.split()[1] for word in elements(contact))


def key_width(lines: Sequence[tuple[str, str]]) -> float:
    """Width that a column of a key needs, inches."""
    return max(text_widths([text for _, text in lines])) + _LETTER_WIDTH + 0.2


def write_key(
    axes: Axes, lines: Sequence[tuple[str, str]], columns: int, left: float, top: float
) -> None:
    """Write the key column by column.

    Args:
        axes: Whose data are inches.
        lines: Letters and contacts.
        columns: How many.
        left: Left end, and margin on the right.
        top: Middle of the heading.
    """
    axes.text(
        left,
        top,
        'contact formations: element of the object · element of the hand (v vertex, e edge)',
        va='center',
        fontsize=SMALL_FONT_SIZE,
        color=MUTED,
    )
    pitch = (axes.get_xlim()[1] - 2.0 * left) / columns
    rows = -(-len(lines) // columns)
    for k, (name, text) in enumerate(lines):
        column, row = divmod(k, rows)
        x, y = left + column * pitch, top - LINE * (row + 1)
        look: dict[str, Any] = {'va': 'center', 'fontsize': SMALL_FONT_SIZE, 'color': INK}
        axes.text(x, y, name, fontweight='bold', **look)
        axes.text(x + _LETTER_WIDTH, y, text, **look)


def legend_rows(result: PlanResult) -> tuple[LegendRow, ...]:
    """What the marks that occur in the trees mean: fill, shape, outline."""
    nodes = [node for tree in result.trees for node in tree]
    fills: list[LegendEntry] = [
        (TreeNode(None, (), stability, 1, False, False), stability_style(stability).label)
        for stability in (*STABILITY, '')
        if any(node.stability == stability for node in nodes)
    ]
    shapes: list[LegendEntry] = [
        (TreeNode(None, (), 'second_order', dimension, False, False), label)
        for dimension, label in _SHAPES.items()
        if any(min(node.dimension, 2) == dimension for node in nodes)
    ]
    others: list[LegendEntry] = []
    if any(node.on_path for node in nodes):
        others.append((TreeNode(None, (), 'second_order', 1, True, False), 'on the path'))
    if any(node.shared for node in nodes):
        others.append((TreeNode(None, (), 'second_order', 1, False, True), 'in both trees'))
    if result.solved and all(result.trees):
        others.append((None, 'the trees meet'))
    rows = (('stability', fills), ('dimension', shapes), ('plan', others))
    return tuple((heading, tuple(entries)) for heading, entries in rows if entries)


def draw_legend(axes: Axes, rows: Sequence[LegendRow], left: float, top: float) -> None:
    """Draw a legend, the first row's middle at a height in inches."""
    words: dict[str, Any] = {'va': 'center', 'fontsize': SMALL_FONT_SIZE}
    indent = max(text_widths([heading for heading, _ in rows])) + 0.2
    for k, (heading, entries) in enumerate(rows):
        y = top - LEGEND_LINE * k
        axes.text(left, y, heading, color=MUTED, **words)
        x = left + indent + PATH_RADIUS
        for (node, label), width in zip(
            entries, text_widths([label for _, label in entries]), strict=True
        ):
            if node is None:
                draw_meeting(axes, Place(x - PATH_RADIUS, y), Place(x + PATH_RADIUS, y))
            else:
                draw_node(axes, Place(x, y), node, '')
            axes.text(x + PATH_RADIUS + 0.08, y, label, color=INK, **words)
            x += width + 2.0 * PATH_RADIUS + 0.33
