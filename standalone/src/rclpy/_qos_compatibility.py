"""Whether a publisher and a subscription of given profiles can talk to each other."""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING

from rclpy._qos_policies import (
    DurabilityPolicy,
    LivelinessPolicy,
    QoSPolicyEnum,
    ReliabilityPolicy,
)

if TYPE_CHECKING:
    from rclpy.qos import QoSProfile


class QoSCompatibility(IntEnum):
    """Whether a publisher and a subscription can talk, with the values of rmw."""

    OK = 0
    WARNING = 1
    ERROR = 2


def qos_check_compatible(
    publisher_qos: QoSProfile, subscription_qos: QoSProfile
) -> tuple[QoSCompatibility, str]:
    """Say whether a publisher's samples reach a subscription.

    Returns:
        The verdict, and its reasons, each ended by a semicolon; '' when there are none. WARNING
        means that it depends on a policy whose value is not known.
    """
    errors = _errors(publisher_qos, subscription_qos)
    if errors:
        return QoSCompatibility.ERROR, errors
    warnings = _warnings(publisher_qos, subscription_qos)
    if warnings:
        return QoSCompatibility.WARNING, warnings
    return QoSCompatibility.OK, ''


def _errors(publisher: QoSProfile, subscription: QoSProfile) -> str:
    deadlines = (publisher.deadline.nanoseconds, subscription.deadline.nanoseconds)
    leases = (
        publisher.liveliness_lease_duration.nanoseconds,
        subscription.liveliness_lease_duration.nanoseconds,
    )
    cases = {
        'Best effort publisher and reliable subscription': (
            publisher.reliability == ReliabilityPolicy.BEST_EFFORT
            and subscription.reliability == ReliabilityPolicy.RELIABLE
        ),
        'Volatile publisher and transient local subscription': (
            publisher.durability == DurabilityPolicy.VOLATILE
            and subscription.durability == DurabilityPolicy.TRANSIENT_LOCAL
        ),
        'Subscription has a deadline, but publisher does not': deadlines[0] == 0 < deadlines[1],
        'Subscription deadline is less than publisher deadline': 0 < deadlines[1] < deadlines[0],
        "Publisher's liveliness is automatic and subscription's is manual by topic": (
            publisher.liveliness == LivelinessPolicy.AUTOMATIC
            and subscription.liveliness == LivelinessPolicy.MANUAL_BY_TOPIC
        ),
        'Subscription has a liveliness lease duration, but publisher does not': (
            leases[0] == 0 < leases[1]
        ),
        'Subscription liveliness lease duration is less than publisher': (
            0 < leases[1] < leases[0]
        ),
    }
    return ''.join(f'ERROR: {text};' for text, applies in cases.items() if applies)


def _warnings(publisher: QoSProfile, subscription: QoSProfile) -> str:
    texts = (
        _policy_warning(
            publisher.reliability,
            subscription.reliability,
            offered_less=ReliabilityPolicy.BEST_EFFORT,
            asked_more=ReliabilityPolicy.RELIABLE,
            both='Publisher reliability is {0} and subscription reliability is {1}',
            more='Reliable subscription, but publisher is {0}',
            less='Best effort publisher, but subscription is {1}',
        ),
        _policy_warning(
            publisher.durability,
            subscription.durability,
            offered_less=DurabilityPolicy.VOLATILE,
            asked_more=DurabilityPolicy.TRANSIENT_LOCAL,
            # The misspelling is rmw_dds_common's.
            both='Publisher durabilty is {0} and subscription durability is {1}',
            more='Transient local subscription, but publisher is {0}',
            less='Volatile publisher, but subscription is {1}',
        ),
        _policy_warning(
            publisher.liveliness,
            subscription.liveliness,
            offered_less=LivelinessPolicy.AUTOMATIC,
            asked_more=LivelinessPolicy.MANUAL_BY_TOPIC,
            both='Publisher liveliness is {0} and subscription liveliness is {1}',
            more="Subscription's liveliness is manual by topic, but publisher's is {0}",
            less="Publisher's liveliness is automatic, but subscription's is {1}",
        ),
    )
    return ''.join(f'WARNING: {text};' for text in texts if text)


def _policy_warning(
    offered: QoSPolicyEnum,
    asked: QoSPolicyEnum,
    *,
    offered_less: QoSPolicyEnum,
    asked_more: QoSPolicyEnum,
    both: str,
    more: str,
    less: str,
) -> str:
    names = (offered.short_key, asked.short_key)
    offered_open = offered.name in ('SYSTEM_DEFAULT', 'UNKNOWN')
    asked_open = asked.name in ('SYSTEM_DEFAULT', 'UNKNOWN')
    if offered_open and asked_open:
        return both.format(*names)
    if offered_open and asked == asked_more:
        return more.format(*names)
    if offered == offered_less and asked_open:
        return less.format(*names)
    return ''
