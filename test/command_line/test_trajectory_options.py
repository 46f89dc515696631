from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result

from cfplan_core import PlanResult, read_plan

Cfplan = Callable[..., Result]

PROBLEM = Path(__file__).parents[2] / 'config' / 'problems' / 'h013.yaml'


def planned(cfplan: Cfplan, path: Path, *arguments: str) -> PlanResult:
    assert cfplan('plan', PROBLEM, '--json', path, *arguments).exit_code == 0
    return read_plan(path)


def test_a_smaller_squeeze_gives_smaller_torques(cfplan: Cfplan, tmp_path: Path) -> None:
    given, soft = (
        planned(cfplan, tmp_path / 'plan.json', *arguments)
        for arguments in ((), ('--squeeze', '2'))
    )
    assert np.abs(soft.torque_nominal).max() < 0.7 * np.abs(given.torque_nominal).max()


@pytest.mark.parametrize(
    'arguments', [('--event-speed', '1'), ('--event-distance', '0'), ('--inertia', '0.2')]
)
def test_less_caution_takes_less_time(
    cfplan: Cfplan, tmp_path: Path, arguments: tuple[str, str]
) -> None:
    given = planned(cfplan, tmp_path / 'plan.json')
    hasty = planned(cfplan, tmp_path / 'hasty.json', *arguments)
    assert hasty.times[-1] < given.times[-1]
    np.testing.assert_array_equal(hasty.joints, given.joints)


def test_a_hasty_plan_is_certified_for_the_inertia_that_it_was_planned_with(
    cfplan: Cfplan, tmp_path: Path
) -> None:
    path = tmp_path / 'plan.json'
    planned(cfplan, path, '--inertia', '0.5', '--event-speed', '1')
    assert cfplan('verify', PROBLEM, path).exit_code == 1
    assert cfplan('verify', PROBLEM, path, '--inertia', '0.5').exit_code == 0


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        (('--squeeze', '0'), '0.0 is not a finite number of weights above zero'),
        (('--inertia', '0'), 'inertia: got 0.0, expected a share above zero'),
        (('--event-speed', '1.5'), 'event_speed: got 1.5, expected above 0, at most 1'),
        (('--event-distance', '-1'), 'event_distance: got -1.0, expected rad, not negative'),
    ],
)
def test_what_makes_no_sense_is_refused_by_name(
    cfplan: Cfplan, arguments: tuple[str, str], message: str
) -> None:
    result = cfplan('plan', PROBLEM, *arguments)
    assert result.exit_code == 2
    assert message in ' '.join((result.output + result.stderr).split())


def test_verify_refuses_no_inertia_at_all(cfplan: Cfplan, tmp_path: Path) -> None:
    path = tmp_path / 'plan.json'
    planned(cfplan, path)
    result = cfplan('verify', PROBLEM, path, '--inertia', '-1')
    assert result.exit_code == 2
    assert 'inertia: got -1.0' in ' '.join((result.output + result.stderr).split())
