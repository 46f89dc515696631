"""Quality of service: a profile of policies, ROS's presets and who can talk to whom."""

from __future__ import annotations

import warnings
from enum import Enum
from typing import Any

from rclpy._qos_compatibility import QoSCompatibility, qos_check_compatible
from rclpy._qos_policies import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSDurabilityPolicy,
    QoSHistoryPolicy,
    QoSLivelinessPolicy,
    QoSPolicyEnum,
    QoSPolicyKind,
    QoSReliabilityPolicy,
    ReliabilityPolicy,
    qos_policy_name_from_kind,
)
from rclpy.duration import Duration, Infinite

__all__ = [
    'DurabilityPolicy',
    'HistoryPolicy',
    'InvalidQoSProfileException',
    'LivelinessPolicy',
    'QoSCompatibility',
    'QoSDurabilityPolicy',
    'QoSHistoryPolicy',
    'QoSLivelinessPolicy',
    'QoSPolicyEnum',
    'QoSPolicyKind',
    'QoSPresetProfiles',
    'QoSProfile',
    'QoSReliabilityPolicy',
    'ReliabilityPolicy',
    'qos_check_compatible',
    'qos_policy_name_from_kind',
    'qos_profile_action_status_default',
    'qos_profile_best_available',
    'qos_profile_default',
    'qos_profile_parameter_events',
    'qos_profile_parameters',
    'qos_profile_rosout_default',
    'qos_profile_sensor_data',
    'qos_profile_services_default',
    'qos_profile_system_default',
    'qos_profile_unknown',
]


_UNSPECIFIED = Duration()
_DURATION_BEST_AVAILABLE = Duration(nanoseconds=Infinite.nanoseconds - 1)


class InvalidQoSProfileException(Exception):
    """A profile was made from arguments that do not go together."""

    def __init__(self, *args: object) -> None:
        super().__init__('Invalid QoSProfile', *args)


class QoSProfile:
    """The quality-of-service policies of one publisher, subscription, service or client.

    Args:
        **kwargs: `history`, `depth`, `reliability`, `durability`, `lifespan`, `deadline`,
            `liveliness`, `liveliness_lease_duration`, `avoid_ros_namespace_conventions`. History
            or depth must be given; a depth alone means KEEP_LAST. What is not given is ROS's
            default: reliable, volatile, no limits.

    Raises:
        InvalidQoSProfileException: Neither history nor depth, or KEEP_LAST without a depth.
        AssertionError: An unknown name, or a value of another type.
    """

    __slots__ = (
        '_avoid_ros_namespace_conventions',
        '_deadline',
        '_depth',
        '_durability',
        '_history',
        '_lifespan',
        '_liveliness',
        '_liveliness_lease_duration',
        '_reliability',
    )

    def __init__(self, **kwargs: Any) -> None:
        assert all(key in _POLICY_NAMES for key in kwargs), (
            f'Invalid arguments passed to constructor: {kwargs.keys()!r}'
        )
        if 'history' not in kwargs:
            if 'depth' not in kwargs:
                raise InvalidQoSProfileException('History and/or depth settings are required.')
            kwargs['history'] = HistoryPolicy.KEEP_LAST
        self.history = kwargs['history']
        if self.history == HistoryPolicy.KEEP_LAST and 'depth' not in kwargs:
            raise InvalidQoSProfileException('History set to KEEP_LAST without a depth setting.')
        self.depth = kwargs.get('depth', 10)
        self.reliability = kwargs.get('reliability', ReliabilityPolicy.RELIABLE)
        self.durability = kwargs.get('durability', DurabilityPolicy.VOLATILE)
        self.lifespan = kwargs.get('lifespan', _UNSPECIFIED)
        self.deadline = kwargs.get('deadline', _UNSPECIFIED)
        self.liveliness = kwargs.get('liveliness', LivelinessPolicy.SYSTEM_DEFAULT)
        self.liveliness_lease_duration = kwargs.get('liveliness_lease_duration', _UNSPECIFIED)
        self.avoid_ros_namespace_conventions = kwargs.get('avoid_ros_namespace_conventions', False)

    @property
    def history(self) -> HistoryPolicy:
        """How many samples are kept."""
        return self._history

    @history.setter
    def history(self, value: HistoryPolicy | int) -> None:
        assert isinstance(value, int)
        self._history = HistoryPolicy(value)

    @property
    def depth(self) -> int:
        """How many samples KEEP_LAST keeps."""
        return self._depth

    @depth.setter
    def depth(self, value: int) -> None:
        assert isinstance(value, int)
        if self.history == HistoryPolicy.KEEP_LAST and value == 0:
            warnings.warn(
                "A zero depth with KEEP_LAST doesn't make sense; no data could be stored. "
                'This will be interpreted as SYSTEM_DEFAULT',
                stacklevel=2,
            )
        self._depth = value

    @property
    def reliability(self) -> ReliabilityPolicy:
        """Whether lost samples are sent again."""
        return self._reliability

    @reliability.setter
    def reliability(self, value: ReliabilityPolicy | int) -> None:
        assert isinstance(value, int)
        self._reliability = ReliabilityPolicy(value)

    @property
    def durability(self) -> DurabilityPolicy:
        """Whether late subscribers get earlier samples."""
        return self._durability

    @durability.setter
    def durability(self, value: DurabilityPolicy | int) -> None:
        assert isinstance(value, int)
        self._durability = DurabilityPolicy(value)

    @property
    def lifespan(self) -> Duration:
        """How long a sample is worth delivering; zero means for ever."""
        return self._lifespan

    @lifespan.setter
    def lifespan(self, value: Duration) -> None:
        assert isinstance(value, Duration)
        self._lifespan = value

    @property
    def deadline(self) -> Duration:
        """The longest time promised or accepted between samples; zero means none."""
        return self._deadline

    @deadline.setter
    def deadline(self, value: Duration) -> None:
        assert isinstance(value, Duration)
        self._deadline = value

    @property
    def liveliness(self) -> LivelinessPolicy:
        """Who says that a publisher lives."""
        return self._liveliness

    @liveliness.setter
    def liveliness(self, value: LivelinessPolicy | int) -> None:
        assert isinstance(value, int)
        self._liveliness = LivelinessPolicy(value)

    @property
    def liveliness_lease_duration(self) -> Duration:
        """How long a silent publisher still counts as alive; zero means for ever."""
        return self._liveliness_lease_duration

    @liveliness_lease_duration.setter
    def liveliness_lease_duration(self, value: Duration) -> None:
        assert isinstance(value, Duration)
        self._liveliness_lease_duration = value

    @property
    def avoid_ros_namespace_conventions(self) -> bool:
        """Whether the topic goes on the wire under its own name, without ROS's prefix."""
        return self._avoid_ros_namespace_conventions

    @avoid_ros_namespace_conventions.setter
    def avoid_ros_namespace_conventions(self, value: bool) -> None:
        assert isinstance(value, bool)
        self._avoid_ros_namespace_conventions = value

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, QoSProfile):
            return False
        return all(getattr(self, name) == getattr(other, name) for name in _POLICY_NAMES)

    # A profile can be changed, so it has no hash, as in rclpy.
    __hash__ = None  # type: ignore[assignment]

    def __str__(self) -> str:
        policies = ', '.join(f'{name}={getattr(self, name)}' for name in _POLICY_NAMES)
        return f'{type(self).__name__}({policies})'


_POLICY_NAMES = (
    'history',
    'depth',
    'reliability',
    'durability',
    'lifespan',
    'deadline',
    'liveliness',
    'liveliness_lease_duration',
    'avoid_ros_namespace_conventions',
)


def _preset(
    history: HistoryPolicy,
    depth: int,
    reliability: ReliabilityPolicy,
    durability: DurabilityPolicy,
    **others: Any,
) -> QoSProfile:
    return QoSProfile(
        history=history, depth=depth, reliability=reliability, durability=durability, **others
    )


def _volatile(depth: int, reliability: ReliabilityPolicy) -> QoSProfile:
    return _preset(HistoryPolicy.KEEP_LAST, depth, reliability, DurabilityPolicy.VOLATILE)


qos_profile_unknown = _preset(
    HistoryPolicy.UNKNOWN,
    0,
    ReliabilityPolicy.UNKNOWN,
    DurabilityPolicy.UNKNOWN,
    liveliness=LivelinessPolicy.UNKNOWN,
)
qos_profile_default = _volatile(10, ReliabilityPolicy.RELIABLE)
qos_profile_system_default = _preset(
    HistoryPolicy.SYSTEM_DEFAULT,
    0,
    ReliabilityPolicy.SYSTEM_DEFAULT,
    DurabilityPolicy.SYSTEM_DEFAULT,
)
qos_profile_sensor_data = _volatile(5, ReliabilityPolicy.BEST_EFFORT)
qos_profile_services_default = _volatile(10, ReliabilityPolicy.RELIABLE)
qos_profile_parameters = _volatile(1000, ReliabilityPolicy.RELIABLE)
qos_profile_parameter_events = _volatile(1000, ReliabilityPolicy.RELIABLE)
qos_profile_rosout_default = _preset(
    HistoryPolicy.KEEP_LAST,
    1000,
    ReliabilityPolicy.RELIABLE,
    DurabilityPolicy.TRANSIENT_LOCAL,
    lifespan=Duration(seconds=10),
)
qos_profile_best_available = _preset(
    HistoryPolicy.KEEP_LAST,
    10,
    ReliabilityPolicy.BEST_AVAILABLE,
    DurabilityPolicy.BEST_AVAILABLE,
    deadline=_DURATION_BEST_AVAILABLE,
    liveliness=LivelinessPolicy.BEST_AVAILABLE,
    liveliness_lease_duration=_DURATION_BEST_AVAILABLE,
)
qos_profile_action_status_default = _preset(
    HistoryPolicy.KEEP_LAST, 1, ReliabilityPolicy.RELIABLE, DurabilityPolicy.TRANSIENT_LOCAL
)


class QoSPresetProfiles(Enum):
    """ROS's presets by name."""

    UNKNOWN = qos_profile_unknown
    DEFAULT = qos_profile_default
    SYSTEM_DEFAULT = qos_profile_system_default
    SENSOR_DATA = qos_profile_sensor_data
    SERVICES_DEFAULT = qos_profile_services_default
    PARAMETERS = qos_profile_parameters
    PARAMETER_EVENTS = qos_profile_parameter_events
    ACTION_STATUS_DEFAULT = qos_profile_action_status_default
    BEST_AVAILABLE = qos_profile_best_available

    @classmethod
    def short_keys(cls) -> list[str]:
        """All presets in their short, lower-case form."""
        return [name.lower() for name in cls.__members__]

    @classmethod
    def get_from_short_key(cls, name: str) -> QoSProfile:
        """The profile of a short form, in any case; KeyError for another name."""
        return cls[name.upper()].value
