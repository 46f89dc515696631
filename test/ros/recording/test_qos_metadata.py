from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from mcap.reader import make_reader
from rclpy.duration import Duration
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)

from cfplan_ros.recording.qos_metadata import offered_qos_profiles
from cfplan_ros.recording.topics import COMMAND, LATCHED

GOLDEN = Path(__file__).parents[1] / 'golden' / 'rosbag2_jazzy.mcap'
# The names that Jazzy writes for the numbers that Humble reads.
NAMES = {
    'history': {'keep_last': 1},
    'reliability': {'reliable': 1},
    'durability': {'transient_local': 1, 'volatile': 2},
    'liveliness': {'automatic': 1},
}


def _golden(topic: str) -> str:
    with GOLDEN.open('rb') as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    channels = {channel.topic: channel for channel in summary.channels.values()}
    return channels[topic].metadata['offered_qos_profiles']


@pytest.mark.parametrize(
    ('topic', 'profile'),
    [('/hand/golden/markers', LATCHED), ('/hand/golden/joint_trajectory', COMMAND)],
)
def test_text_is_that_of_rosbag2_with_numbers_for_names(topic: str, profile: QoSProfile) -> None:
    expected = _golden(topic)
    for policy, numbers in NAMES.items():
        for name, number in numbers.items():
            expected = expected.replace(f'{policy}: {name}', f'{policy}: {number}')
    assert offered_qos_profiles(profile) == expected


def test_every_policy_is_written() -> None:
    profile = QoSProfile(
        history=HistoryPolicy.KEEP_ALL,
        depth=7,
        reliability=ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.VOLATILE,
        deadline=Duration(nanoseconds=1_500_000_000),
        lifespan=Duration(seconds=2),
        liveliness=LivelinessPolicy.MANUAL_BY_TOPIC,
        liveliness_lease_duration=Duration(nanoseconds=3),
        avoid_ros_namespace_conventions=True,
    )
    assert yaml.safe_load(offered_qos_profiles(profile)) == [
        {
            'history': 2,
            'depth': 7,
            'reliability': 2,
            'durability': 2,
            'deadline': {'sec': 1, 'nsec': 500_000_000},
            'lifespan': {'sec': 2, 'nsec': 0},
            'liveliness': 3,
            'liveliness_lease_duration': {'sec': 0, 'nsec': 3},
            'avoid_ros_namespace_conventions': True,
        }
    ]
