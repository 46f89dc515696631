from __future__ import annotations

import time
from collections import defaultdict
from typing import Any

import numpy as np
import pytest
from cfplan_msgs.msg import ManipulationPlan
from rclpy.serialization import deserialize_message, serialize_message
from ros.visualization.examples import START, Planned
from ros.visualization.test_markers import world_bodies
from ros.visualization.viewer import Viewer
from visualization_msgs.msg import Marker

from cfplan_core.contact.system import ContactSystem
from cfplan_core.mechanics.contact_forces import Stretch, contact_forces
from cfplan_core.report.scene import plan_grasps, segment_at
from cfplan_ros.conversions.times import nanoseconds_of
from cfplan_ros.recording.topics import PREVIEW
from cfplan_ros.visualization.frames import static_transforms
from cfplan_ros.visualization.markers import scene_markers
from cfplan_ros.visualization.preview import (
    CONTACT_MARKERS,
    JOINT_STATES,
    OBJECT_POSE,
    TORQUE_LIMITS,
    TRANSFORMS,
    preview,
)

TOPICS = [TRANSFORMS, JOINT_STATES, OBJECT_POSE, CONTACT_MARKERS, TORQUE_LIMITS]


def by_topic(planned: Planned, speed: float = 1.0) -> dict[str, list[tuple[int, Any]]]:
    messages: dict[str, list[tuple[int, Any]]] = defaultdict(list)
    for when, topic, message in preview(planned.problem, planned.message, START, speed):
        messages[topic].append((when, message))
    return messages


def stamps_in(message: Any) -> list[int]:
    if hasattr(message, 'transforms'):
        parts = message.transforms
    else:
        parts = getattr(message, 'markers', [message])
    return [nanoseconds_of(part.header.stamp) for part in parts]


def segment_of(planned: Planned, point: int) -> int:
    return segment_at(planned.result.segments, point)


def test_each_topic_has_one_message_for_each_point(planned: Planned) -> None:
    messages = by_topic(planned)
    assert set(messages) == set(TOPICS)
    assert {len(each) for each in messages.values()} == {len(planned.result.times)}


def test_times_are_the_start_plus_the_plan_s_and_strictly_increasing(planned: Planned) -> None:
    expected = [
        START + nanoseconds_of(point.time_from_start)
        for point in planned.message.joint_trajectory.points
    ]
    assert expected == sorted(set(expected))
    for messages in by_topic(planned).values():
        assert [when for when, _ in messages] == expected


def test_the_order_is_that_of_time(planned: Planned) -> None:
    times = [when for when, _, _ in preview(planned.problem, planned.message, START)]
    assert times == sorted(times)


def test_every_stamp_is_the_message_s_time(planned: Planned) -> None:
    for messages in by_topic(planned).values():
        for when, message in messages:
            assert set(stamps_in(message)) == {when}


def test_every_message_survives_serialization(story: Planned) -> None:
    for _, _, message in preview(story.problem, story.message, START):
        data = serialize_message(message)
        assert deserialize_message(data, type(message)) == message


def test_twice_the_speed_takes_half_the_time(story: Planned) -> None:
    usual = [when - START for when, _ in by_topic(story)[JOINT_STATES]]
    fast = [when - START for when, _ in by_topic(story, 2.0)[JOINT_STATES]]
    np.testing.assert_allclose(fast, np.array(usual) / 2.0, atol=1.0)


def test_bodies_follow_the_plan(planned: Planned) -> None:
    viewer = Viewer('palm')
    viewer.transforms(
        static_transforms(planned.problem.hand, 'palm', planned.message.header.stamp)
    )
    viewer.show(scene_markers(planned.problem, planned.message))
    frames = by_topic(planned)[TRANSFORMS]
    for (_, message), grasp in zip(frames, plan_grasps(planned.result), strict=True):
        viewer.transforms(message)
        for (ns, number), vertices in world_bodies(planned.problem, grasp).items():
            found = viewer.points(f'{ns}_outline', number)[:-1, :2]
            np.testing.assert_allclose(found, vertices, atol=1e-12)


def test_joint_states_are_the_plan_s(planned: Planned) -> None:
    points = planned.message.joint_trajectory.points
    for k, (_, state) in enumerate(by_topic(planned)[JOINT_STATES]):
        assert tuple(state.name) == planned.result.joint_names
        assert list(state.position) == planned.result.joints[k].tolist()
        assert list(state.velocity) == list(points[k].velocities)
        assert not len(state.effort)


def test_object_poses_are_the_plan_s(planned: Planned) -> None:
    for (_, message), pose in zip(
        by_topic(planned)[OBJECT_POSE], planned.message.object_poses, strict=True
    ):
        assert message.header.frame_id == 'palm'
        assert message.pose == pose


def test_torque_limits_are_those_of_the_instant(planned: Planned) -> None:
    for k, (_, message) in enumerate(by_topic(planned)[TORQUE_LIMITS]):
        assert tuple(message.joint_names) == planned.result.joint_names
        (point,) = message.points
        assert list(point.lower) == planned.result.torque_lower[k].tolist()
        assert list(point.upper) == planned.result.torque_upper[k].tolist()


def test_the_object_s_quaternion_never_jumps(planned: Planned) -> None:
    turns = [message.transforms[-1].transform.rotation for _, message in by_topic(planned)['/tf']]
    q = np.array([(turn.z, turn.w) for turn in turns])
    assert ((q[1:] * q[:-1]).sum(axis=1) > 0.9).all()


def test_dots_touch_object_and_hand(planned: Planned) -> None:
    system = ContactSystem(planned.problem)
    grasps = plan_grasps(planned.result)
    for k, (_, message) in enumerate(by_topic(planned)[CONTACT_MARKERS]):
        (dots,) = [m for m in message.markers if (m.ns, m.action) == ('contacts', Marker.ADD)]
        z = system.configuration(grasps[k])
        vertices = system.place(z[None]).vertices[0] * system.size
        found = np.array([p.x + 1j * p.y for p in dots.points])
        assert len(found) == len(planned.result.segments[segment_of(planned, k)].contacts)
        assert np.abs(found[:, None] - vertices).min(axis=1).max() < 1e-9


def test_caption_names_the_torque_limits_of_the_instant(planned: Planned) -> None:
    names, result = planned.result.joint_names, planned.result
    for k, (_, message) in enumerate(by_topic(planned)[CONTACT_MARKERS]):
        (caption,) = [m for m in message.markers if m.ns == 'segment']
        said = dict(line.split(' ', 1) for line in caption.text.splitlines()[1:])
        assert tuple(said) == names
        for name, lower, upper in zip(
            names, result.torque_lower[k], result.torque_upper[k], strict=True
        ):
            low, high = said[name].removesuffix(' N·m').split(' to ')
            assert low == (f'{lower:.3g}' if np.isfinite(lower) else 'unbounded')
            assert high == (f'{upper:.3g}' if np.isfinite(upper) else 'unbounded')


def test_arrows_add_up_to_the_weight_to_one_scale(planned: Planned) -> None:
    problem, segments = planned.problem, planned.result.segments
    weight = problem.object.mass * float(np.hypot(*problem.gravity))
    stretches = [
        Stretch(
            segment.contacts,
            planned.result.object_poses[segment.first_frame : segment.last_frame + 1],
            planned.result.joints[segment.first_frame : segment.last_frame + 1],
        )
        for segment in segments
    ]
    found = contact_forces(ContactSystem(problem), stretches)
    largest = max(weight, *(forces.forces.max() for forces in found))
    for _, message in by_topic(planned)[CONTACT_MARKERS]:
        arrows = [m for m in message.markers if (m.ns, m.action) == ('forces', Marker.ADD)]
        total = sum(
            np.array([m.points[1].x - m.points[0].x, m.points[1].y - m.points[0].y])
            for m in arrows
        )
        expected = [0.0, problem.object.size * weight / largest]
        # Arrows that are too short to be drawn are missing from the sum.
        np.testing.assert_allclose(total, expected, atol=0.08 * problem.object.size)


def test_a_viewer_shows_only_contacts_of_the_instant(planned: Planned) -> None:
    viewer = Viewer('palm')
    for _, message in by_topic(planned)[CONTACT_MARKERS]:
        viewer.show(message)
        added = {(m.ns, m.id) for m in message.markers if m.action == Marker.ADD}
        assert set(viewer.markers) == added


def test_played_again_from_the_start_nothing_stale_remains(planned: Planned) -> None:
    messages = [message for _, message in by_topic(planned)[CONTACT_MARKERS]]
    viewer = Viewer('palm')
    for message in [*messages, messages[0]]:
        viewer.show(message)
    assert set(viewer.markers) == {
        (m.ns, m.id) for m in messages[0].markers if m.action == Marker.ADD
    }


def test_a_contact_keeps_its_number(planned: Planned) -> None:
    places: dict[int, np.ndarray] = {}
    size = planned.problem.object.size
    for _, message in by_topic(planned)[CONTACT_MARKERS]:
        now = {
            m.id: np.array([m.points[0].x, m.points[0].y])
            for m in message.markers
            if (m.ns, m.action) == ('forces', Marker.ADD)
        }
        for number in set(now) & set(places):
            assert np.hypot(*(now[number] - places[number])) < 0.2 * size
        places = now


def test_the_caption_names_segment_and_stability(story: Planned) -> None:
    for k, (_, message) in enumerate(by_topic(story)[CONTACT_MARKERS]):
        (caption,) = [m for m in message.markers if m.type == Marker.TEXT_VIEW_FACING]
        index = segment_of(story, k)
        stability = story.result.segments[index].stability.replace('_', ' ')
        assert caption.text.startswith(f'{index + 1} of {len(story.result.segments)}: {stability}')


def test_without_points_there_is_nothing_to_play(story: Planned) -> None:
    assert not list(preview(story.problem, ManipulationPlan(), START))


def test_playing_costs_little(story: Planned) -> None:
    seconds = []
    for _ in range(5):
        begin = time.process_time()
        messages = list(preview(story.problem, story.message, START))
        seconds.append(time.process_time() - begin)
    assert len(messages) == 5 * len(story.result.times)
    assert min(seconds) < 0.15


@pytest.mark.parametrize('topic', TOPICS)
def test_topics_are_those_of_a_run_file(topic: str) -> None:
    assert topic.removeprefix('~/') in {recorded.name for recorded in PREVIEW}
