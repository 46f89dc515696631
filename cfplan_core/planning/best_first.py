"""The best path through a roadmap rather than the first: uniform-cost search over its pieces.

States are (piece, where it is entered, which required formations were passed); an arc moves inside
a piece from its entry to where the next one begins, and its cost is that of this motion (Dijkstra,
1959). For the widest path (Pollack, 1960) the cost is the worst margin so far, which no motion can
improve, so that the same search applies; among the widest paths the shortest is then found by a
second search that leaves out narrower arcs.

A path that is taken from the queue costs no more than any that is still to come, so it is best
among all the pieces that can be reached, as far as the roadmap reaches: through a region of
dimension two or more it knows two motions for each pair of ends, over the anchor and straight.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator, Sequence
from itertools import islice

import numpy as np

from cfplan_core.contact.formation import Formation
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.options import Preference
from cfplan_core.planning.goal_test import GoalTest
from cfplan_core.planning.pieces import SAME, Piece, Region
from cfplan_core.planning.region_motion import straight_motion
from cfplan_core.planning.roadmap import Roadmap
from cfplan_core.planning.search import Leg, Node, Tree
from cfplan_core.planning.ways import Arc, Cost, Label, joint_length

# Configurations of one piece that are tried as ends of a way to a goal that is not a whole grasp.
_MOST_ENDS = 8

# Rates a motion inside a piece: its points, shape (s, 3 + n), in a formation.
Rate = Callable[[Formation, FloatArray], float]


class BestFirst:
    """Searches one roadmap for the best paths.

    Attributes:
        best: The cheapest way to the goal met so far, None before there is one.
        chosen: Ways that `choose` has come to, best first.
        states: Number of states that were settled.
        trees: What was searched as CF-trees, the goal's of one node; see `conclude`.
        meeting: Index of the piece of the goal, None before `conclude`.
    """

    def __init__(
        self,
        roadmap: Roadmap,
        start: FloatArray,
        goal: FloatArray | GoalTest,
        prefer: Preference,
        robustness: Rate,
        settled: Callable[[int], None] = lambda states: None,
    ) -> None:
        """Prepare.

        Args:
            roadmap: To search.
            start: Stable configuration, shape (3 + n,).
            goal: Stable configuration, shape (3 + n,), or a test that finds one on a piece.
            prefer: What is best; the first plan there is means fewest segments.
            robustness: Worst margin of a motion.
            settled: Called with the number of states before one is added; may raise.
        """
        self.best: Label | None = None
        self.chosen: list[Label] = []
        self.states = 0
        self._roadmap = roadmap
        self._start = start
        self._goal = goal
        self._prefer = prefer
        self._robustness = robustness
        self._settled = settled
        self._arcs: dict[tuple[int, bytes, bytes], tuple[Arc, ...]] = {}
        self._margins: dict[Arc, float] = {}
        self._banned: set[Arc] = set()
        self._floor = -np.inf
        self._ceiling: Cost = (np.inf,)
        self._tree: list[Label] = []
        self.trees = (Tree(start), Tree(start))
        self.meeting: int | None = None

    def cost(self, legs: Sequence[Leg]) -> Cost:
        """Cost of a path that was found otherwise."""
        length = sum(joint_length(leg.points) for leg in legs)
        moves = float(sum(joint_length(leg.points) > 0.0 for leg in legs))
        if self._prefer is Preference.ROBUST:
            return (-self.margin(legs), length)
        return (length, moves) if self._prefer is Preference.SHORTEST else (moves, length)

    def margin(self, legs: Sequence[Leg]) -> float:
        """Worst margin of a path."""
        return min(self._robustness(leg.formation, leg.points) for leg in legs)

    def ways(self, count: int, known: Sequence[Leg] | None = None) -> Iterator[Label]:
        """Ways to the goal with different sequences of contact formations, best first.

        Args:
            count: How many are wanted. With one a way may visit a piece again; with more it may
                not, as detours would be taken for alternatives.
            known: A path that is known; if one is wanted, only a better one is given.
        """
        if count > 1:
            yield from self._ways(count)
            return
        if known is not None:
            self._ceiling = self.cost(known)
        try:
            best = next(self._ways(1), None)
            if self._prefer is Preference.ROBUST:
                best = self._shortest_of_widest(best, known)
        finally:
            self._ceiling = (np.inf,)
        if best is not None:
            yield best

    def _shortest_of_widest(
        self, widest: Label | None, known: Sequence[Leg] | None
    ) -> Label | None:
        """The shortest of the ways whose worst margin is that of the widest, or of a known one."""
        if widest is not None:
            self._floor, ceiling = -widest.cost[0], (np.inf,)
        elif known is not None:
            self._floor, ceiling = self.margin(known), (self.cost(known)[1],)
        else:
            return None
        self._prefer, self._ceiling = Preference.SHORTEST, ceiling
        met, self.best = self.best, None
        try:
            shortest = next(self._ways(1), None)
        finally:
            self._floor, self._prefer, self.best = -np.inf, Preference.ROBUST, met
        return shortest or widest

    def _ways(self, count: int) -> Iterator[Label]:
        queue: list[tuple[Cost, int, Label]] = []
        pushed = 0

        def push(label: Label) -> None:
            nonlocal pushed
            bound = self._bound(label)
            if bound < self._ceiling:
                pushed += 1
                heapq.heappush(queue, (bound, pushed, label))

        root = self._roadmap.root(self._start)
        goal = self._goal_piece()
        push(Label(root, self._start, self._nothing(), self._passing(root, frozenset()), None))
        known: dict[tuple[int, bytes, frozenset[int]], set[tuple[Formation, ...]]] = {}
        found: set[tuple[Formation, ...]] = set()
        while queue and len(found) < count:
            _, _, label = heapq.heappop(queue)
            sequence = label.formations() if count > 1 else ()
            if label.arrived:
                if sequence not in found:
                    found.add(sequence)
                    yield label
                continue
            here = known.setdefault((label.piece.index, _key(label.entry), label.passed), set())
            if len(here) >= count or sequence in here:
                continue
            here.add(sequence)
            self.states += 1
            self._settled(self.states)
            self._tree.append(label)
            for arrival in self._arrivals(label, goal):
                if self.best is None or arrival.cost < self.best.cost:
                    self.best = arrival
                push(arrival)
            visited = {before.piece.index for before in label.chain()} if count > 1 else set()
            for z, piece in self._neighbours(label.piece):
                if piece.index not in visited:
                    for after in self._moved(label, z, piece):
                        push(after)

    def choose(
        self, count: int, known: Sequence[Leg] | None, refused: Callable[[list[Leg]], list[int]]
    ) -> None:
        """Search until the best ways that can be held are in `chosen`.

        Args:
            count: How many are wanted.
            known: A path that is known; if one is wanted, only a better one is chosen.
            refused: Tells which legs of a path cannot be held, by index. These are left out, and
                the search is run again.
        """
        while True:
            self.chosen = []
            for label in self.ways(count, known):
                legs, arcs = label.path()
                weak = refused(legs)
                if weak and arcs:
                    self._banned.update(arcs[index] for index in weak)
                    self.best = None
                    break
                self.chosen.append(label)
            else:
                return

    def settle_for_best(
        self, known: Sequence[Leg] | None, refused: Callable[[list[Leg]], list[int]]
    ) -> None:
        """Choose the best way met so far, where `choose` was stopped before it chose any."""
        if self.chosen or self.best is None:
            return
        legs, _ = self.best.path()
        if not refused(legs) and (known is None or self.cost(legs) < self.cost(known)):
            self.chosen = [self.best]

    def conclude(self, label: Label) -> None:
        """Set `trees` and `meeting` for a way that was chosen."""
        initial, goal = Tree(self._start), Tree(label.entry)
        for settled in [*label.chain()[:-1], *self._tree]:
            self._add(initial, settled)
        goal.add(Node(label.piece, None, None, 0))
        self.trees, self.meeting = (initial, goal), label.piece.index

    @staticmethod
    def _add(tree: Tree, label: Label) -> None:
        if label.piece.index in tree.index_of:
            return
        if label.parent is None:
            tree.add(Node(label.piece, None, None, 0))
            return
        parent = tree.index_of[label.parent.piece.index]
        depth = tree.nodes[parent].depth + 1
        tree.add(Node(label.piece, parent, label.entry, depth))

    def _nothing(self) -> Cost:
        return (-np.inf, 0.0) if self._prefer is Preference.ROBUST else (0.0, 0.0)

    def _moved(
        self, label: Label, z: FloatArray, piece: Piece, arrived: bool = False
    ) -> Iterator[Label]:
        """Labels behind the motions from a label's entry to z."""
        first, second = label.cost
        passed = self._passing(piece, label.passed)
        for arc in self._motions(label.piece, label.entry, z):
            if arc in self._banned:
                continue
            cost: Cost = (first + arc.moves, second + arc.length)
            if self._prefer is Preference.ROBUST:
                margin = self._margin(label.piece, arc)
                cost = (max(first, -margin), second + arc.length)
            elif self._prefer is Preference.SHORTEST:
                if self._floor > -np.inf and self._margin(label.piece, arc) < self._floor:
                    continue
                cost = (first + arc.length, second + arc.moves)
            yield Label(piece, z, cost, passed, label, arc, arrived)

    def _bound(self, label: Label) -> Cost:
        """A cost that no way to the goal over a label falls short of."""
        if self._prefer is Preference.SHORTEST and not isinstance(self._goal, GoalTest):
            straight = float(np.linalg.norm(self._goal[3:] - label.entry[3:]))
            return (label.cost[0] + straight * (1.0 - 1e-12), label.cost[1])
        return label.cost

    def _passing(self, piece: Piece, passed: frozenset[int]) -> frozenset[int]:
        """Which required formations were passed once a piece is entered."""
        present = set(piece.formation.pairs)
        required = self._roadmap.constraints.required
        return passed | {k for k, pairs in enumerate(required) if pairs <= present}

    def _goal_piece(self) -> Piece | None:
        return None if isinstance(self._goal, GoalTest) else self._roadmap.root(self._goal)

    def _arrivals(self, label: Label, goal: Piece | None) -> Iterator[Label]:
        """Labels at the goal behind the last motion, if a label's piece holds the goal."""
        if len(label.passed) < len(self._roadmap.constraints.required):
            return
        if not isinstance(self._goal, GoalTest):
            if label.piece is goal:
                yield from self._moved(label, self._goal, label.piece, arrived=True)
            return
        regions = self._roadmap.regions
        for z in islice(self._goal.all(label.piece, regions, label.entry), _MOST_ENDS):
            yield from self._moved(label, z, label.piece, arrived=True)

    def _neighbours(self, piece: Piece) -> Iterator[tuple[FloatArray, Piece]]:
        yield from self._roadmap.neighbours(piece)
        yield from self._roadmap.regions.beside(piece)
        yield from self._roadmap.settling.beside(piece)

    def _motions(self, piece: Piece, start: FloatArray, end: FloatArray) -> tuple[Arc, ...]:
        """Motions inside a piece: one along a curve; over the anchor and straight in a region."""
        key = (piece.index, _key(start), _key(end))
        if key not in self._arcs:
            found = [piece.path(start, end)]
            if isinstance(piece, Region):
                straight = straight_motion(self._roadmap, piece, start, end)
                found += [] if straight is None else [straight]
            self._arcs[key] = tuple(
                Arc(points, bool(np.abs(points - points[0]).max() > 0.0), joint_length(points))
                for points in found
            )
        return self._arcs[key]

    def _margin(self, piece: Piece, arc: Arc) -> float:
        """Worst margin of a motion."""
        if not arc.moves:
            return float(np.inf)
        if arc not in self._margins:
            self._margins[arc] = self._robustness(piece.formation, arc.points)
        return self._margins[arc]


def _key(z: FloatArray) -> bytes:
    """The same for configurations that are the same, up to rounding at the borders of cells."""
    return np.round(z / (10.0 * SAME)).astype(np.int64).tobytes()
