"""Options of the wrong type or out of range are refused: field, value, what was expected."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cfplan_core import CfplanError, PlanOptions, Preference, TrajectoryOptions

WHOLE = 'a whole number above zero'
FORMATIONS = 'contact formations, each a sequence of at least one name of a contact'
POLYGON = 'at least three corners (x, y) of a convex polygon, counter-clockwise'
JOINTS = 'a sequence of names of joints'
TRIANGLE = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))


@pytest.mark.parametrize(
    ('field', 'value', 'expected'),
    [
        ('time_budget', '5', 'seconds above zero'),
        ('time_budget', 0, 'seconds above zero'),
        ('time_budget', float('nan'), 'seconds above zero'),
        ('max_nodes', '5', WHOLE),
        ('max_nodes', 5.0, WHOLE),
        ('max_nodes', True, WHOLE),
        ('max_contacts', [4], WHOLE),
        ('max_contacts', 0, WHOLE),
        ('alternatives', None, WHOLE),
        ('alternatives', 0, WHOLE),
        ('resolution', None, '0.001 to 1 rad'),
        ('resolution', 2.0, '0.001 to 1 rad'),
        ('max_needed_force', '2', 'weights above zero'),
        ('max_needed_force', float('inf'), 'weights above zero'),
        ('forbidden', 'object.v0|palm.0.e0', FORMATIONS),
        ('forbidden', ('object.v0|palm.0.e0',), FORMATIONS),
        ('forbidden', ((),), FORMATIONS),
        ('required', ((1,),), FORMATIONS),
        ('required', None, FORMATIONS),
        ('held_joints', 'left_joint', JOINTS),
        ('held_joints', (0,), JOINTS),
        ('held_joints', None, JOINTS),
        ('stay_within', 1.0, POLYGON),
        ('stay_within', 'box', POLYGON),
        ('stay_within', ((0.0, 0.0), (1.0, 0.0), ('0', 1.0)), POLYGON),
        ('stay_within', TRIANGLE[:2], POLYGON),
        ('stay_within', TRIANGLE[::-1], POLYGON),
        ('second_order', 'no', 'True or False'),
        ('prefer', 'best', 'one of first, fewest-segments, shortest, robust'),
        ('prefer', None, 'one of first, fewest-segments, shortest, robust'),
        ('prefer', ['robust'], 'one of first, fewest-segments, shortest, robust'),
        ('trajectory', {'squeeze': 2.0}, 'TrajectoryOptions'),
        ('seed', 1.5, 'a whole number from 0 to 2³² − 1'),
        ('seed', -1, 'a whole number from 0 to 2³² − 1'),
    ],
)
def test_wrong_option_is_named_with_value_and_what_was_expected(
    field: str, value: Any, expected: str
) -> None:
    with pytest.raises(CfplanError) as refusal:
        PlanOptions(**{field: value})
    shown = value if isinstance(value, int | float) else repr(value)
    assert str(refusal.value) == f'{field}: got {shown}, expected {expected}'


@pytest.mark.parametrize('field', ['squeeze', 'inertia', 'event_distance', 'event_speed'])
@pytest.mark.parametrize('value', ['1', None, -1.0, float('nan')])
def test_wrong_option_of_a_trajectory_is_named(field: str, value: Any) -> None:
    with pytest.raises(CfplanError, match=f'^{field}: got .*, expected '):
        TrajectoryOptions(**{field: value})


def test_numbers_of_numpy_lists_and_names_of_preferences_are_taken() -> None:
    wanted: dict[str, Any] = {
        'max_nodes': np.int64(5),
        'resolution': np.float64(0.1),
        'time_budget': np.float32(2.0),
        'held_joints': ['left_joint'],
        'forbidden': [['object.v0|palm.0.e0']],
        'stay_within': [list(corner) for corner in TRIANGLE],
        'prefer': 'robust',
    }
    options = PlanOptions(**wanted)
    assert options.prefer is Preference.ROBUST
    assert options.max_nodes == 5
