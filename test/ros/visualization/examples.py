"""The example problems with their plans, each planned once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from cfplan_msgs.msg import ManipulationPlan

from cfplan_core import PlanResult, Problem, load_problem, plan
from cfplan_ros.conversions.plans import plan_message
from cfplan_ros.conversions.times import stamp_of

PROBLEMS = sorted((Path(__file__).parents[3] / 'config' / 'problems').glob('*.yaml'))
START = 1_700_000_000_123_456_789


@dataclass(frozen=True)
class Planned:
    problem: Problem
    result: PlanResult
    message: ManipulationPlan


@lru_cache(maxsize=16)
def planned_file(path: Path) -> Planned:
    problem = load_problem(path)
    result = plan(problem)
    return Planned(problem, result, plan_message(result, 'palm', stamp_of(START)))
