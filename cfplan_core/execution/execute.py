"""Execute a plan: from a problem and its plan to what became of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from cfplan_core.contact.system import BoolArray, ContactSystem
from cfplan_core.errors import CfplanError
from cfplan_core.execution.feedforward import FeedForward, planned_torques
from cfplan_core.execution.outcome import Outcome, Tolerance, assess
from cfplan_core.execution.perturbation import Uncertainty, World, draw
from cfplan_core.execution.reference import Reference, build_reference
from cfplan_core.execution.scene import build_scene
from cfplan_core.execution.simulation import Gains, Run, simulate
from cfplan_core.mechanics.friction_shift import DRIVE_STIFFNESS
from cfplan_core.model import Problem
from cfplan_core.trajectory.plan_result import PlanResult
from cfplan_core.trajectory.torque_profile import POSITION

_DAMPING_RATIO = 1.0
# Of joints in torque control, in stiffnesses: enough to keep a finger that has lost its contact
# from running away.
_COMPLIANCE = 0.03
_REST = 0.5
_EXACT = Tolerance(1e-3, 0.02)
_DISTURBED = Tolerance(2e-3, 0.05)


@dataclass(frozen=True)
class ExecutionOptions:
    """How a plan is executed.

    Attributes:
        uncertainty: How far the world may be from the planned one.
        seed: Of the errors that are drawn.
        gain: Stiffness of joints held in position, N·m/rad; None for one that fits the object's
            weight and size.
        roles: True to control joints in position or in torque as the plan says; False to hold all
            of them in position. The plan's torques are fed forward either way.
        time_step: Of the engine, s.
        sampling: Time between measurements, s.
    """

    uncertainty: Uncertainty = field(default_factory=Uncertainty)
    seed: int = 0
    gain: float | None = None
    roles: bool = True
    time_step: float = 5e-4
    sampling: float = 5e-3

    def __post_init__(self) -> None:
        if self.gain is not None and not (math.isfinite(self.gain) and self.gain > 0.0):
            raise CfplanError(f'gain: got {self.gain}, expected N·m/rad above zero')
        if not 1e-5 <= self.time_step <= 5e-3:
            raise CfplanError(f'time_step: got {self.time_step}, expected 1e-05 to 0.005 s')
        if not self.time_step <= self.sampling <= 1.0:
            raise CfplanError(f'sampling: got {self.sampling}, expected {self.time_step} to 1 s')
        if self.seed < 0:
            raise CfplanError(f'seed: got {self.seed}, expected a whole number from 0')


@dataclass(frozen=True, eq=False)
class Execution:
    """An execution.

    Attributes:
        world: In which.
        reference: What was asked of the drives.
        run: What happened.
        outcome: How it compares with the plan.
    """

    world: World
    reference: Reference
    run: Run
    outcome: Outcome


def execute_plan(
    problem: Problem, result: PlanResult, options: ExecutionOptions | None = None
) -> Execution:
    """Execute a plan once.

    Same input, same answer.

    Args:
        problem: What was planned.
        result: Its plan.
        options: How.

    Raises:
        CfplanError: There is no plan, it is not the problem's, or MuJoCo is not installed.
    """
    return Executor(problem, result, options or ExecutionOptions()).run(0)


class Executor:
    """Executes a plan again and again, each time in another world.

    Args:
        problem: What was planned.
        result: Its plan.
        options: How.
        torques: Gives the torques that are fed forward at the frames of each segment, N·m.

    Raises:
        CfplanError: There is no plan, or it is not the problem's.
    """

    def __init__(
        self,
        problem: Problem,
        result: PlanResult,
        options: ExecutionOptions,
        torques: FeedForward = planned_torques,
    ) -> None:
        if not result.solved:
            raise CfplanError(
                f'only a solved plan can be executed, status is {result.status.value}'
            )
        if result.problem != problem.name or result.joint_names != problem.hand.joint_names:
            raise CfplanError(
                f'plan must be of problem {problem.name} with joints '
                f'{", ".join(problem.hand.joint_names)}, is of {result.problem} with joints '
                f'{", ".join(result.joint_names)}'
            )
        self.problem = problem
        self.result = result
        self.options = options
        self.system = ContactSystem(problem)
        unit = self.system.force_unit * self.system.size
        joints = len(result.joint_names)
        stiffness = options.gain if options.gain is not None else DRIVE_STIFFNESS * unit
        inertia = problem.object.mass * self.system.size**2
        damping = 2.0 * _DAMPING_RATIO * np.sqrt(stiffness * inertia)
        self.gains = Gains(
            np.full(joints, stiffness),
            np.full(joints, _COMPLIANCE * stiffness),
            np.full(joints, damping),
        )
        self.reference = build_reference(
            self.system,
            result,
            torques(self.system, result),
            self._stiff(),
            options.time_step,
            _REST,
        )

    def _stiff(self) -> BoolArray:
        """Which joints are held in position in each segment, shape (segments, n)."""
        segments, names = self.result.segments, self.result.joint_names
        if not self.options.roles:
            return np.ones((len(segments), len(names)), dtype=bool)
        if any(segment.control is None for segment in segments):
            raise CfplanError(
                'roles: the plan does not say which joints are controlled in position and which '
                'in torque; --no-roles holds all of them in position'
            )
        return np.array(
            [[(s.control or {})[name] == POSITION for name in names] for s in segments]
        )

    def run(self, trial: int) -> Execution:
        """Execute once, in the world that seed and number of the trial give."""
        options = self.options
        generator = np.random.default_rng([options.seed, trial])
        world = draw(self.problem, options.uncertainty, generator)
        scene = build_scene(world.problem, options.time_step, world.friction)
        every = max(1, round(options.sampling / options.time_step))
        run = simulate(scene, self.reference, self.gains, world.joint_errors, every)
        outcome = assess(
            ContactSystem(world.problem),
            self.system,
            self.result,
            self.reference,
            run,
            _EXACT if options.uncertainty.none else _DISTURBED,
        )
        return Execution(world, self.reference, run, outcome)
