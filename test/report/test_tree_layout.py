from __future__ import annotations

from itertools import combinations

from hypothesis import given
from hypothesis import strategies as st

from cfplan_core.report.figures.tree_layout import FIRST_ROW, depths_of, lay_out, path_of
from cfplan_core.trajectory.plan_result import TreeNode


@st.composite
def trees(draw: st.DrawFn) -> list[TreeNode]:
    """Any tree of up to 60 nodes, with a path from its root to any of them."""
    parents = [None]
    for k in range(1, draw(st.integers(1, 60))):
        parents.append(draw(st.integers(0, k - 1)))
    path = set()
    node = draw(st.none() | st.integers(0, len(parents) - 1))
    while node is not None:
        path.add(node)
        node = parents[node]
    return [TreeNode(p, (), '', 1, k in path, False) for k, p in enumerate(parents)]


@given(trees())
def test_a_nodes_level_is_its_depth(tree: list[TreeNode]) -> None:
    assert [level for level, _ in lay_out(tree)] == depths_of(tree)


@given(trees())
def test_nodes_of_a_level_are_a_row_apart(tree: list[TreeNode]) -> None:
    layout = lay_out(tree)
    for (level, row), (other_level, other_row) in combinations(layout, 2):
        assert level != other_level or abs(row - other_row) > 1.0 - 1e-9


@given(trees())
def test_the_path_alone_is_on_row_zero(tree: list[TreeNode]) -> None:
    path = path_of(tree)
    for k, (_, row) in enumerate(lay_out(tree)):
        assert row == 0.0 if k in path else row >= FIRST_ROW


@given(trees())
def test_arcs_do_not_cross(tree: list[TreeNode]) -> None:
    layout = lay_out(tree)
    arcs = [(layout[n.parent], layout[k]) for k, n in enumerate(tree) if n.parent is not None]
    for (start, end), (other_start, other_end) in combinations(arcs, 2):
        if start[0] == other_start[0]:
            assert (start[1] - other_start[1]) * (end[1] - other_end[1]) > -1e-9


@given(trees())
def test_the_path_starts_at_the_root_and_follows_parents(tree: list[TreeNode]) -> None:
    path = path_of(tree)
    assert path[0] == 0
    assert [tree[k].parent for k in path[1:]] == list(path[:-1])
    assert all(tree[k].on_path for k in path[1:])
    assert sum(node.on_path for node in tree) in (0, len(path))


def test_a_chain_off_the_path_is_straight() -> None:
    tree = [TreeNode(None if k == 0 else k - 1, (), '', 1, False, False) for k in range(4)]
    assert lay_out(tree) == ((0, 0.0), (1, FIRST_ROW), (2, FIRST_ROW), (3, FIRST_ROW))


def test_a_parent_is_amid_its_children() -> None:
    tree = [TreeNode(parent, (), '', 1, False, False) for parent in (None, 0, 1, 1, 1)]
    rows = [row for _, row in lay_out(tree)]
    assert rows[1] == (rows[2] + rows[4]) / 2.0
