"""Parameters of a study: as they are written, and what they set."""

from __future__ import annotations

import math

import pytest

from cfplan_core import CfplanError, PlanOptions, Preference, TrajectoryOptions, Uncertainty
from cfplan_core.execution.execute import ExecutionOptions
from cfplan_core.study.parameters import (
    PARAMETERS,
    Variation,
    execution_options,
    parse_variation,
    parse_variations,
    plan_options,
)

DEFAULTS = {name: parameter.default for name, parameter in PARAMETERS.items()}


@pytest.mark.parametrize(
    ('text', 'expected'),
    [
        ('friction=0,0.05', Variation('friction', (0.0, 0.05))),
        ('mass-error=0:0.2', Variation('mass-error', (), (0.0, 0.2))),
        ('gain = 20', Variation('gain', (20.0,))),
        ('prefer=first, robust', Variation('prefer', ('first', 'robust'))),
        ('plan-seed=1,2', Variation('plan-seed', (1, 2))),
    ],
)
def test_variation_is_read(text: str, expected: Variation) -> None:
    assert parse_variation(text) == expected


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        ('frction=0', "the parameter 'frction', expected one of prefer, resolution"),
        ('friction', "'friction', expected NAME=VALUE"),
        ('friction=a', "friction: got 'a', expected a number"),
        ('friction=', "friction: got '', expected a number"),
        ('friction=inf', "friction: got 'inf', expected a finite number"),
        ('friction=0.1,0.10', 'friction: got .*, expected each value once'),
        ('friction=0.2:0.1', 'friction: got .*, expected LOW:HIGH with LOW below HIGH'),
        ('friction=0:1:2', 'friction: got .*, expected LOW:HIGH'),
        ('prefer=best', "prefer: got 'best', expected one of first, fewest-segments"),
        ('prefer=first:robust', 'prefer: got the range'),
        ('plan-seed=0:9', 'plan-seed: got the range'),
        ('max-nodes=1.5', "max-nodes: got '1.5', expected a whole number"),
    ],
)
def test_impossible_variation_is_refused(text: str, message: str) -> None:
    with pytest.raises(CfplanError, match=message):
        parse_variation(text)


def test_parameter_that_is_varied_twice_is_refused() -> None:
    with pytest.raises(CfplanError, match='gain: is varied twice'):
        parse_variations(['gain=1', 'friction=0', 'gain=2'])


def test_defaults_are_those_of_planning_and_execution() -> None:
    assert plan_options(DEFAULTS) == PlanOptions()
    assert execution_options(DEFAULTS, 0) == ExecutionOptions()


def test_every_parameter_sets_its_option() -> None:
    plan = {
        **{'prefer': 'robust', 'resolution': 0.1, 'max-needed-force': 3.0, 'max-nodes': 9},
        **{'plan-seed': 4, 'squeeze': 2.0, 'inertia': 0.1, 'event-speed': 0.5},
        'event-distance': 0.2,
    }
    execution = {
        **{'friction': 0.1, 'mass-error': 0.2, 'geometry-error': 0.01, 'joint-noise': 0.5},
        **{'gain': 10.0, 'roles': 'no'},
    }
    assert {*plan, *execution} == set(PARAMETERS)
    trajectory = TrajectoryOptions(2.0, 0.1, 0.2, 0.5)
    assert plan_options({**DEFAULTS, **plan}) == PlanOptions(
        prefer=Preference.ROBUST,
        resolution=0.1,
        max_needed_force=3.0,
        max_nodes=9,
        seed=4,
        trajectory=trajectory,
    )
    uncertainty = Uncertainty(0.1, 0.2, 0.01, math.radians(0.5))
    expected = ExecutionOptions(uncertainty, 7, 10.0, False)
    assert execution_options({**DEFAULTS, **execution}, 7) == expected
