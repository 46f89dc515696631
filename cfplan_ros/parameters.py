"""The node's parameters: one table, from which they are declared, checked and read."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor

from cfplan_core.errors import CfplanError
from cfplan_core.options import RESOLUTION, Preference
from cfplan_ros.conversions.hands import load_hand, load_object
from cfplan_ros.conversions.requests import Setup
from cfplan_ros.visualization.frames import OBJECT_FRAME, WORLD_FRAME, base_frame, link_frame

if TYPE_CHECKING:
    from rclpy.node import Node

Value = str | bool | int | float | tuple[float, ...]


class ParameterError(CfplanError):
    """Values of parameters that cannot work, each named with what was expected."""


@dataclass(frozen=True)
class Row:
    """One parameter.

    Attributes:
        name: As in ``ros2 param``; the attribute of `Settings` has ``_`` for each dot.
        default: Its type is the parameter's.
        description: One sentence with the unit.
        range: Smallest and largest value of a number, or None.
    """

    name: str
    default: Value
    description: str
    range: tuple[float, float] | None = None

    @property
    def attribute(self) -> str:
        """Name of the attribute of `Settings`."""
        return self.name.replace('.', '_')

    def descriptor(self) -> ParameterDescriptor:
        """Describe the parameter to ``ros2 param describe`` and to rclpy's own checks."""
        descriptor = ParameterDescriptor(name=self.name, description=self.description)
        if self.range is None:
            return descriptor
        low, high = self.range
        if isinstance(self.default, float):
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=low, to_value=high, step=0.0)
            ]
        else:
            descriptor.integer_range = [
                IntegerRange(from_value=int(low), to_value=int(high), step=1)
            ]
        return descriptor


TABLE = (
    Row(
        'hand_file',
        '',
        'The hand: a YAML file with a hand or a whole problem. A path, relative ones from the '
        "working directory, or the name of a file in the package's config directory. "
        'Empty: none, and every request is answered with NOT_CONFIGURED.',
    ),
    Row(
        'object_file',
        '',
        'The object of requests that bring none: a YAML file with an object or a whole problem, '
        'found as hand_file is. Empty: every request must bring its object.',
    ),
    Row(
        'gravity',
        (0.0, -9.81),
        'Acceleration of gravity, x and y in the planner frame [m/s^2], of requests that bring '
        'none.',
    ),
    Row(
        'frame_id',
        WORLD_FRAME,
        "The planner frame: the hand's plane, x right, y up, z out of it.",
    ),
    Row(
        'default_time_budget',
        10.0,
        'Time after which a search gives up [s], of requests that give none.',
        (0.001, 86400.0),
    ),
    Row(
        'maximal_time_budget',
        60.0,
        'Largest time budget [s]; requests that ask for more get this.',
        (0.001, 86400.0),
    ),
    Row(
        'default_preference',
        'first',
        'Which plan to choose for requests that do not say: first, fewest-segments, shortest or '
        'robust.',
    ),
    Row(
        'default_resolution',
        RESOLUTION,
        'Spacing of the grid of joint angles that contact formations are explored over [rad], of '
        'requests that give none.',
        (0.001, 1.0),
    ),
    Row(
        'queue_length',
        10,
        'Requests kept waiting while a plan is computed; one more is answered with BUSY. '
        'Zero: BUSY while any plan is computed.',
        (0, 10000),
    ),
    Row(
        'publish',
        True,
        'Publish the trajectory and the torque limits of each plan, so that a controller moves '
        'the hand. The plan and its markers are published in any case.',
    ),
    Row('record', True, 'Write every run into an MCAP file.'),
    Row(
        'record_directory',
        'runs',
        'Where the runs are written; created if missing. Relative paths start at the working '
        'directory.',
    ),
    Row(
        'disk_space_warning',
        500.0,
        'Diagnostics warn when less than this is free in the record directory [MB].',
        (0.0, 1e9),
    ),
    Row(
        'preview.speed',
        1.0,
        'How many times faster than in reality ~/play plays a plan.',
        (0.01, 100.0),
    ),
)


@dataclass(frozen=True)
class Settings:
    """Values of all parameters; see `TABLE` for their meaning."""

    hand_file: str
    object_file: str
    gravity: tuple[float, ...]
    frame_id: str
    default_time_budget: float
    maximal_time_budget: float
    default_preference: str
    default_resolution: float
    queue_length: int
    publish: bool
    record: bool
    record_directory: str
    disk_space_warning: float
    preview_speed: float

    def changed(self, values: Mapping[str, Any]) -> Settings:
        """Return settings with other values, by parameter name; foreign names are left out."""
        new = {row.attribute: _value(row, values[row.name]) for row in TABLE if row.name in values}
        return Settings(**{**{f.name: getattr(self, f.name) for f in fields(self)}, **new})


DEFAULTS = Settings(**{row.attribute: row.default for row in TABLE})  # type: ignore[arg-type]


@dataclass(frozen=True, eq=False)
class Configuration:
    """Settings that work, with what they name.

    Attributes:
        settings: The values.
        hand: As a problem file has it under ``hand``; None without one.
        object: As a problem file has it under ``object``; None without one.
    """

    settings: Settings
    hand: dict[str, Any] | None
    object: dict[str, Any] | None

    @cached_property
    def setup(self) -> Setup:
        """What the planner brings to every request."""
        settings = self.settings
        return Setup(
            hand=self.hand,
            object=self.object,
            gravity=(settings.gravity[0], settings.gravity[1]),
            frame_id=settings.frame_id,
            default_time_budget=settings.default_time_budget,
            maximal_time_budget=settings.maximal_time_budget,
            default_preference=settings.default_preference,
            default_resolution=settings.default_resolution,
        )


def declare(node: Node) -> Settings:
    """Declare every parameter and return the values that the node was started with.

    Raises:
        rclpy.exceptions.ParameterException: A value of another type or out of its range.
    """
    for row in TABLE:
        default = list(row.default) if isinstance(row.default, tuple) else row.default
        node.declare_parameter(row.name, default, row.descriptor())
    return DEFAULTS.changed({row.name: node.get_parameter(row.name).value for row in TABLE})


def configure(
    settings: Settings,
    before: Configuration | None = None,
    named: Collection[str] | None = None,
) -> Configuration:
    """Check settings together and load the files that they name.

    Args:
        settings: Of the right types and in their ranges.
        before: What is in force, if anything is.
        named: Parameters that were set, also to what they were: their files are loaded anew and
            their directory is tried. None at the start, where a record directory that cannot be
            written is left to the recorder to report: a planner starts also where it cannot
            record.

    Raises:
        ParameterError: With everything that is wrong, by parameter.
    """
    faults = list(_faults_of_values(settings))
    if named is not None and settings.record and {'record', 'record_directory'} & set(named):
        faults += _faults_of_directory(settings.record_directory)
    parts: dict[str, dict[str, Any] | None] = {
        'hand_file': before.hand if before else None,
        'object_file': before.object if before else None,
    }
    for name, load in (('hand_file', load_hand), ('object_file', load_object)):
        if named is None or name in named:
            file = getattr(settings, name)
            try:
                parts[name] = load(found(file)) if file else None
            except CfplanError as error:
                faults.append(f'{name}: {error}')
    if settings.frame_id in _frames(parts['hand_file']):
        faults.append(
            f'frame_id: got {settings.frame_id!r}, expected a name that no link or object has'
        )
    if faults:
        raise ParameterError('\n'.join(faults))
    return Configuration(settings, parts['hand_file'], parts['object_file'])


def found(name: str) -> Path:
    """Return the file of a name: a path, or else a file in the package's config directory.

    Raises:
        CfplanError: There is no such file.
    """
    paths = [directory / name for directory in (Path(), *_config_directories())]
    for path in paths:
        try:
            if path.exists():
                return path
        except OSError as error:
            raise CfplanError(f'got {name!r}, expected a file: {error.strerror}') from None
    looked = ' or '.join(dict.fromkeys(str(path.absolute()) for path in paths))
    raise CfplanError(f'got {name!r}, expected a file, {looked}')


def _config_directories() -> Iterable[Path]:
    try:
        yield Path(get_package_share_directory('cfplan_ros'), 'config')
    except PackageNotFoundError:
        # Not installed as a ROS package: config/ is beside this one in the source tree.
        yield Path(__file__).resolve().parents[1] / 'config'


def _frames(hand: dict[str, Any] | None) -> set[str]:
    """Frames that lie in the planner frame, by the hand as a problem file has it."""
    fingers = hand['fingers'] if hand else []
    links = {link_frame(f['name'], link['name']) for f in fingers for link in f['links']}
    return {OBJECT_FRAME, *(base_frame(f['name']) for f in fingers), *links}


def _value(row: Row, value: Any) -> Value:
    return tuple(float(v) for v in value) if isinstance(row.default, tuple) else value


def _faults_of_values(settings: Settings) -> Iterable[str]:
    gravity = settings.gravity
    if len(gravity) != 2 or not all(map(math.isfinite, gravity)):
        yield f'gravity: got {list(gravity)}, expected two finite numbers, m/s^2'
    name = settings.frame_id
    if not name or name.startswith('/') or any(c.isspace() for c in name):
        yield f'frame_id: got {name!r}, expected a name without blanks or a leading slash'
    if settings.default_time_budget > settings.maximal_time_budget:
        yield (
            f'default_time_budget: got {settings.default_time_budget:g} s, expected at most '
            f'maximal_time_budget, {settings.maximal_time_budget:g} s'
        )
    choices = [choice.value for choice in Preference]
    if settings.default_preference not in choices:
        yield (
            f'default_preference: got {settings.default_preference!r}, expected one of '
            f'{", ".join(choices)}'
        )
    if '\0' in settings.record_directory:
        yield 'record_directory: got a null byte, expected a path'
    if not settings.record_directory:
        yield "record_directory: got '', expected a path; to record nothing set record to false"


def _faults_of_directory(directory: str) -> Iterable[str]:
    try:
        Path(directory).mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=directory):
            pass
    except (OSError, ValueError) as error:
        reason = getattr(error, 'strerror', None) or str(error)
        yield f'record_directory: got {directory!r}, expected a directory to write in: {reason}'
