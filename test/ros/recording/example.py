"""The 1991 problem solved, as a planner would record it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import yaml
from cfplan_msgs.srv import PlanManipulation

from cfplan_core import PlanResult, Problem, load_problem, plan
from cfplan_ros.conversions.plans import response_of
from cfplan_ros.conversions.requests import request_from_problem
from cfplan_ros.conversions.times import stamp_of
from cfplan_ros.planning_service import pictures, plan_messages
from cfplan_ros.recording.recorder import Recorder, Run

PROBLEM_FILE = Path(__file__).parents[3] / 'config' / 'problems' / 'trinkle_hunter_1991.yaml'
NODE = '/hand/cfplan_planner'
START = 1_700_000_000_000_000_000
STAMP = START + 123_456_789


@dataclass(frozen=True)
class Example:
    problem: Problem
    metadata: dict[str, Any]
    result: PlanResult
    request: Any
    response: Any

    @property
    def essentials(self) -> list[tuple[str, Any]]:
        return plan_messages(self.response.plan)

    def preview(self) -> Iterator[tuple[int, str, Any]]:
        return pictures(self.problem, self.response.plan, STAMP)

    def begin(self, recorder: Recorder) -> Run:
        return recorder.begin(self.request, self.metadata, START)

    def answer(self, run: Run) -> str:
        return run.finish_essential(self.response, STAMP, self.essentials)

    def play(self, run: Run) -> None:
        for time_ns, topic, message in self.preview():
            run.add(topic, message, time_ns)


@cache
def example() -> Example:
    problem = load_problem(PROBLEM_FILE)
    result = plan(problem)
    # The same in every process.
    result = replace(result, statistics=replace(result.statistics, planning_time=0.25))
    return Example(
        problem,
        {
            'problem': yaml.safe_load(PROBLEM_FILE.read_text(encoding='utf-8')),
            'options': {'time_budget': 10.0},
            'parameters': {'frame_id': 'palm'},
        },
        result,
        request_from_problem(problem),
        response_of(result, 'palm', stamp_of(STAMP), record='run.mcap'),
    )


def not_solved() -> Any:
    return PlanManipulation.Response(
        error_code=PlanManipulation.Response.INFEASIBLE, error_msg='searched to the end'
    )


def recorder(directory: Path) -> Recorder:
    return Recorder(directory, NODE, lambda line: None)
