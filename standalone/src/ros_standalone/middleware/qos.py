"""Quality of service: rclpy's profile as a Cyclone DDS one, and back."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from ros_standalone.middleware import library

if TYPE_CHECKING:
    from rclpy.qos import QoSProfile

_VOLATILE, _TRANSIENT_LOCAL = 0, 1
_KEEP_LAST, _KEEP_ALL = 0, 1
_BEST_EFFORT, _RELIABLE = 0, 1
_AUTOMATIC, _MANUAL_BY_TOPIC = 0, 2
_UNLIMITED = -1
_IGNORE_OWN_PARTICIPANT = 1
_LONGEST_DEPTH = (1 << 31) - 1


@dataclass(frozen=True)
class DdsQos:
    """The policies of an endpoint as DDS numbers them; durations are in nanoseconds.

    Where all is kept the depth is -1.
    """

    history: int = _KEEP_LAST
    depth: int = 1
    reliability: int = _RELIABLE
    durability: int = _VOLATILE
    deadline: int = library.INFINITE
    lifespan: int = library.INFINITE
    liveliness: int = _AUTOMATIC
    lease: int = library.INFINITE

    @property
    def reliable(self) -> bool:
        """Whether lost samples are sent again."""
        return self.reliability == _RELIABLE

    @property
    def latched(self) -> bool:
        """Whether late readers get earlier samples."""
        return self.durability != _VOLATILE


def dds_qos_from(profile: QoSProfile) -> DdsQos:
    """The DDS policies of a profile; 'system default' becomes ROS's choice for it.

    A policy that asks for the best available gets the strongest one: reliable, transient local,
    automatic liveliness. A reader that should follow its writers is made with `best_available`.

    Raises:
        ValueError: A policy is unknown or the depth is out of range.
    """
    depth = int(profile.depth)
    if not 0 <= depth <= _LONGEST_DEPTH:
        raise ValueError(f'the depth of a QoS profile must be 0..{_LONGEST_DEPTH}, got {depth}')
    history = _choose('history', profile.history, _HISTORY)
    return DdsQos(
        history=history,
        depth=_UNLIMITED if history == _KEEP_ALL else max(depth, 1),
        reliability=_choose('reliability', profile.reliability, _RELIABILITY),
        durability=_choose('durability', profile.durability, _DURABILITY),
        deadline=_duration(profile.deadline),
        lifespan=_duration(profile.lifespan),
        liveliness=_choose('liveliness', profile.liveliness, _LIVELINESS),
        lease=_duration(profile.liveliness_lease_duration),
    )


def unlimited(qos: DdsQos) -> DdsQos:
    """The same policies, where nothing is dropped that was not taken yet."""
    return replace(qos, history=_KEEP_ALL, depth=_UNLIMITED)


def deep(qos: DdsQos, depth: int) -> DdsQos:
    """The same policies with at least this depth."""
    return qos if qos.history == _KEEP_ALL else replace(qos, depth=max(qos.depth, depth))


def best_available(profile: QoSProfile, writers: list[DdsQos]) -> DdsQos:
    """The policies of a reader, where 'best available' is the most that every writer offers.

    Args:
        profile: What the reader asks for.
        writers: The policies of the topic's writers that are known now.
    """
    wanted = dds_qos_from(profile)
    changes: dict[str, int] = {}
    if profile.reliability.name == 'BEST_AVAILABLE' and not all(w.reliable for w in writers):
        changes['reliability'] = _BEST_EFFORT
    if profile.durability.name == 'BEST_AVAILABLE' and not all(w.latched for w in writers):
        changes['durability'] = _VOLATILE
    return replace(wanted, **changes)


def profile_from(qos: DdsQos) -> QoSProfile:
    """The rclpy profile of DDS policies; what ROS has no word for becomes UNKNOWN."""
    from rclpy.duration import Duration
    from rclpy.qos import (
        DurabilityPolicy,
        HistoryPolicy,
        LivelinessPolicy,
        QoSProfile,
        ReliabilityPolicy,
    )

    keep_all = qos.history == _KEEP_ALL
    return QoSProfile(
        history=HistoryPolicy.KEEP_ALL if keep_all else HistoryPolicy.KEEP_LAST,
        depth=0 if keep_all else qos.depth,
        reliability=(
            ReliabilityPolicy.RELIABLE if qos.reliable else ReliabilityPolicy.BEST_EFFORT
        ),
        durability={
            _VOLATILE: DurabilityPolicy.VOLATILE,
            _TRANSIENT_LOCAL: DurabilityPolicy.TRANSIENT_LOCAL,
        }.get(qos.durability, DurabilityPolicy.UNKNOWN),
        deadline=Duration(nanoseconds=qos.deadline),
        lifespan=Duration(nanoseconds=qos.lifespan),
        liveliness={
            _AUTOMATIC: LivelinessPolicy.AUTOMATIC,
            _MANUAL_BY_TOPIC: LivelinessPolicy.MANUAL_BY_TOPIC,
        }.get(qos.liveliness, LivelinessPolicy.UNKNOWN),
        liveliness_lease_duration=Duration(nanoseconds=qos.lease),
    )


def read_qos(pointer: int) -> DdsQos:
    """The policies of a dds_qos_t; those that it does not hold have DDS's default."""
    kind, depth = ctypes.c_int(), ctypes.c_int32()
    nanoseconds = ctypes.c_int64()
    values: dict[str, int] = {}
    if library.get_history(pointer, kind, depth):
        values.update(history=kind.value, depth=depth.value)
    if library.get_reliability(pointer, kind, nanoseconds):
        values.update(reliability=kind.value)
    if library.get_durability(pointer, kind):
        values.update(durability=kind.value)
    if library.get_deadline(pointer, nanoseconds):
        values.update(deadline=nanoseconds.value)
    if library.get_lifespan(pointer, nanoseconds):
        values.update(lifespan=nanoseconds.value)
    if library.get_liveliness(pointer, kind, nanoseconds):
        values.update(liveliness=kind.value, lease=nanoseconds.value)
    return DdsQos(**values)


def read_user_data(pointer: int) -> bytes:
    """The user data of a dds_qos_t, empty where it holds none."""
    data, size = ctypes.c_void_p(), ctypes.c_size_t()
    if not library.get_user_data(pointer, data, size) or not data.value:
        return b''
    try:
        return ctypes.string_at(data.value, size.value)
    finally:
        library.free(data)


@contextmanager
def native_qos(
    qos: DdsQos | None, user_data: bytes = b'', ignore_own_participant: bool = False
) -> Iterator[int]:
    """A dds_qos_t for the duration of a with-block.

    Args:
        qos: The policies of an endpoint; None for a participant, which has none of them.
        user_data: What other processes may read of the entity.
        ignore_own_participant: A reader does not hear writers of its own participant.
    """
    pointer = library.create_qos()
    try:
        if user_data:
            library.set_user_data(pointer, user_data, len(user_data))
        if ignore_own_participant:
            library.set_ignore_local(pointer, _IGNORE_OWN_PARTICIPANT)
        if qos is not None:
            _write_policies(pointer, qos)
        yield pointer
    finally:
        library.delete_qos(pointer)


def _write_policies(pointer: int, qos: DdsQos) -> None:
    library.set_history(pointer, qos.history, qos.depth)
    library.set_reliability(pointer, qos.reliability, library.INFINITE if qos.reliable else 0)
    library.set_durability(pointer, qos.durability)
    if qos.latched:
        library.set_durability_service(
            pointer, 0, qos.history, qos.depth, _UNLIMITED, _UNLIMITED, _UNLIMITED
        )
    library.set_deadline(pointer, qos.deadline)
    library.set_lifespan(pointer, qos.lifespan)
    library.set_liveliness(pointer, qos.liveliness, qos.lease)
    library.set_writer_data_lifecycle(pointer, False)
    # ROS 2 speaks the first version of the encoding alone; a second one would not match.
    first_encoding = (ctypes.c_int16 * 1)(0)
    library.set_data_representation(pointer, 1, first_encoding)


_HISTORY = {'SYSTEM_DEFAULT': _KEEP_LAST, 'KEEP_LAST': _KEEP_LAST, 'KEEP_ALL': _KEEP_ALL}
_RELIABILITY = {
    'SYSTEM_DEFAULT': _RELIABLE,
    'RELIABLE': _RELIABLE,
    'BEST_AVAILABLE': _RELIABLE,
    'BEST_EFFORT': _BEST_EFFORT,
}
_DURABILITY = {
    'SYSTEM_DEFAULT': _VOLATILE,
    'VOLATILE': _VOLATILE,
    'TRANSIENT_LOCAL': _TRANSIENT_LOCAL,
    'BEST_AVAILABLE': _TRANSIENT_LOCAL,
}
_LIVELINESS = {
    'SYSTEM_DEFAULT': _AUTOMATIC,
    'AUTOMATIC': _AUTOMATIC,
    'BEST_AVAILABLE': _AUTOMATIC,
    'MANUAL_BY_TOPIC': _MANUAL_BY_TOPIC,
}


def _choose(policy: str, value: Any, choices: dict[str, int]) -> int:
    if value.name not in choices:
        raise ValueError(
            f'the {policy} policy of a QoS profile must be one of {", ".join(choices)}, '
            f'got {value.name}'
        )
    return choices[value.name]


def _duration(duration: Any) -> int:
    # A duration of zero is ROS's word for 'not said', which is forever.
    nanoseconds = int(duration.nanoseconds)
    return min(nanoseconds, library.INFINITE) if nanoseconds > 0 else library.INFINITE
