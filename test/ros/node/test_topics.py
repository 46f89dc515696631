"""What the planner publishes, and who hears it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from cfplan_msgs.msg import JointTorqueLimits, ManipulationPlan
from geometry_msgs.msg import PoseStamped
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from ros.node.harness import LATCHED, VOLATILE, Client, Planner, story, story_request
from ros.trajectory_rules import broken_rules
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import MarkerArray

Start = Callable[..., Planner]


def test_trajectory_is_one_that_a_controller_takes(planner: Planner, client: Client) -> None:
    heard = client.listen(JointTrajectory, 'joint_trajectory')
    client.plan(story_request())
    trajectory = heard.next()
    state = trajectory.points[0].positions
    assert broken_rules(trajectory, story().hand.joint_names, state=state) == []
    np.testing.assert_allclose(state, story().start.joints, rtol=0.0, atol=1e-6)


def test_published_trajectory_is_that_of_the_answer(planner: Planner, client: Client) -> None:
    heard = client.listen(JointTrajectory, 'joint_trajectory')
    response = client.plan(story_request())
    assert heard.next() == response.plan.joint_trajectory


def test_torque_limits_have_the_stamp_and_the_times_of_the_trajectory(
    planner: Planner, client: Client
) -> None:
    trajectories = client.listen(JointTrajectory, 'joint_trajectory')
    limits = client.listen(JointTorqueLimits, 'torque_limits')
    client.plan(story_request())
    trajectory, limit = trajectories.next(), limits.next()
    assert trajectory.header.stamp == limit.header.stamp
    assert trajectory.header.stamp.sec > 0
    assert [point.time_from_start for point in trajectory.points] == [
        point.time_from_start for point in limit.points
    ]


def test_plan_and_markers_reach_a_late_subscriber(planner: Planner, client: Client) -> None:
    response = client.plan(story_request())
    assert client.listen(ManipulationPlan, 'plan_result', LATCHED).next() == response.plan
    assert client.listen(MarkerArray, 'markers', LATCHED).next().markers
    assert client.listen(TFMessage, '/tf_static', LATCHED).next().transforms


def test_trajectory_does_not_reach_a_late_subscriber(planner: Planner, client: Client) -> None:
    """The first trajectory that it hears is that of the plan after."""
    client.plan(story_request())
    heard = client.listen(JointTrajectory, 'joint_trajectory')
    second = client.plan(story_request())
    assert heard.next().header.stamp == second.plan.header.stamp


def test_trajectory_is_not_offered_to_a_subscriber_that_wants_it_latched(
    planner: Planner, client: Client
) -> None:
    (publisher,) = client.publishers('joint_trajectory')
    assert publisher.qos_profile.durability == DurabilityPolicy.VOLATILE
    assert publisher.qos_profile.reliability == ReliabilityPolicy.RELIABLE


def test_plan_only_publishes_the_plan_and_no_command(planner: Planner, client: Client) -> None:
    """The first commands heard are those of the request after."""
    trajectories = client.listen(JointTrajectory, 'joint_trajectory')
    limits = client.listen(JointTorqueLimits, 'torque_limits')
    plans = client.listen(ManipulationPlan, 'plan_result')
    only = client.plan(story_request(plan_only=True))
    after = client.plan(story_request())
    assert plans.next().header.stamp == only.plan.header.stamp
    assert trajectories.next().header.stamp == after.plan.header.stamp
    assert limits.next().header.stamp == after.plan.header.stamp


def test_planner_that_must_not_publish_commands_does_not(
    start_planner: Start, client: Client
) -> None:
    start_planner(publish=False)
    heard = client.listen(JointTrajectory, 'joint_trajectory')
    client.plan(story_request())
    (result,) = client.set(publish=True)
    assert result.successful
    second = client.plan(story_request())
    assert heard.next().header.stamp == second.plan.header.stamp


# Playing.


def test_plan_is_played_on_request_from_its_start_to_its_end(
    start_planner: Start, client: Client
) -> None:
    start_planner(preview__speed=20.0)
    states = client.listen(JointState, 'joint_states')
    poses = client.listen(PoseStamped, 'object_pose')
    transforms = client.listen(TFMessage, '/tf')
    contacts = client.listen(MarkerArray, 'contact_markers')
    limits = client.listen(JointTorqueLimits, 'preview/torque_limits')
    points = client.plan(story_request()).plan.joint_trajectory.points
    assert client.call(Trigger, 'play', Trigger.Request()).success
    played = [states.next() for _ in points]
    assert [state.position for state in played] == [point.positions for point in points]
    for other in (poses, contacts, limits):
        for _ in points:
            other.next()
    last = _nanoseconds(played[-1].header.stamp)
    transforms.until(lambda heard: _nanoseconds(heard.transforms[0].header.stamp) == last)
    assert states.empty


def test_viewers_are_told_the_start_grasp_again_and_again(
    planner: Planner, client: Client
) -> None:
    transforms = client.listen(TFMessage, '/tf')
    client.plan(story_request())
    first, second = transforms.next(), transforms.next()
    assert first.transforms[0].header.stamp != second.transforms[0].header.stamp
    start = story().start
    for heard in (first, second):
        links = {each.child_frame_id: each.transform for each in heard.transforms}
        turn = links['left/link_1'].rotation
        angle = 2.0 * math.atan2(turn.z, turn.w)
        assert angle == pytest.approx(start.joints[0], abs=1e-8)
        assert links['object'].translation.x == pytest.approx(start.object_pose[0], abs=1e-8)


def test_speed_of_playing_is_that_of_the_parameter(start_planner: Start, client: Client) -> None:
    start_planner(preview__speed=10.0)
    states = client.listen(JointState, 'joint_states')
    points = client.plan(story_request()).plan.joint_trajectory.points
    client.call(Trigger, 'play', Trigger.Request())
    played = [states.next() for _ in points]
    duration = _nanoseconds(played[-1].header.stamp) - _nanoseconds(played[0].header.stamp)
    expected = _nanoseconds(points[-1].time_from_start) / 10.0
    assert abs(duration - expected) < 10


def test_nothing_is_played_before_there_is_a_plan(planner: Planner, client: Client) -> None:
    response = client.call(Trigger, 'play', Trigger.Request())
    assert not response.success
    assert response.message == 'there is no plan to play'


def test_plan_is_not_played_twice_at_once(start_planner: Start, client: Client) -> None:
    start_planner(preview__speed=0.01)
    client.plan(story_request())
    assert client.call(Trigger, 'play', Trigger.Request()).success
    second = client.call(Trigger, 'play', Trigger.Request())
    assert not second.success
    assert second.message == 'a plan is being played'


def _nanoseconds(time: Any) -> int:
    return int(time.sec) * 10**9 + int(time.nanosec)


def test_volatile_listener_of_latched_topics_hears_new_plans(
    planner: Planner, client: Client
) -> None:
    heard = client.listen(ManipulationPlan, 'plan_result', VOLATILE)
    response = client.plan(story_request())
    assert heard.next() == response.plan
