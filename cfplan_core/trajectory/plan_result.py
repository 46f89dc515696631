"""The answer to a planning problem: outcome, frames, segments and what was searched."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from cfplan_core.errors import Finding
from cfplan_core.geometry.polygon import FloatArray


class Status(str, Enum):
    """The four outcomes of a search."""

    SOLVED = 'solved'
    INFEASIBLE = 'infeasible'
    BUDGET_EXHAUSTED = 'budget_exhausted'
    INVALID = 'invalid'


@dataclass(frozen=True)
class Segment:
    """A stretch of frames inside one contact formation and one stability class.

    Attributes:
        contacts: Names of all elemental contacts that touch inside the segment.
        stability: ``form_closure``, ``force_closure`` or ``second_order``.
        first_frame: Index of the first frame; shared with the segment before.
        last_frame: Index of the last frame; shared with the segment after.
        needed_force: Largest over its frames of the smallest F such that contact forces of at
            most F hold the object, in weights of the object; None if not known.
        control: ``position`` or ``effort`` for each joint by name: which to hold stiffly where it
            is to be, and which to give its nominal torque; None where it was not planned.
    """

    contacts: tuple[str, ...]
    stability: str
    first_frame: int
    last_frame: int
    needed_force: float | None = None
    control: Mapping[str, str] | None = field(default=None, hash=False)


@dataclass(frozen=True)
class TreeNode:
    """A node of a CF-tree, for figures and reports.

    Attributes:
        parent: Index of the parent in the same tree; None for the root.
        contacts: Names of the elemental contacts.
        stability: As in `Segment`; empty for a grasp passed through in an instant.
        dimension: Dimension of the node's piece of configuration space.
        on_path: True if the plan passes through the node.
        shared: True if the same piece of the same formation is in the other tree.
    """

    parent: int | None
    contacts: tuple[str, ...]
    stability: str
    dimension: int
    on_path: bool
    shared: bool


@dataclass(frozen=True)
class Statistics:
    """What a search did.

    Attributes:
        planning_time: Wall time, s.
        initial_tree_nodes: Nodes of the tree grown from the start.
        goal_tree_nodes: Nodes of the tree grown from the goal.
        formations: Distinct contact formations met.
        transitions: Transitions between formations that were tried.
        failures: Reason why transitions failed, with how often, most frequent first.
    """

    planning_time: float = 0.0
    initial_tree_nodes: int = 0
    goal_tree_nodes: int = 0
    formations: int = 0
    transitions: int = 0
    failures: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class PlanResult:
    """The outcome of planning; only a solved one has frames.

    Attributes:
        problem: Name of the problem.
        status: Which of the four outcomes.
        message: Why, when not solved.
        joint_names: Order of the columns of all joint arrays.
        times: Shape (f,), s, strictly increasing from 0.
        joints: Shape (f, n), rad.
        object_poses: Shape (f, 3), pose of the object frame: m, m, rad.
        torque_lower: Shape (f, n), N·m, -inf where unbounded.
        torque_upper: Shape (f, n), N·m, inf where unbounded.
        segments: Cover all frames; neighbours share a frame.
        statistics: What the search did.
        trees: The two CF-trees, (initial, goal); parents come before children.
        reversible: True if it is known that the plan can be followed backwards.
        entry_lower: Shape (s, n), torque limits of each segment at its first frame, N·m, where
            the frame itself carries those of the segment before. Not in plan files.
        entry_upper: As `entry_lower`.
        torque_nominal: Shape (f, n), N·m, what the actuators should supply: inside the limits,
            with the widest margin. Empty where it was not planned.
        entry_nominal: As `entry_lower`.
        margin: Worst robustness margin of the plan, where it was chosen among several, else None.
        margin_bound: No plan has a larger margin, at the resolution stated; None if not asked.
        alternatives: Other plans, the next best first, each without further ones.
        findings: Everything that is wrong, if invalid. Not in plan files.
    """

    problem: str
    status: Status
    joint_names: tuple[str, ...]
    message: str = ''
    times: FloatArray = field(default_factory=lambda: np.empty(0))
    joints: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    object_poses: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    torque_lower: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    torque_upper: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    segments: tuple[Segment, ...] = ()
    statistics: Statistics = field(default_factory=Statistics)
    trees: tuple[tuple[TreeNode, ...], tuple[TreeNode, ...]] = ((), ())
    reversible: bool = False
    entry_lower: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    entry_upper: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    torque_nominal: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    entry_nominal: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    margin: float | None = None
    margin_bound: float | None = None
    alternatives: tuple[PlanResult, ...] = ()
    findings: tuple[Finding, ...] = ()

    @property
    def solved(self) -> bool:
        """True if there is a plan."""
        return self.status is Status.SOLVED

    def reversed(self) -> PlanResult:
        """Return the plan from the goal to the start.

        Each segment's contacts, torques, control and speed are as before, in reverse order; the
        name stays that of the problem, whose start and goal have changed places. Nominal torques
        were chosen with room for friction against the motion as planned, not against this one.

        Raises:
            CfplanError: It is not solved, or not known to be reversible: its contact model is
                not, or it was read from a file.
        """
        from cfplan_core.trajectory.reversal import reversed_plan

        return reversed_plan(self)

    @property
    def length(self) -> float:
        """Length of the joints' path, rad."""
        return float(np.linalg.norm(np.diff(self.joints, axis=0), axis=1).sum())

    @property
    def needed_force(self) -> float | None:
        """Largest needed force of the plan, in weights of the object; None if not known."""
        forces = [segment.needed_force for segment in self.segments]
        known = [force for force in forces if force is not None]
        return max(known) if known and len(known) == len(forces) else None
