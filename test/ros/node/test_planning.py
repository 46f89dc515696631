"""The service ~/plan: what is answered."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from builtin_interfaces.msg import Duration
from rclpy.executors import MultiThreadedExecutor
from ros.node.harness import (
    INFEASIBLE_FILE,
    Client,
    Code,
    Planner,
    story,
    story_request,
)
from ros.node.slow_search import slow_hand_file, slow_request

from cfplan_core import load_problem, plan
from cfplan_ros.conversions.plans import plan_result
from cfplan_ros.conversions.requests import request_from_problem

Start = Callable[..., Planner]


def test_solved_request_is_answered_with_the_plan_of_the_core(
    planner: Planner, client: Client
) -> None:
    response = client.plan(story_request())
    assert response.error_code == Code.NONE, response.error_msg
    answered = plan_result(response)
    expected = plan(story())
    assert answered.segments == expected.segments
    np.testing.assert_array_equal(answered.joints, expected.joints)
    np.testing.assert_array_equal(answered.object_poses, expected.object_poses)
    np.testing.assert_array_equal(answered.torque_lower, expected.torque_lower)
    np.testing.assert_array_equal(answered.torque_upper, expected.torque_upper)
    np.testing.assert_allclose(answered.times, expected.times, rtol=0.0, atol=1e-9)


def test_planner_with_many_threads_answers_too(start_planner: Start, client: Client) -> None:
    start_planner(executor_class=MultiThreadedExecutor)
    assert client.plan(story_request()).error_code == Code.NONE


def test_object_of_the_planner_is_taken_where_the_request_brings_none(
    planner: Planner, client: Client
) -> None:
    request = story_request()
    request.object = []
    assert client.plan(request).error_code == Code.NONE


def test_problem_without_a_solution_is_infeasible(start_planner: Start, client: Client) -> None:
    start_planner(hand_file=str(INFEASIBLE_FILE))
    response = client.plan(request_from_problem(load_problem(INFEASIBLE_FILE)))
    assert response.error_code == Code.INFEASIBLE
    assert 'explored' in response.error_msg
    assert not response.plan.joint_trajectory.points


def test_time_budget_of_the_request_is_kept(planner: Planner, client: Client) -> None:
    response = client.plan(story_request(time_budget=Duration(nanosec=1_000_000)))
    assert response.error_code == Code.BUDGET_EXHAUSTED
    assert 'time budget of 0.001 s' in response.error_msg


def test_time_budget_of_the_planner_caps_that_of_the_request(
    start_planner: Start, client: Client
) -> None:
    start_planner(default_time_budget=0.001, maximal_time_budget=0.001)
    response = client.plan(story_request(time_budget=Duration(sec=30)))
    assert response.error_code == Code.BUDGET_EXHAUSTED
    assert 'time budget of 0.001 s' in response.error_msg


def test_budget_of_nodes_is_kept(planner: Planner, client: Client) -> None:
    response = client.plan(story_request(max_nodes=2))
    assert response.error_code == Code.BUDGET_EXHAUSTED
    assert '2 nodes' in response.error_msg


def test_planner_without_hand_is_not_configured(start_planner: Start, client: Client) -> None:
    start_planner(hand_file='')
    response = client.plan(story_request('unconfigured'))
    assert response.error_code == Code.NOT_CONFIGURED
    assert 'hand_file' in response.error_msg
    assert response.plan.problem_name == 'unconfigured'


def test_planner_without_object_is_not_configured_for_a_request_without(
    start_planner: Start, client: Client
) -> None:
    start_planner(object_file='')
    request = story_request()
    request.object = []
    assert client.plan(request).error_code == Code.NOT_CONFIGURED


# More than one thing at a time.


def test_requests_that_come_together_are_all_answered_each_with_its_own(
    planner: Planner, client: Client
) -> None:
    names = [f'number {k}' for k in range(5)]
    pending = [client.send_plan(story_request(name)) for name in names]
    responses = [each.answer() for each in pending]
    assert [response.error_code for response in responses] == [Code.NONE] * 5
    assert [response.plan.problem_name for response in responses] == names


def test_request_while_planning_is_refused_where_none_may_wait(
    start_planner: Start, client: Client, tmp_path: Path
) -> None:
    planner = start_planner(hand_file=str(slow_hand_file(tmp_path)), queue_length=0)
    first = client.send_plan(slow_request())
    planning(client)
    second = client.plan(slow_request('second'))
    assert second.error_code == Code.BUSY
    assert second.plan.problem_name == 'second'
    planner.stop()
    assert first.answer().error_code == Code.CANCELED


def test_request_that_waits_is_answered_when_the_planner_stops(
    start_planner: Start, client: Client, tmp_path: Path
) -> None:
    planner = start_planner(hand_file=str(slow_hand_file(tmp_path)), queue_length=1)
    first, second = client.send_plan(slow_request()), client.send_plan(slow_request())
    planning(client)
    assert client.plan(slow_request()).error_code == Code.BUSY
    planner.stop()
    assert first.answer().error_code == Code.CANCELED
    assert second.answer().error_code == Code.CANCELED


def test_parameters_are_answered_while_planning(
    start_planner: Start, client: Client, tmp_path: Path
) -> None:
    planner = start_planner(hand_file=str(slow_hand_file(tmp_path)))
    pending = client.send_plan(slow_request())
    planning(client)
    seconds = []
    for _ in range(10):
        began = time.monotonic()
        assert client.get('queue_length') == 10
        seconds.append(time.monotonic() - began)
    assert not pending.done
    assert statistics.median(seconds) < 0.1
    planner.stop()
    pending.answer()


def planning(client: Client) -> None:
    """Wait until diagnostics say that a plan is being computed."""
    client.planner_state(lambda values: values['state'] == 'planning')
