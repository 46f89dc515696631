"""Ways to hold the segments of plans, those that were not chosen as well."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import nnls

from cfplan_core import load_problem, plan
from cfplan_core.contact.disturbance import disturbance
from cfplan_core.contact.elements import parse_contact
from cfplan_core.contact.system import ContactSystem
from cfplan_core.execution.feedforward import segment_gradients
from cfplan_core.mechanics.actuation import actuations
from cfplan_core.mechanics.contact_model import Holding
from cfplan_core.trajectory.plan_result import PlanResult, Segment

PROBLEMS = Path(__file__).parents[2] / 'config' / 'problems'


def holding(system: ContactSystem, result: PlanResult, segment: Segment, order: int) -> Holding:
    """A segment to be held by joints of any strength, its contacts in one order or another."""
    segment = replace(segment, contacts=segment.contacts[::order])
    z, gradients = segment_gradients(system, result, segment)
    pairs = np.array([system.pair(parse_contact(name)) for name in segment.contacts])
    limit = np.full((len(z), system.joint_count), 99.0)
    return Holding(gradients, disturbance(system, z, pairs), -limit, limit)


# In h205 the right finger touches at its joint's axis in one frame: its torque is zero there
# whatever the forces.
@pytest.mark.parametrize('name', ['h205', 'h1004', 'goals/on_a_corner'])
@pytest.mark.parametrize('order', [1, -1])
def test_every_way_to_hold_a_segment_balances_the_object_and_the_best_comes_first(
    name: str, order: int
) -> None:
    problem = load_problem(PROBLEMS / f'{name}.yaml')
    result, system = plan(problem), ContactSystem(problem)
    stretches = [holding(system, result, segment, order) for segment in result.segments]
    several = 0
    for stretch, ways in zip(stretches, actuations(stretches, system.load, 5.0), strict=True):
        several += len(ways) > 1
        margins = [way.margin for way in ways]
        assert margins == sorted(margins, reverse=True)
        for way in ways:
            for gradients, torques in zip(stretch.gradients, way.torques, strict=True):
                matrix = np.vstack([gradients[:, :3].T, -gradients[:, 3:].T])
                assert nnls(matrix, np.append(-system.load, torques))[1] < 1e-6
    assert several > 0
