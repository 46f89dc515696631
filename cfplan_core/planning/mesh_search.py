"""The best way through a mesh: shortest, of fewest segments, or the widest.

All are Dijkstra's search (1959) over states: a node, whether the way has moved on its piece, which
required formations it has passed, and which features that are near have touched. The widest way
is the shortest that keeps a margin, for the largest margin that some way keeps.

With a floor for the margin motions of a smaller one are left out, and features that are nearer
than the floor allows must touch before they part again, or come from the start or lead to the goal
like that: see `robustness`.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Collection
from dataclasses import dataclass

from cfplan_core.options import Preference
from cfplan_core.planning.constraints import Constraints
from cfplan_core.planning.mesh import Mesh, Motion
from cfplan_core.planning.mesh_margins import MeshMargins

# More than any length: one segment less is worth any way round.
_SEGMENT = 1e4


@dataclass(frozen=True, eq=False)
class Way:
    """A way through a mesh.

    Attributes:
        nodes: In order.
        motions: Between them, one less.
    """

    nodes: tuple[int, ...]
    motions: tuple[Motion, ...]


@dataclass(frozen=True)
class _State:
    """What the rest of a way depends on."""

    node: int
    moved: bool
    passed: int
    touched: int


class MeshSearch:
    """Searches a mesh.

    Attributes:
        banned: Motions that are left out.
    """

    def __init__(
        self,
        mesh: Mesh,
        start: int,
        goals: Collection[int],
        constraints: Constraints,
        checkpoint: Callable[[], None] = lambda: None,
    ) -> None:
        """Prepare.

        Args:
            mesh: What can be reached.
            start: A node.
            goals: Nodes of which one is to be reached.
            constraints: Say which formations are required.
            checkpoint: Called on the way; may raise to stop a search.
        """
        self.banned: set[Motion] = set()
        self._mesh = mesh
        self._checkpoint = checkpoint
        self._start = start
        self._goals = frozenset(goals)
        self._passing = [
            sum(
                1 << k
                for k, pairs in enumerate(constraints.required)
                if pairs <= set(piece.formation.pairs)
            )
            for piece in mesh.pieces
        ]
        self._all_passed = (1 << len(constraints.required)) - 1

    def shortest(
        self,
        prefer: Preference = Preference.SHORTEST,
        floor: float | None = None,
        margins: MeshMargins | None = None,
    ) -> Way | None:
        """Find the shortest way.

        Args:
            prefer: Fewest segments come first if this says so.
            floor: Smallest margin of the way.
            margins: Needed with a floor.
        """
        first_of_all = prefer is Preference.FEWEST_SEGMENTS
        marks = margins.marks(floor) if margins is not None and floor is not None else None
        touched = marks.near[self._start] if marks is not None else 0
        root = _State(self._start, False, self._passing[self._start], touched)
        cost = {root: 0.0}
        came: dict[_State, tuple[_State, Motion]] = {}
        done: set[_State] = set()
        queue = [(0.0, 0, root)]
        pushed = 0
        while queue:
            so_far, _, state = heapq.heappop(queue)
            if state in done:
                continue
            done.add(state)
            self._checkpoint()
            if state.node in self._goals and state.passed == self._all_passed:
                return self._traced(state, came)
            for other, motion in self._mesh.around[state.node]:
                if motion in self.banned:
                    continue
                touched = 0
                if marks is not None:
                    onwards = marks.follow(state.node, other, motion, state.touched)
                    if onwards is None:
                        continue
                    touched = onwards
                moves = motion.piece is not None
                passed = state.passed | self._passing[other]
                after = _State(other, first_of_all and moves, passed, touched)
                added = motion.length
                if first_of_all and moves and not state.moved:
                    added += _SEGMENT
                if so_far + added < cost.get(after, float('inf')):
                    cost[after] = so_far + added
                    came[after] = (state, motion)
                    pushed += 1
                    heapq.heappush(queue, (so_far + added, pushed, after))
        return None

    def widest(self, margins: MeshMargins, low: float, precision: float) -> tuple[float, float]:
        """Find the largest margin that some way keeps.

        Args:
            margins: Of the mesh.
            low: A margin that some way is known to keep.
            precision: To find it within, as a part of it.

        Returns:
            A margin that some way keeps, and one that none does, or the same twice if it is exact.
        """
        high = self._widest_steady(margins)
        if high <= low or self.shortest(floor=high, margins=margins) is not None:
            return max(low, high), max(low, high)
        low = max(low, 1e-6)
        while high > low * (1.0 + precision):
            middle = (low * high) ** 0.5
            if self.shortest(floor=middle, margins=margins) is not None:
                low = middle
            else:
                high = middle
        return low, high

    def _widest_steady(self, margins: MeshMargins) -> float:
        """Largest margin of a way where the clearance is left out (Pollack, 1960)."""
        back, ahead = (
            dict(zip(self._mesh.motions, way, strict=True)) for way in margins.widths.tolist()
        )
        best = [0.0] * len(self._mesh.z)
        best[self._start] = float('inf')
        queue = [(-best[self._start], self._start)]
        while queue:
            so_far, node = heapq.heappop(queue)
            if -so_far < best[node]:
                continue
            if node in self._goals:
                return -so_far
            for other, motion in self._mesh.around[node]:
                width = ahead if other == motion.second else back
                through = min(-so_far, width[motion])
                if motion not in self.banned and through > best[other]:
                    best[other] = through
                    heapq.heappush(queue, (-through, other))
        return 0.0

    @staticmethod
    def _traced(state: _State, came: dict[_State, tuple[_State, Motion]]) -> Way:
        nodes, motions = [state.node], []
        while state in came:
            state, motion = came[state]
            nodes.append(state.node)
            motions.append(motion)
        return Way(tuple(nodes[::-1]), tuple(motions[::-1]))
