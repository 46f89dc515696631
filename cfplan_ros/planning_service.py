"""From a request to its answer and to the messages of its plan, without a node."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from cfplan_msgs.srv import PlanManipulation

from cfplan_core import PlanOptions, Problem, Status, plan
from cfplan_ros.conversions.options import options_mapping
from cfplan_ros.conversions.plans import refusal, response_of
from cfplan_ros.conversions.requests import (
    InvalidRequestError,
    Setup,
    invalid_grasps,
    problem_from_request,
    problem_mapping,
    time_budget,
)
from cfplan_ros.conversions.times import duration_message, stamp_of
from cfplan_ros.visualization.frames import static_transforms
from cfplan_ros.visualization.markers import scene_markers
from cfplan_ros.visualization.preview import preview

Request = PlanManipulation.Request
Response = PlanManipulation.Response

NO_HAND = 'the planner has no hand: set its parameter hand_file'
CANCELED = 'canceled: the planner is shutting down'

# What a controller moves the hand by.
COMMANDS = ('torque_limits', 'joint_trajectory')
# What is shown of a plan before it is played.
SCENE = ('/tf_static', 'markers')

OUTCOMES = {
    int(Response.NONE): 'SOLVED',
    **{
        int(getattr(Response, name)): name
        for name in (
            'UNKNOWN',
            'INFEASIBLE',
            'BUDGET_EXHAUSTED',
            'CANCELED',
            'BUSY',
            'NOT_CONFIGURED',
            'HAND_MISMATCH',
            'INVALID_START',
            'INVALID_GOAL',
            'INVALID_OBJECT',
            'INVALID_GRAVITY',
            'INVALID_OPTIONS',
            'INVALID_FRAME',
        )
    },
}
"""Names of the error codes; that of no error says what there is."""


@dataclass(frozen=True, eq=False)
class Task:
    """A request, and the problem that it poses or why it poses none.

    Attributes:
        request: As it came.
        setup: What the planner brings to it.
        problem: None if the request is invalid.
        options: Limits of the search.
        error: Set if the request is invalid.
    """

    request: Any
    setup: Setup
    problem: Problem | None = None
    options: PlanOptions | None = None
    error: InvalidRequestError | None = None

    @property
    def capped(self) -> bool:
        """True if the request asks for more time than it gets."""
        return self.error is None and time_budget(self.request, self.setup)[1]

    def metadata(self) -> dict[str, object]:
        """What a recording needs to run the task again: problem and options."""
        if self.problem is None or self.options is None:
            return {}
        return {
            'problem': problem_mapping(self.request, self.setup),
            'options': options_mapping(self.options),
        }


def read_request(request: Any, setup: Setup) -> Task:
    """Read a request; one that is wrong makes a task that is answered with what is wrong."""
    try:
        problem, options = problem_from_request(request, setup)
    except InvalidRequestError as error:
        return Task(request, setup, error=error)
    return Task(request, setup, problem, options)


def refused(code: int, message: str, request: Any, setup: Setup, time_ns: int) -> Any:
    """Answer a request without planning, at a time in ns."""
    stamp = stamp_of(time_ns)
    return refusal(code, message, request.problem_name, setup.frame_id, stamp)


def carry_out(task: Task, cancel: threading.Event, now: Callable[[], int]) -> Any:
    """Plan and return the response, stamped when the plan was ready.

    Args:
        task: What to do.
        cancel: Ends the search, with the answer CANCELED.
        now: Time in ns.
    """
    if task.problem is None or task.error is not None:
        code = Response.UNKNOWN if task.error is None else task.error.code
        return refused(code, str(task.error), task.request, task.setup, now())
    result = plan(task.problem, task.options, cancel=cancel)
    if result.status is not Status.INVALID:
        return response_of(result, task.setup.frame_id, stamp_of(now()))
    error = invalid_grasps(result, task.problem, task.request, task.setup)
    response = refused(error.code, str(error), task.request, task.setup, now())
    response.planning_time = duration_message(result.statistics.planning_time)
    return response


def plan_messages(solved: Any) -> list[tuple[str, Any]]:
    """Topic and message of what must be known of a plan before it is answered, commands last.

    Args:
        solved: The plan as message, with points.
    """
    return [
        ('plan_result', solved),
        ('torque_limits', solved.torque_limits),
        ('joint_trajectory', solved.joint_trajectory),
    ]


def pictures(problem: Problem, solved: Any, start_time: int) -> Iterator[tuple[int, str, Any]]:
    """What viewers are shown of a plan: the scene, then the plan played in time.

    Computing them takes about as long as an easy search, so that they come after the answer. All
    are functions of problem and plan: a recording that lacks them can be completed.

    Args:
        problem: What was planned.
        solved: Its plan as message; without points there is nothing to show.
        start_time: The plan's stamp, ns.

    Yields:
        Time in ns, topic and message, in the order of time.
    """
    if not solved.joint_trajectory.points:
        return
    stamp = solved.header.stamp
    yield start_time, '/tf_static', static_transforms(problem.hand, solved.header.frame_id, stamp)
    yield start_time, 'markers', scene_markers(problem, solved)
    yield from preview(problem, solved, start_time)
