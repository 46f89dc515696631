import pytest

from rclpy.duration import Duration
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    InvalidQoSProfileException,
    LivelinessPolicy,
    QoSCompatibility,
    QoSPresetProfiles,
    QoSProfile,
    ReliabilityPolicy,
    qos_check_compatible,
    qos_profile_parameter_events,
    qos_profile_sensor_data,
    qos_profile_services_default,
)


def test_a_depth_alone_means_keep_last_reliable_volatile():
    profile = QoSProfile(depth=3)
    assert (profile.history, profile.depth) == (HistoryPolicy.KEEP_LAST, 3)
    assert profile.reliability == ReliabilityPolicy.RELIABLE
    assert profile.durability == DurabilityPolicy.VOLATILE


def test_neither_history_nor_depth_is_refused():
    with pytest.raises(InvalidQoSProfileException, match='History and/or depth'):
        QoSProfile(reliability=ReliabilityPolicy.RELIABLE)


def test_keep_last_without_depth_is_refused():
    with pytest.raises(InvalidQoSProfileException, match='KEEP_LAST without a depth'):
        QoSProfile(history=HistoryPolicy.KEEP_LAST)


def test_an_unknown_policy_is_refused():
    with pytest.raises(AssertionError, match='Invalid arguments'):
        QoSProfile(depth=1, reliabilty=1)


@pytest.mark.parametrize(
    ('policy', 'value'),
    [('depth', 1.0), ('lifespan', 1), ('reliability', 'reliable'), ('deadline', 0.5)],
)
def test_a_value_of_another_type_is_refused(policy, value):
    with pytest.raises(AssertionError):
        QoSProfile(**{'depth': 1, policy: value})


def test_a_depth_of_zero_warns():
    with pytest.warns(UserWarning, match='interpreted as SYSTEM_DEFAULT'):
        QoSProfile(depth=0)


def test_profiles_are_equal_by_their_policies():
    assert QoSProfile(depth=10) == qos_profile_services_default
    assert QoSProfile(depth=10, lifespan=Duration(seconds=1)) != qos_profile_services_default


def test_policies_have_the_numbers_of_rmw():
    assert [int(value) for value in ReliabilityPolicy] == [0, 1, 2, 3, 4]
    assert [int(value) for value in LivelinessPolicy] == [0, 1, 3, 4, 5]
    assert (DurabilityPolicy.TRANSIENT_LOCAL, DurabilityPolicy.VOLATILE) == (1, 2)


@pytest.mark.parametrize(
    'policy', [HistoryPolicy, ReliabilityPolicy, DurabilityPolicy, LivelinessPolicy]
)
def test_short_keys_lead_back_to_their_values(policy):
    for key in policy.short_keys():
        assert policy(policy.get_from_short_key(key)).short_key == key


def test_presets_are_found_by_short_key_in_any_case():
    assert QoSPresetProfiles.get_from_short_key('Sensor_Data') == qos_profile_sensor_data


def test_the_release_notes_example_is_incompatible_word_for_word():
    assert qos_check_compatible(qos_profile_sensor_data, qos_profile_parameter_events) == (
        QoSCompatibility.ERROR,
        'ERROR: Best effort publisher and reliable subscription;',
    )


def test_all_reasons_of_an_incompatibility_are_given():
    offered = QoSProfile(depth=1, deadline=Duration(seconds=2))
    asked = QoSProfile(
        depth=1,
        durability=DurabilityPolicy.TRANSIENT_LOCAL,
        deadline=Duration(seconds=1),
        liveliness_lease_duration=Duration(seconds=1),
    )
    verdict, reason = qos_check_compatible(offered, asked)
    assert verdict is QoSCompatibility.ERROR
    assert reason == (
        'ERROR: Volatile publisher and transient local subscription;'
        'ERROR: Subscription deadline is less than publisher deadline;'
        'ERROR: Subscription has a liveliness lease duration, but publisher does not;'
    )


def test_fully_known_matching_profiles_are_compatible():
    profile = QoSProfile(depth=1, liveliness=LivelinessPolicy.AUTOMATIC)
    assert qos_check_compatible(profile, profile) == (QoSCompatibility.OK, '')


def test_an_unknown_policy_only_warns():
    offered = QoSProfile(
        depth=1,
        reliability=ReliabilityPolicy.SYSTEM_DEFAULT,
        liveliness=LivelinessPolicy.AUTOMATIC,
    )
    asked = QoSProfile(depth=1, liveliness=LivelinessPolicy.AUTOMATIC)
    assert qos_check_compatible(offered, asked) == (
        QoSCompatibility.WARNING,
        'WARNING: Reliable subscription, but publisher is system_default;',
    )
