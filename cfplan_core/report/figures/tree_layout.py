"""Place the nodes of a CF-tree: levels in one direction, the plan's path on a straight row."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from cfplan_core.trajectory.plan_result import TreeNode

FIRST_ROW = 1.4


def path_of(tree: Sequence[TreeNode]) -> tuple[int, ...]:
    """Nodes from the root to the last one on the plan's path; only the root without a plan."""
    depths = depths_of(tree)
    node = max(
        (k for k in range(len(tree)) if tree[k].on_path), key=lambda k: depths[k], default=0
    )
    path = [node]
    while (parent := tree[path[-1]].parent) is not None:
        path.append(parent)
    return tuple(reversed(path))


def depths_of(tree: Sequence[TreeNode]) -> list[int]:
    """Number of arcs from the root to every node; parents come before children."""
    depths: list[int] = []
    for node in tree:
        depths.append(0 if node.parent is None else depths[node.parent] + 1)
    return depths


def lay_out(tree: Sequence[TreeNode]) -> tuple[tuple[int, float], ...]:
    """Place the nodes of a tree on levels and rows.

    The path is alone on row 0. What hangs on it is packed from `FIRST_ROW` on, that of the
    deepest nodes first, so that nodes of one level are at least one row apart and no arcs cross.

    Args:
        tree: Parents before children, at least the root.

    Returns:
        Level and row of every node.
    """
    depths = depths_of(tree)
    children: dict[int, list[int]] = {k: [] for k in range(len(tree))}
    for k, node in enumerate(tree):
        if node.parent is not None:
            children[node.parent].append(k)
    path = path_of(tree)
    rows = dict.fromkeys(path, 0.0)
    outline: dict[int, float] = {}
    for parent in reversed(path):
        for child in (k for k in children[parent] if k not in path):
            subtree = _subtree(child, children, depths)
            shift = max(_beyond(outline, subtree, depths), FIRST_ROW)
            for member, row in subtree.items():
                rows[member] = row + shift
                outline[depths[member]] = max(outline.get(depths[member], 0.0), row + shift)
    return tuple((depths[k], rows[k]) for k in range(len(tree)))


def _subtree(
    root: int, children: Mapping[int, Sequence[int]], depths: Sequence[int]
) -> dict[int, float]:
    """Rows of a subtree's nodes, the least of which is zero; parents are amid their children."""
    rows: dict[int, float] = {}
    outline: dict[int, float] = {}
    heads = []
    for child in children[root]:
        branch = _subtree(child, children, depths)
        shift = _beyond(outline, branch, depths)
        heads.append(branch[child] + shift)
        for member, row in branch.items():
            rows[member] = row + shift
            level = depths[member]
            outline[level] = max(outline.get(level, row + shift), row + shift)
    rows[root] = (heads[0] + heads[-1]) / 2.0 if heads else 0.0
    lowest = min(rows.values())
    return {member: row - lowest for member, row in rows.items()}


def _beyond(
    outline: Mapping[int, float], subtree: Mapping[int, float], depths: Sequence[int]
) -> float:
    """Shift that puts a subtree one row beyond what each level already holds; 0 if nothing."""
    return max(
        (
            outline[depths[member]] + 1.0 - row
            for member, row in subtree.items()
            if depths[member] in outline
        ),
        default=0.0,
    )
