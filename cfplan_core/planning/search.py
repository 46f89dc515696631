"""Grow the two CF-trees, from the start and from the goal, until they hold a common piece.

Trinkle & Hunter (1991), Section 2.2. The trees grow a level at a time, the smaller one first, and
join where the path through both has fewest pieces. As the model is reversible both grow by the
same transitions, and a complete tree that does not hold the other's root is proof that there is
no path in the pieces explored.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from cfplan_core.contact.formation import Formation
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import Stability
from cfplan_core.planning.goal_test import GoalTest
from cfplan_core.planning.pieces import Piece
from cfplan_core.planning.roadmap import Roadmap


@dataclass(frozen=True, eq=False)
class Leg:
    """A stretch of a path inside one piece.

    Attributes:
        piece: Index of the piece.
        formation: The contacts.
        stability: The class.
        points: Shape (s, 3 + n); the first is the last of the leg before.
    """

    piece: int
    formation: Formation
    stability: Stability
    points: FloatArray


@dataclass(frozen=True, eq=False)
class Node:
    """A node of a CF-tree.

    Attributes:
        piece: What the tree holds.
        parent: Index of the parent node, None for the root.
        entry: Configuration where the arc from the parent enters, shape (3 + n,).
        depth: Number of arcs from the root.
    """

    piece: Piece
    parent: int | None
    entry: FloatArray | None
    depth: int


@dataclass(eq=False)
class Tree:
    """One CF-tree.

    Attributes:
        root: Configuration that it grows from, shape (3 + n,).
        nodes: Parents before children.
    """

    root: FloatArray
    nodes: list[Node] = field(default_factory=list)
    frontier: list[int] = field(default_factory=list)
    index_of: dict[int, int] = field(default_factory=dict)

    def add(self, node: Node) -> int:
        """Add a node to the tree's outermost level and return its index."""
        self.nodes.append(node)
        self.index_of[node.piece.index] = len(self.nodes) - 1
        return len(self.nodes) - 1

    def chain(self, index: int) -> list[Node]:
        """Nodes from the root to a node."""
        nodes = []
        at: int | None = index
        while at is not None:
            nodes.append(self.nodes[at])
            at = self.nodes[at].parent
        return nodes[::-1]


class PathTrees:
    """A path that was found otherwise, as CF-trees.

    Attributes:
        trees: The initial tree is the pieces of the path one after the other, the goal's the last.
        meeting: Index of the last piece.
    """

    def __init__(self, roadmap: Roadmap, legs: Sequence[Leg]) -> None:
        """Make the trees of a path of one leg or more."""
        initial, goal = Tree(legs[0].points[0]), Tree(legs[-1].points[-1])
        for index, leg in enumerate(legs):
            parent, entry = (index - 1, leg.points[0]) if index else (None, None)
            initial.add(Node(roadmap.pieces[leg.piece], parent, entry, index))
        self.meeting = legs[-1].piece
        goal.add(Node(roadmap.pieces[self.meeting], None, None, 0))
        self.trees = (initial, goal)


class Search:
    """Two trees over one roadmap; only the initial one if the goal is not a whole grasp.

    Attributes:
        roadmap: What was explored.
        trees: The initial and the goal tree.
        meeting: Index of the piece where they joined or the goal was found, or None.
    """

    def __init__(
        self,
        roadmap: Roadmap,
        start: FloatArray,
        goal: FloatArray | GoalTest,
        blocked: frozenset[int] = frozenset(),
        grown: Callable[[int, int], None] = lambda initial, goal: None,
    ) -> None:
        """Root the trees.

        Args:
            roadmap: To grow in.
            start: Stable configuration, shape (3 + n,).
            goal: Stable configuration, shape (3 + n,), or a test that finds one on a piece.
            blocked: Indices of pieces that may not be used.
            grown: Called with the trees' numbers of nodes before one is added; may raise.
        """
        self.roadmap = roadmap
        self.trees = (Tree(start), Tree(start))
        self.meeting: int | None = None
        self._test: GoalTest | None = None
        if isinstance(goal, GoalTest):
            self._test = goal
            self._roots: tuple[Tree, ...] = self.trees[:1]
        else:
            self.trees = (Tree(start), Tree(goal))
            self._roots = self.trees
        self._blocked = blocked
        self._grown = grown
        self._crossing = False
        self._settling = False

    def run(self) -> bool:
        """Grow until the trees join (true) or one of them is complete without it (false)."""
        for tree in self._roots:
            piece = self.roadmap.root(tree.root)
            if piece.index in self._blocked:
                return False
            tree.frontier = [tree.add(Node(piece, None, None, 0))]
        # A grasp that is stable to second order is left where others lose their stability.
        roots = [tree.nodes[0].piece for tree in self._roots]
        self._settling = any(p.stability is Stability.SECOND_ORDER for p in roots)
        self._look(self.trees[0].nodes[0].piece, self.trees[0].root)
        # Among points and curves a complete tree is proof: the other can do no more.
        while self.meeting is None and all(tree.frontier for tree in self._roots):
            self._grow()
        if self.meeting is None:
            # Points and curves are exhausted: open contacts and cross regions.
            self._crossing = True
            self._grow_again()
        if self.meeting is None and self.roadmap.model.second_order and not self._settling:
            # So is stability of first order: let contacts go that carry nothing.
            self._settling = True
            self._grow_again()
        return self.meeting is not None

    def _grow_again(self) -> None:
        """Grow from all nodes until the trees join or are complete."""
        for tree in self._roots:
            tree.frontier = list(range(len(tree.nodes)))
        while self.meeting is None and any(tree.frontier for tree in self._roots):
            self._grow()

    def _look(self, piece: Piece, entry: FloatArray) -> bool:
        """Tell whether a piece of the initial tree ends the search, and remember it if so."""
        if self._test is None:
            found = piece.index in self.trees[1].index_of
        else:
            goal = self._fulfilled(self._test, piece, entry)
            found = goal is not None
            if goal is not None:
                self.trees[1].root = goal
                self.trees[1].add(Node(piece, None, None, 0))
        if found:
            self.meeting = piece.index
        return found

    def _fulfilled(self, test: GoalTest, piece: Piece, entry: FloatArray) -> FloatArray | None:
        """Where a piece fulfils a partial goal, shape (3 + n,): the start, if it does."""
        if piece is self.trees[0].nodes[0].piece and test.may_hold(piece):
            start = self.trees[0].root
            if test.fits(start):
                return start
        return test.first(piece, self.roadmap.regions, entry)

    def _neighbours(self, piece: Piece) -> Iterator[tuple[FloatArray, Piece]]:
        yield from self.roadmap.neighbours(piece)
        if self._crossing:
            yield from self.roadmap.regions.beside(piece)
        if self._settling:
            yield from self.roadmap.settling.beside(piece)

    def _grow(self) -> None:
        """Add a level to the tree with the smaller frontier; join at least depth if they meet."""
        growing = [tree for tree in self._roots if tree.frontier]
        tree = min(growing, key=lambda tree: len(tree.frontier))
        other = self.trees[1] if tree is self.trees[0] else self.trees[0]
        level = []
        best: tuple[int, int] | None = None
        for index in tree.frontier:
            node = tree.nodes[index]
            for entry, piece in self._neighbours(node.piece):
                if piece.index in tree.index_of or piece.index in self._blocked:
                    continue
                self._grown(*(len(t.nodes) + (t is tree) for t in self.trees))
                level.append(tree.add(Node(piece, index, entry, node.depth + 1)))
                if self._test is not None:
                    if self._look(piece, entry):
                        return
                elif piece.index in other.index_of:
                    depth = node.depth + 1 + other.nodes[other.index_of[piece.index]].depth
                    best = min(best or (depth, piece.index), (depth, piece.index))
        tree.frontier = level
        if best is not None:
            self.meeting = best[1]

    def path(self) -> list[Leg]:
        """Join the arcs from start to goal; only after `run` returned true.

        Legs of one point are left out: the legs beside them share the point.
        """
        assert self.meeting is not None
        initial, goal = (tree.chain(tree.index_of[self.meeting]) for tree in self.trees)
        pieces = [node.piece for node in initial] + [node.piece for node in goal[-2::-1]]
        stops = [self.trees[0].root]
        stops += [node.entry for node in initial if node.entry is not None]
        stops += [node.entry for node in reversed(goal) if node.entry is not None]
        stops.append(self.trees[1].root)
        legs: list[Leg] = []
        for piece, begin, end in zip(pieces, stops[:-1], stops[1:], strict=True):
            points = piece.path(begin, end)
            still = len(points) < 2 or not np.abs(points - points[0]).max() > 0.0
            if not still or len(pieces) == 1:
                legs.append(Leg(piece.index, piece.formation, piece.stability, points))
        return legs
