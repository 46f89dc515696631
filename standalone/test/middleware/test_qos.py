from __future__ import annotations

import pytest

from rclpy.duration import Duration
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)
from ros_standalone.middleware import library
from ros_standalone.middleware.qos import (
    best_available,
    dds_qos_from,
    native_qos,
    profile_from,
    read_qos,
    read_user_data,
)

PROFILES = [
    QoSProfile(depth=10),
    QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL),
    QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT),
    QoSProfile(history=HistoryPolicy.KEEP_ALL, durability=DurabilityPolicy.TRANSIENT_LOCAL),
    QoSProfile(
        depth=3,
        deadline=Duration(seconds=2),
        lifespan=Duration(nanoseconds=7),
        liveliness=LivelinessPolicy.MANUAL_BY_TOPIC,
        liveliness_lease_duration=Duration(seconds=1, nanoseconds=1),
    ),
]


@pytest.mark.parametrize('profile', PROFILES)
def test_policies_come_back_from_dds(profile):
    qos = dds_qos_from(profile)
    with native_qos(qos) as pointer:
        assert read_qos(pointer) == qos


@pytest.mark.parametrize('profile', PROFILES)
def test_profile_comes_back(profile):
    qos = dds_qos_from(profile)
    assert dds_qos_from(profile_from(qos)) == qos


def test_duration_of_zero_is_forever():
    qos = dds_qos_from(QoSProfile(depth=1))
    assert (qos.deadline, qos.lifespan, qos.lease) == (library.INFINITE,) * 3


def test_system_default_is_the_choice_of_ros():
    profile = QoSProfile(
        depth=1,
        history=HistoryPolicy.SYSTEM_DEFAULT,
        reliability=ReliabilityPolicy.SYSTEM_DEFAULT,
        durability=DurabilityPolicy.SYSTEM_DEFAULT,
        liveliness=LivelinessPolicy.SYSTEM_DEFAULT,
    )
    expected = QoSProfile(
        depth=1,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.VOLATILE,
        liveliness=LivelinessPolicy.AUTOMATIC,
    )
    assert dds_qos_from(profile) == dds_qos_from(expected)


def test_unknown_policy_is_an_error_that_names_it():
    profile = QoSProfile(depth=1, reliability=ReliabilityPolicy.UNKNOWN)
    with pytest.raises(ValueError, match=r'reliability policy .* got UNKNOWN'):
        dds_qos_from(profile)


@pytest.mark.parametrize('writers_latched', [True, False])
def test_best_available_reader_is_latched_where_every_writer_is(writers_latched):
    durability = DurabilityPolicy.TRANSIENT_LOCAL if writers_latched else DurabilityPolicy.VOLATILE
    writers = [
        dds_qos_from(QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)),
        dds_qos_from(QoSProfile(depth=1, durability=durability)),
    ]
    wish = QoSProfile(depth=1, durability=DurabilityPolicy.BEST_AVAILABLE)
    assert best_available(wish, writers).latched is writers_latched


def test_said_policy_does_not_follow_the_writers():
    writers = [dds_qos_from(QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT))]
    assert best_available(QoSProfile(depth=1), writers).reliable


def test_user_data_comes_back_from_dds():
    with native_qos(None, b'enclave=/;') as pointer:
        assert read_user_data(pointer) == b'enclave=/;'


def test_profile_tells_what_dds_chose():
    profile = profile_from(dds_qos_from(QoSProfile(depth=4)))
    assert (profile.history, profile.depth) == (HistoryPolicy.KEEP_LAST, 4)
    assert profile.reliability == ReliabilityPolicy.RELIABLE
    assert profile.durability == DurabilityPolicy.VOLATILE
    assert profile.liveliness == LivelinessPolicy.AUTOMATIC
