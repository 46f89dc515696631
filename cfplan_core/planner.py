"""Plan: from a problem to its answer."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from cfplan_core.contact.system import ContactSystem
from cfplan_core.errors import CfplanError
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.model import Problem
from cfplan_core.planning.expedition import Expedition
from cfplan_core.planning.goal_test import GoalTest
from cfplan_core.planning.grasp_check import examine_problem
from cfplan_core.planning.pieces import Region
from cfplan_core.planning.roadmap import Roadmap
from cfplan_core.planning.search import Search, Tree
from cfplan_core.trajectory.frames import Frames, build_frames, overloaded_legs
from cfplan_core.trajectory.plan_result import PlanResult, Statistics, Status, TreeNode

# Hands with more joints are planned for by drives rather than piece by piece.
_MOST_JOINTS_SEARCHED = 2


@dataclass(frozen=True)
class PlanOptions:
    """Limits of a search.

    Attributes:
        time_budget: Seconds, or None for no limit.
        max_nodes: Nodes of both trees together, or None for no limit.
    """

    time_budget: float | None = None
    max_nodes: int | None = None

    def __post_init__(self) -> None:
        if self.time_budget is not None and not self.time_budget > 0.0:
            raise CfplanError(f'time_budget: got {self.time_budget}, expected seconds above zero')
        if self.max_nodes is not None and not self.max_nodes > 0:
            raise CfplanError(f'max_nodes: got {self.max_nodes}, expected a number above zero')


@dataclass(frozen=True)
class Progress:
    """How far a search has come.

    Attributes:
        elapsed: Seconds since its start.
        nodes: Nodes of the initial and of the goal tree.
        formations: Distinct contact formations met.
        message: What is being done.
    """

    elapsed: float
    nodes: tuple[int, int]
    formations: int
    message: str


class _BudgetExhaustedError(Exception):
    """A search must stop; the message says why."""


def plan(
    problem: Problem,
    options: PlanOptions | None = None,
    progress: Callable[[Progress], None] | None = None,
    cancel: threading.Event | None = None,
) -> PlanResult:
    """Find how to carry the object from the start grasp to the goal grasp.

    Same problem, same answer: nothing depends on the clock but the time budget.

    Args:
        problem: What to plan.
        options: Budgets; none by default.
        progress: Called, from this thread, whenever a tree has grown.
        cancel: When set, also by another thread, the search ends as if its budget were exhausted.

    Returns:
        The plan, or why there is none. Never raises for a problem that cannot be planned.
    """
    return _Planning(problem, options or PlanOptions(), progress, cancel).run()


class _Planning:
    """One call of `plan`."""

    def __init__(
        self,
        problem: Problem,
        options: PlanOptions,
        progress: Callable[[Progress], None] | None,
        cancel: threading.Event | None,
    ) -> None:
        self.problem = problem
        self.options = options
        self.progress = progress
        self.cancel = cancel
        self.began = time.perf_counter()
        self.system = ContactSystem(problem)
        self.model = FrictionlessModel(self.system.load)
        self.roadmap = Roadmap(self.system, self.model, self._checkpoint)
        self.search: Search | Expedition | None = None

    def run(self) -> PlanResult:
        examined = examine_problem(self.system, self.model)
        if examined.findings:
            message = '\n'.join(str(finding) for finding in examined.findings)
            return self._answer(Status.INVALID, message)
        goal: FloatArray | GoalTest
        try:
            if examined.goal is not None:
                goal = examined.goal.z
            else:
                goal = GoalTest(self.system, self.problem.goal)
        except CfplanError as error:
            return self._answer(Status.INVALID, f'goal: {error}')
        try:
            frames = self._search(examined.start.z, goal)
        except _BudgetExhaustedError as stop:
            return self._answer(Status.BUDGET_EXHAUSTED, f'{stop}; {self._explored()}')
        if frames is None:
            return self._answer(Status.INFEASIBLE, f'no path; {self._explored()}{self._doubt()}')
        return replace(
            self._answer(Status.SOLVED, ''),
            times=frames.times,
            joints=frames.joints,
            object_poses=frames.object_poses,
            torque_lower=frames.torque_lower,
            torque_upper=frames.torque_upper,
            segments=frames.segments,
        )

    def _search(self, start: FloatArray, goal: FloatArray | GoalTest) -> Frames | None:
        """Search until a path is found that the joints' efforts can hold.

        Efforts are looked at on paths only: points and curves that need more than a joint's limit
        are blocked, ways through regions forgotten, and the search is run again on the roadmap
        that is there.
        """
        if self.system.joint_count > _MOST_JOINTS_SEARCHED:
            self.search = Expedition(self.roadmap, start, goal, self._grown)
            if not self.search.run():
                raise _BudgetExhaustedError(f'no path found by {self.search.drives} drives')
            return build_frames(self.system, self.model, self.search.path())
        blocked: frozenset[int] = frozenset()
        while True:
            self.search = Search(self.roadmap, start, goal, blocked, self._grown)
            if not self.search.run():
                return None
            legs = self.search.path()
            too_weak = overloaded_legs(self.system, self.model, legs)
            if not too_weak:
                return build_frames(self.system, self.model, legs)
            for index in too_weak:
                leg = legs[index]
                piece = self.roadmap.pieces[leg.piece]
                # The first leg begins at the start, the last one ends at the goal.
                passed = [leg.points[0]] if index > 0 else []
                if index < len(legs) - 1:
                    passed.append(leg.points[-1])
                if isinstance(piece, Region) and passed:
                    for z in passed:
                        self.roadmap.regions.drop(piece, z)
                else:
                    blocked |= {piece.index}
            self.roadmap.failures['a joint would exceed its effort limit'] += len(too_weak)

    def _checkpoint(self) -> None:
        """Stop the search when it has to."""
        if self.cancel is not None and self.cancel.is_set():
            raise _BudgetExhaustedError('cancelled')
        budget = self.options.time_budget
        if budget is not None and time.perf_counter() - self.began > budget:
            raise _BudgetExhaustedError(f'time budget of {budget:g} s exhausted')

    def _grown(self, initial: int, goal: int) -> None:
        if self.progress is not None:
            elapsed = time.perf_counter() - self.began
            formations = self.roadmap.formations()
            self.progress(Progress(elapsed, (initial, goal), formations, 'growing the CF-trees'))
        limit = self.options.max_nodes
        if limit is not None and initial + goal > limit:
            raise _BudgetExhaustedError(f'budget of {limit} nodes exhausted')

    def _explored(self) -> str:
        """What was searched, and why it did not lead on."""
        failures = '; '.join(f'{n} × {why}' for why, n in self.roadmap.failures.most_common(5))
        return (
            f'explored {self.roadmap.formations()} contact formations by '
            f'{self.roadmap.attempts} transitions; most frequent failures: {failures or "none"}'
        )

    def _doubt(self) -> str:
        """How far an answer of no path is short of a proof."""
        regions = sum(piece.dimension > 1 for piece in self.roadmap.pieces)
        blocked = self.roadmap.failures['a joint would exceed its effort limit']
        doubt = ''
        if blocked:
            doubt += f'. Left out, as a joint would exceed its effort limit: {blocked} pieces'
        if not regions:
            return doubt
        return doubt + (
            '. Contact formations of dimension 0 and 1 were searched completely, '
            f'{regions} regions of dimension 2 and more only along rays'
        )

    def _answer(self, status: Status, message: str) -> PlanResult:
        trees = self.search.trees if self.search is not None else ()
        nodes = [len(tree.nodes) for tree in trees] or [0, 0]
        statistics = Statistics(
            planning_time=time.perf_counter() - self.began,
            initial_tree_nodes=nodes[0],
            goal_tree_nodes=nodes[1],
            formations=self.roadmap.formations(),
            transitions=self.roadmap.attempts,
            failures=dict(self.roadmap.failures.most_common()),
        )
        pictures = tuple(self._tree_nodes(tree) for tree in trees)
        return PlanResult(
            problem=self.problem.name,
            status=status,
            joint_names=self.problem.hand.joint_names,
            message=message,
            statistics=statistics,
            trees=(pictures[0], pictures[1]) if pictures else ((), ()),
        )

    def _tree_nodes(self, tree: Tree) -> tuple[TreeNode, ...]:
        assert self.search is not None
        initial, goal = self.search.trees
        shared = initial.index_of.keys() & goal.index_of.keys()
        meeting = self.search.meeting
        on_path = [] if meeting is None else tree.chain(tree.index_of[meeting])
        return tuple(
            TreeNode(
                parent=node.parent,
                contacts=self.system.contact_names(node.piece.formation.pairs),
                stability=node.piece.stability.value,
                dimension=node.piece.dimension,
                on_path=node in on_path,
                shared=node.piece.index in shared,
            )
            for node in tree.nodes
        )
