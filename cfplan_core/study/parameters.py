"""What a study may vary: the names, how values of each are written, and what they set."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from cfplan_core.errors import CfplanError
from cfplan_core.execution.execute import ExecutionOptions
from cfplan_core.execution.perturbation import Uncertainty
from cfplan_core.options import PlanOptions, Preference, TrajectoryOptions

Value = float | int | str | None
"""Of a parameter; None leaves it to the planner or the executor."""

NO, YES = 'no', 'yes'


@dataclass(frozen=True)
class Parameter:
    """One thing that a study may vary.

    Attributes:
        name: As it is written.
        default: Its value where it is not varied.
        meaning: With its unit.
        number: Type of its values if they are numbers.
        choices: Its values if they are not.
    """

    name: str
    default: Value
    meaning: str
    number: type[float] | type[int] = float
    choices: tuple[str, ...] = ()

    def value(self, text: str) -> Value:
        """Read a value.

        Raises:
            CfplanError: It is none of this parameter.
        """
        text = text.strip()
        if self.choices:
            if text not in self.choices:
                raise self._refusal(text, f'one of {", ".join(self.choices)}')
            return text
        try:
            value = self.number(text)
        except ValueError:
            kind = 'a whole number' if self.number is int else 'a number'
            raise self._refusal(text, kind) from None
        if not math.isfinite(value):
            raise self._refusal(text, 'a finite number')
        return value

    def _refusal(self, text: str, expected: str) -> CfplanError:
        return CfplanError(f'{self.name}: got {text!r}, expected {expected}')


_CHOICES = tuple(choice.value for choice in Preference)
_ALL = (
    Parameter('prefer', Preference.FIRST.value, 'which plan to choose', choices=_CHOICES),
    Parameter('resolution', PlanOptions().resolution, 'spacing of the grid of joint angles, rad'),
    Parameter('max-needed-force', None, 'most force that contacts may need, weights'),
    Parameter('max-nodes', None, 'budget of nodes of both trees', number=int),
    Parameter('plan-seed', 0, 'of the search, for hands of more than two joints', number=int),
    Parameter('squeeze', TrajectoryOptions().squeeze, 'force of nominal torques, weights'),
    Parameter('inertia', TrajectoryOptions().inertia, 'inertial forces as a share of the weight'),
    Parameter('event-speed', TrajectoryOptions().event_speed, 'share of speed near events'),
    Parameter('event-distance', TrajectoryOptions().event_distance, 'how near that is, rad'),
    Parameter('friction', 0.0, 'Coulomb coefficient of every contact'),
    Parameter('mass-error', 0.0, "of the object's mass, as a part of it"),
    Parameter('geometry-error', 0.0, 'of vertices, in sizes of the object'),
    Parameter('joint-noise', 0.0, "of each joint's zero, degrees"),
    Parameter('gain', None, 'stiffness of joints held in position, N·m/rad'),
    Parameter('roles', YES, 'whether joints are controlled as the plan says', choices=(NO, YES)),
)

PARAMETERS: Mapping[str, Parameter] = MappingProxyType({entry.name: entry for entry in _ALL})
"""By name, in the order of a study's columns."""


@dataclass(frozen=True)
class Variation:
    """What values a parameter takes in a study.

    Attributes:
        name: Of the parameter.
        values: A list of them, or none where there is a range.
        bounds: Lower and upper end of a range to draw from.
    """

    name: str
    values: tuple[Value, ...] = ()
    bounds: tuple[float, float] | None = None


def parse_variation(text: str) -> Variation:
    """Read ``NAME=VALUE[,VALUE...]`` or ``NAME=LOW:HIGH``.

    Raises:
        CfplanError: The name is unknown, or the values are none of this parameter.
    """
    name, equals, values = text.partition('=')
    name = name.strip()
    if not equals:
        raise CfplanError(f'got {text!r}, expected NAME=VALUE[,VALUE...] or NAME=LOW:HIGH')
    parameter = known_parameter(name)
    if ':' not in values:
        read = tuple(parameter.value(part) for part in values.split(','))
        if len(set(read)) < len(read):
            raise CfplanError(f'{name}: got {values!r}, expected each value once')
        return Variation(name, read)
    if parameter.choices or parameter.number is int:
        raise CfplanError(f'{name}: got the range {values!r}, expected values with commas between')
    ends = [parameter.value(part) for part in values.split(':')]
    if len(ends) != 2 or not float(ends[0] or 0.0) < float(ends[1] or 0.0):
        raise CfplanError(f'{name}: got {values!r}, expected LOW:HIGH with LOW below HIGH')
    return Variation(name, bounds=(float(ends[0] or 0.0), float(ends[1] or 0.0)))


def parse_variations(texts: Iterable[str]) -> tuple[Variation, ...]:
    """Read variations, each of another parameter, into the order of `PARAMETERS`.

    Raises:
        CfplanError: One is wrong, or a parameter is varied twice.
    """
    read: dict[str, Variation] = {}
    for text in texts:
        variation = parse_variation(text)
        if variation.name in read:
            raise CfplanError(f'{variation.name}: is varied twice, expected once')
        read[variation.name] = variation
    return tuple(read[name] for name in PARAMETERS if name in read)


def known_parameter(name: str) -> Parameter:
    """Look a parameter up.

    Raises:
        CfplanError: There is none of this name.
    """
    if name not in PARAMETERS:
        raise CfplanError(f'got the parameter {name!r}, expected one of {", ".join(PARAMETERS)}')
    return PARAMETERS[name]


def plan_options(values: Mapping[str, Value]) -> PlanOptions:
    """Take from the values of all parameters what planning needs.

    Raises:
        CfplanError: A value is not possible.
    """
    names = ('prefer', 'resolution', 'max-needed-force', 'max-nodes')
    wanted: dict[str, Any] = {_field(name): values[name] for name in names}
    timing = ('squeeze', 'inertia', 'event-speed', 'event-distance')
    trajectory: dict[str, Any] = {_field(name): values[name] for name in timing}
    seed: Any = values['plan-seed']
    return PlanOptions(**wanted, seed=seed, trajectory=TrajectoryOptions(**trajectory))


def execution_options(values: Mapping[str, Value], seed: int) -> ExecutionOptions:
    """Take from the values of all parameters what execution needs.

    Args:
        values: By name.
        seed: Of the errors that are drawn.

    Raises:
        CfplanError: A value is not possible.
    """
    names = ('friction', 'mass-error', 'geometry-error')
    errors: dict[str, Any] = {_field(name): values[name] for name in names}
    noise = math.radians(float(values['joint-noise'] or 0.0))
    gain: Any = values['gain']
    uncertainty = Uncertainty(**errors, joint_noise=noise)
    return ExecutionOptions(uncertainty, seed, gain, values['roles'] == YES)


def _field(name: str) -> str:
    return name.replace('-', '_')
