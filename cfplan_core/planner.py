"""Plan: from a problem to its answer."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from cfplan_core import verdicts
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.held import HeldSystem
from cfplan_core.contact.system import ContactSystem
from cfplan_core.errors import CfplanError, Finding
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.model import Goal, Problem
from cfplan_core.options import MOST_JOINTS, Preference
from cfplan_core.options import PlanOptions as PlanOptions
from cfplan_core.planning.best_first import BestFirst
from cfplan_core.planning.best_on_mesh import BestOnMesh
from cfplan_core.planning.budget import BudgetExhaustedError
from cfplan_core.planning.constraints import (
    Constraints,
    compile_constraints,
    contradictions,
)
from cfplan_core.planning.equations import formation_rows, is_second_order
from cfplan_core.planning.goal_limits import why_impossible
from cfplan_core.planning.goal_test import GoalTest
from cfplan_core.planning.grasp_check import ExaminedProblem, examine_problem
from cfplan_core.planning.manifold import settle
from cfplan_core.planning.pieces import Region
from cfplan_core.planning.roadmap import Roadmap
from cfplan_core.planning.robustness import Robustness
from cfplan_core.planning.sampled_search import SampledSearch
from cfplan_core.planning.search import Leg, PathTrees, Search, Tree
from cfplan_core.planning.sheets import Sheets
from cfplan_core.planning.ways import Cost
from cfplan_core.trajectory.frames import (
    build_frames,
    grazing_legs,
    overloaded_legs,
    straying_legs,
)
from cfplan_core.trajectory.inspection import flaw
from cfplan_core.trajectory.plan_result import PlanResult, Statistics, Status, TreeNode

# So many searches are made for each plan wanted where plans are compared and no budget is given.
_SEARCHES = 6


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


GRAZING = 'a contact would touch that is not to be there'


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
        self.moving = self.system
        self.model = FrictionlessModel(self.system.load, self.options.second_order)
        self.roadmap = Roadmap(self.system, self.model, self._checkpoint)
        self.robustness = Robustness(self.system, self.model)
        self.search: Search | BestFirst | PathTrees | SampledSearch | None = None
        self.forgotten = False

    def run(self) -> PlanResult:
        examined = examine_problem(self.system, self.model)
        try:
            constraints = compile_constraints(self.system, self.model, self.options)
        except CfplanError as error:
            return self._invalid(f'options: {error}', 'options')
        findings = examined.findings or contradictions(
            constraints, self.system, examined, self.problem.goal, self.options.held_joints
        )
        if findings:
            message = '\n'.join(str(finding) for finding in findings)
            return replace(self._answer(Status.INVALID, message), findings=tuple(findings))
        start = examined.start.z
        if self.options.held_joints:
            self.moving = HeldSystem(self.system, self.options.held_joints, start)
            start = self.moving.reduced(start)
        # Where curves hardly ever lead on rays find a way sooner; only sheets tell that there is
        # none. Alternatives are told apart along rays.
        free = constraints.none and self.moving is self.system
        several = self.options.alternatives > 1
        quick = self.moving.joint_count == MOST_JOINTS and not (free or self.options.optimal)
        along_rays = self._roadmap(constraints, None)
        on_sheets = self._roadmap(constraints, self.options.resolution)
        self.roadmap = along_rays if several or quick else on_sheets
        try:
            goals = self._goals(examined)
        except CfplanError as error:
            return self._invalid(f'goal: {error}', 'goal')
        impossible = '' if examined.goal is not None else why_impossible(self.problem, self._goal)
        if impossible:
            return self._answer(Status.INFEASIBLE, f'no path: {impossible}')
        try:
            if self.moving.joint_count > MOST_JOINTS and not _held_by_two(examined):
                return self._search_samples(start, goals[0])
            if self.options.optimal:
                exact = self.options.alternatives == 1 and self.moving.joint_count <= MOST_JOINTS
                search = self._search_all if exact else self._search_best
                # Best is what is best of all that the goal allows.
                best = search(start, goals[-1])
                if best is None and several and self.moving.joint_count == MOST_JOINTS:
                    self.roadmap = on_sheets
                    best = self._search_all(start, goals[-1])
                if best is None and len(goals) > 1:
                    best = search(start, goals[0])
                if best is not None:
                    return best
                legs = None
            else:
                legs = self._search_goals(start, goals)
                if legs is None and quick:
                    self.roadmap = on_sheets
                    legs = self._search_goals(start, goals)
        except BudgetExhaustedError as stop:
            message = f'{stop}{verdicts.constrained(self.options)}; '
            message += verdicts.explored(self.roadmap)
            if isinstance(self.search, SampledSearch):
                message += verdicts.sampled(self.options, self.search)
            return self._answer(Status.BUDGET_EXHAUSTED, message)
        if legs is None:
            nearest = goals[-1].how_near() if isinstance(goals[-1], GoalTest) else ''
            message = f'no path{verdicts.constrained(self.options)}{nearest}; '
            message += verdicts.explored(self.roadmap)
            message += verdicts.doubt(self.roadmap)
            if self.moving.joint_count > MOST_JOINTS:
                message += '. Rays do not show that there is no plan'
                return self._answer(Status.BUDGET_EXHAUSTED, message)
            return self._answer(Status.INFEASIBLE, message)
        return self._solved(legs, '')

    def _goals(self, examined: ExaminedProblem) -> list[FloatArray | GoalTest]:
        """The goal grasp, if it is one, and all that its tolerance allows, if that is more."""
        goals: list[FloatArray | GoalTest] = []
        if examined.goal is not None:
            z = self.moving.reduced(examined.goal.z)
            if self.options.held_joints:
                z = settle(self.moving, z, formation_rows(examined.goal.pairs))
            goals.append(z)
        if examined.goal is None or self._goal.tolerance.wide:
            goals.append(GoalTest(self.moving, self._goal))
        return goals

    def _invalid(self, message: str, part: str) -> PlanResult:
        """The answer where a part, ``options`` or ``goal``, names what the problem lacks.

        An error of the options begins with the option's name.
        """
        text = message.removeprefix(f'{part}: ')
        name, _, rest = text.partition(': ')
        finding = Finding('<problem>', part, text, '')
        if part == 'options' and name.isidentifier():
            finding = Finding('<problem>', f'{part}.{name}', rest, '')
        return replace(self._answer(Status.INVALID, message), findings=(finding,))

    def _search_goals(
        self, start: FloatArray, goals: Sequence[FloatArray | GoalTest]
    ) -> Sequence[Leg] | None:
        found = (self._search(start, goal) for goal in goals)
        return next((legs for legs in found if legs is not None), None)

    def _roadmap(self, constraints: Constraints, resolution: float | None) -> Roadmap:
        return Roadmap(self.moving, self.model, self._checkpoint, constraints, resolution)

    def _solved(self, legs: Sequence[Leg], message: str) -> PlanResult:
        """The answer for a path, with the trees of the search that found it."""
        frames = build_frames(self.system, self.model, self._whole(legs), self.options.trajectory)
        return replace(
            self._answer(Status.SOLVED, message),
            times=frames.times,
            joints=frames.joints,
            object_poses=frames.object_poses,
            torque_lower=frames.torque_lower,
            torque_upper=frames.torque_upper,
            segments=frames.segments,
            reversible=self.model.reversible,
            entry_lower=frames.entry_lower,
            entry_upper=frames.entry_upper,
            torque_nominal=frames.torque_nominal,
            entry_nominal=frames.entry_nominal,
        )

    @property
    def _goal(self) -> Goal:
        """The goal without the angles of held joints, which agree with the start's."""
        goal, held = self.problem.goal, self.options.held_joints
        if not held or goal.joints is None:
            return goal
        joints = {name: angle for name, angle in goal.joints.items() if name not in held}
        return replace(goal, joints=joints)

    def _whole(self, legs: Sequence[Leg]) -> list[Leg]:
        """Legs in the coordinates of all joints."""
        return [replace(leg, points=self.moving.expanded(leg.points)) for leg in legs]

    def _search_samples(self, start: FloatArray, goal: FloatArray | GoalTest) -> PlanResult:
        """Search for plans of many joints: the first, or the best of several searches.

        Raises:
            BudgetExhaustedError: Before there was a plan.
        """
        options, stopped = self.options, ''
        required = [GoalTest(self.moving, Goal(contacts=names)) for names in options.required]
        self.search = search = SampledSearch(
            self.roadmap, start, goal, required, options.seed, self._grown, self._flawed
        )
        paths = search.paths()
        if options.prefer is Preference.FIRST and options.alternatives == 1:
            return self._solved(next(paths), '')
        rating = BestFirst(self.roadmap, start, goal, options.prefer, self._rate)
        found: dict[tuple[Formation, ...], tuple[Cost, list[Leg]]] = {}
        endless = options.time_budget is not None or options.max_nodes is not None
        most = _SEARCHES * options.alternatives
        try:
            for legs in paths:
                sequence = tuple(leg.formation for leg in legs)
                rated = (rating.cost(legs), legs)
                if sequence not in found or rated[0] < found[sequence][0]:
                    found[sequence] = rated
                if not endless and search.attempts >= most:
                    break
        except BudgetExhaustedError as stop:
            if not found:
                raise
            stopped = str(stop)
        ranked = sorted(found.values(), key=lambda rated: rated[0])
        message = verdicts.best_sampled(options, search, stopped, len(ranked))
        results = [
            replace(self._solved(legs, message), margin=self._margin(legs))
            for _, legs in ranked[: options.alternatives]
        ]
        return replace(results[0], alternatives=tuple(results[1:]))

    def _rate(self, formation: Formation, z: FloatArray) -> float:
        """Worst margin of a motion, shape (s, 3 + n), inside a formation."""
        return self.robustness.ratios(formation, self.moving.expanded(z)).worst

    def _margin(self, legs: Sequence[Leg]) -> float:
        """Worst margin of a path."""
        return self.robustness.margin(
            [(leg.formation, self.moving.expanded(leg.points)) for leg in legs]
        )

    def _flawed(self, legs: Sequence[Leg]) -> bool:
        """Tell whether a path cannot be used, with the reason noted."""
        if self._refuse(legs):
            return True
        found = flaw(
            self.system, self.model, build_frames(self.system, self.model, self._whole(legs))
        )
        if found is not None:
            self.roadmap.failures[f'refused, as {found}'] += 1
        return found is not None

    def _search_best(self, start: FloatArray, goal: FloatArray | GoalTest) -> PlanResult | None:
        """Search for the best plans, from the first one on; None if there is none at all.

        Motions that a joint's effort cannot hold are left out, and the search is run again.
        """
        options, stopped = self.options, ''

        def settled(states: int) -> None:
            self._grown(states, 1)

        best = BestFirst(self.roadmap, start, goal, options.prefer, self._rate, settled)
        first, first_search = None, None
        if not options.required:
            first, first_search = self._search(start, goal), self.search
            if first is None:
                return None
        self.search = best
        try:
            best.choose(options.alternatives, first, self._refuse)
        except BudgetExhaustedError as stop:
            stopped = str(stop)
            best.settle_for_best(first, self._refuse)
        found = max(len(best.chosen), first is not None)
        message = verdicts.best_explored(options, self.roadmap, stopped, found)
        results = []
        for label in best.chosen:
            best.conclude(label)
            legs, _ = label.path()
            results.append(replace(self._solved(legs, message), margin=self._margin(legs)))
        if not results and first is not None:
            self.search = first_search
            results = [replace(self._solved(first, message), margin=self._margin(first))]
        if not results and stopped:
            raise BudgetExhaustedError(stopped)
        return replace(results[0], alternatives=tuple(results[1:])) if results else None

    def _search_all(self, start: FloatArray, goal: FloatArray | GoalTest) -> PlanResult | None:
        """Search everything that can be reached for the best plan; None if there is none."""
        prefer, stopped, best = self.options.prefer, '', None
        first = None
        if not self.options.required:
            first = self._search(start, goal)
            if first is None:
                return None
        try:
            mesh = self._mesh(start, goal)
            best = mesh.choose(prefer, first, self._refuse_one_by_one)
            if best is None:
                return None
        except BudgetExhaustedError as stop:
            if first is None:
                raise
            stopped = str(stop)
        legs = first if best is None else best.legs
        assert legs is not None
        if best is not None and best.way is not None:
            self.search = PathTrees(self.roadmap, legs)
        margin = self._margin(legs)
        message = verdicts.best_of_all(self.options, self.roadmap, stopped, margin, best)
        bound = None if best is None else best.bound
        return replace(self._solved(legs, message), margin=margin, margin_bound=bound)

    def _mesh(self, start: FloatArray, goal: FloatArray | GoalTest) -> BestOnMesh:
        """All that can be reached, also by the ways that a search for one path has forgotten."""
        if self.forgotten:
            constraints, failures = self.roadmap.constraints, self.roadmap.failures
            self.roadmap = self._roadmap(constraints, self.options.resolution)
            self.roadmap.failures.update(failures)
            self.forgotten = False
        return BestOnMesh(
            self.roadmap, start, goal, self.robustness, self.moving.expanded, self._met
        )

    def _met(self, pieces: int) -> None:
        self._grown(pieces, 1)

    def _refuse(self, legs: Sequence[Leg]) -> list[int]:
        """Which legs cannot be held, with the reasons noted."""
        whole = self._whole(legs)
        refused = dict.fromkeys(overloaded_legs(self.system, self.model, whole), verdicts.TOO_WEAK)
        refused |= dict.fromkeys(grazing_legs(self.system, whole), GRAZING)
        refused |= straying_legs(self.system, whole, self.roadmap.constraints.bounds)
        self.roadmap.failures.update(refused.values())
        return list(refused)

    def _refuse_one_by_one(self, legs: Sequence[Leg]) -> list[int]:
        """As `_refuse`, of so many legs that the budget may end meanwhile."""
        refused = []
        for index, leg in enumerate(legs):
            self._checkpoint()
            if self._refuse([leg]):
                refused.append(index)
        return refused

    def _search(self, start: FloatArray, goal: FloatArray | GoalTest) -> Sequence[Leg] | None:
        """Search until a path is found that the joints' efforts can hold.

        Efforts are looked at on paths only: points and curves that need more than a joint's limit
        are blocked, ways through regions forgotten, and the search is run again on the roadmap
        that is there.
        """
        blocked: frozenset[int] = frozenset()
        complete = True
        while True:
            self.search = search = Search(self.roadmap, start, goal, blocked, self._grown)
            if not search.run():
                return None if complete else self._search_strong(start, goal)
            legs = search.path()
            refused = self._refuse(legs)
            if not refused:
                return legs
            complete = False
            for index in refused:
                leg = legs[index]
                piece = self.roadmap.pieces[leg.piece]
                # The first leg begins at the start, the last one ends at the goal.
                passed = [leg.points[0]] if index > 0 else []
                if index < len(legs) - 1:
                    passed.append(leg.points[-1])
                if isinstance(piece, Region) and passed:
                    for z in passed:
                        self.roadmap.regions.drop(piece, z)
                        self.forgotten = True
                else:
                    blocked |= {piece.index}

    def _search_strong(
        self, start: FloatArray, goal: FloatArray | GoalTest
    ) -> Sequence[Leg] | None:
        """Search all that can be reached without what the joints cannot hold, if that is known."""
        count = self.moving.joint_count
        along_rays = count == MOST_JOINTS and not isinstance(self.roadmap.regions, Sheets)
        if count > MOST_JOINTS or along_rays:
            return None
        mesh = self._mesh(start, goal)
        best = mesh.choose(Preference.FEWEST_SEGMENTS, None, self._refuse_one_by_one)
        if best is None:
            return None
        self.search = PathTrees(self.roadmap, best.legs)
        return best.legs

    def _checkpoint(self) -> None:
        """Stop the search when it has to."""
        if self.cancel is not None and self.cancel.is_set():
            raise BudgetExhaustedError('cancelled')
        budget = self.options.time_budget
        if budget is not None and time.perf_counter() - self.began > budget:
            raise BudgetExhaustedError(f'time budget of {budget:g} s exhausted')

    def _grown(self, initial: int, goal: int) -> None:
        if self.progress is not None:
            elapsed = time.perf_counter() - self.began
            formations = self.roadmap.formations()
            self.progress(Progress(elapsed, (initial, goal), formations, 'growing the CF-trees'))
        limit = self.options.max_nodes
        if limit is not None and initial + goal > limit:
            raise BudgetExhaustedError(f'budget of {limit} nodes exhausted')

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


def _held_by_two(examined: ExaminedProblem) -> bool:
    """Tell whether two contacts hold the start or the goal: sampling finds no way from there."""
    grasps = [grasp for grasp in (examined.start, examined.goal) if grasp is not None]
    return any(is_second_order(grasp.pairs) for grasp in grasps)
