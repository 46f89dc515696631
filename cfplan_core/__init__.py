"""Plans dexterous manipulation: which contacts, which joint motion, between which torques.

The names below are the public interface. Each is imported when it is first used, so that
`import cfplan_core` costs next to nothing; the planner needs SciPy, the tables rich.

    from cfplan_core import load_problem, plan

    result = plan(load_problem('config/problems/trinkle_hunter_1991.yaml'))
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cfplan_core.errors import CfplanError as CfplanError
    from cfplan_core.errors import Finding as Finding
    from cfplan_core.errors import InvalidPlanError as InvalidPlanError
    from cfplan_core.errors import InvalidProblemError as InvalidProblemError
    from cfplan_core.execution.execute import Execution as Execution
    from cfplan_core.execution.execute import ExecutionOptions as ExecutionOptions
    from cfplan_core.execution.execute import execute_plan as execute_plan
    from cfplan_core.execution.perturbation import Uncertainty as Uncertainty
    from cfplan_core.exploration import Exploration as Exploration
    from cfplan_core.exploration import explore as explore
    from cfplan_core.model import Finger as Finger
    from cfplan_core.model import Goal as Goal
    from cfplan_core.model import Grasp as Grasp
    from cfplan_core.model import Hand as Hand
    from cfplan_core.model import Joint as Joint
    from cfplan_core.model import Link as Link
    from cfplan_core.model import ManipulatedObject as ManipulatedObject
    from cfplan_core.model import Problem as Problem
    from cfplan_core.model import Tolerance as Tolerance
    from cfplan_core.model.loading import load_problem as load_problem
    from cfplan_core.options import PlanOptions as PlanOptions
    from cfplan_core.options import Preference as Preference
    from cfplan_core.options import TrajectoryOptions as TrajectoryOptions
    from cfplan_core.planner import Progress as Progress
    from cfplan_core.planner import plan as plan
    from cfplan_core.trajectory.plan_file import read_plan as read_plan
    from cfplan_core.trajectory.plan_file import write_plan as write_plan
    from cfplan_core.trajectory.plan_margin import plan_margin as plan_margin
    from cfplan_core.trajectory.plan_result import PlanResult as PlanResult
    from cfplan_core.trajectory.plan_result import Segment as Segment
    from cfplan_core.trajectory.plan_result import Statistics as Statistics
    from cfplan_core.trajectory.plan_result import Status as Status
    from cfplan_core.verification import verify_plan as verify_plan

__version__ = '0.1.0'

_HOMES = {
    'errors': ('CfplanError', 'Finding', 'InvalidPlanError', 'InvalidProblemError'),
    'execution.execute': ('Execution', 'ExecutionOptions', 'execute_plan'),
    'execution.perturbation': ('Uncertainty',),
    'exploration': ('Exploration', 'explore'),
    'model': (
        'Finger',
        'Goal',
        'Grasp',
        'Hand',
        'Joint',
        'Link',
        'ManipulatedObject',
        'Problem',
        'Tolerance',
    ),
    'model.loading': ('load_problem',),
    'options': ('PlanOptions', 'Preference', 'TrajectoryOptions'),
    'planner': ('Progress', 'plan'),
    'trajectory.plan_file': ('read_plan', 'write_plan'),
    'trajectory.plan_margin': ('plan_margin',),
    'trajectory.plan_result': ('PlanResult', 'Segment', 'Statistics', 'Status'),
    'verification': ('verify_plan',),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}

__all__ = sorted([*_HOME_OF, '__version__'])


def __getattr__(name: str) -> object:
    if name not in _HOME_OF:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    value = getattr(import_module(f'{__name__}.{_HOME_OF[name]}'), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return list(__all__)
