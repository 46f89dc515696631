"""A channel's quality of service in the words of rosbag2, for the right durability on playback."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rclpy.duration import Duration
    from rclpy.qos import QoSProfile

# What a publisher offers that leaves a policy to the middleware (0), as rmw's numbers.
_KEEP_LAST = 1
_RELIABLE = 1
_VOLATILE = 2
_AUTOMATIC = 1
_INFINITE_NS = 2**63 - 1

_NS_PER_S = 10**9


def offered_qos_profiles(profile: QoSProfile) -> str:
    """Write a profile as YAML in the layout of rosbag2's channel metadata.

    Policies are their numbers in rmw: Humble reads only these, later versions read both.
    """
    lines = [
        f'- history: {int(profile.history) or _KEEP_LAST}',
        f'  depth: {profile.depth}',
        f'  reliability: {int(profile.reliability) or _RELIABLE}',
        f'  durability: {int(profile.durability) or _VOLATILE}',
        *_duration('deadline', profile.deadline),
        *_duration('lifespan', profile.lifespan),
        f'  liveliness: {int(profile.liveliness) or _AUTOMATIC}',
        *_duration('liveliness_lease_duration', profile.liveliness_lease_duration),
        '  avoid_ros_namespace_conventions: '
        + str(profile.avoid_ros_namespace_conventions).lower(),
    ]
    return '\n'.join(lines)


def _duration(name: str, duration: Duration) -> list[str]:
    sec, nsec = divmod(duration.nanoseconds or _INFINITE_NS, _NS_PER_S)
    return [f'  {name}:', f'    sec: {sec}', f'    nsec: {nsec}']
