from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from planning.scenes import pushed_block

from cfplan_core import PlanOptions, PlanResult, Problem, load_problem, plan
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.system import ContactSystem
from cfplan_core.errors import CfplanError
from cfplan_core.mechanics.contact_model import Actuation, Holding
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.options import TrajectoryOptions
from cfplan_core.trajectory.torque_profile import TorqueProfile

PROBLEMS = Path(__file__).parents[2] / 'config' / 'problems'


@cache
def planned(name: str, squeeze: float = 5.0) -> tuple[Problem, PlanResult]:
    problem = load_problem(PROBLEMS / f'{name}.yaml')
    result = plan(problem, PlanOptions(trajectory=TrajectoryOptions(squeeze=squeeze)))
    assert result.solved
    return problem, result


@pytest.mark.parametrize('name', ['h013', 'h205', 'trinkle_hunter_1991'])
def test_every_nominal_torque_is_inside_its_limits(name: str) -> None:
    _, result = planned(name)
    assert (result.torque_nominal >= result.torque_lower).all()
    assert (result.torque_nominal <= result.torque_upper).all()
    entry = result.entry_nominal
    assert ((entry >= result.entry_lower) & (entry <= result.entry_upper)).all()


def test_at_an_event_the_torques_are_inside_the_limits_of_both_segments_where_these_meet() -> None:
    met = 0
    for name in ('h013', 'h447', 'trinkle_hunter_1991'):
        _, result = planned(name)
        for k, (before, after) in enumerate(pairwise(result.segments), 1):
            frame = after.first_frame
            low = np.maximum(result.torque_lower[frame], result.entry_lower[k])
            high = np.minimum(result.torque_upper[frame], result.entry_upper[k])
            if before.contacts != after.contacts and (high - low > 1e-6).all():
                torque = result.torque_nominal[frame]
                np.testing.assert_allclose(torque, result.entry_nominal[k], atol=1e-12)
                met += bool(((low <= torque) & (torque <= high)).all())
    assert met > 3


def profile_of(*segments: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    """A profile of segments of one joint, each with limits and a nominal torque all along."""

    class Given(FrictionlessModel):
        def actuations(
            self, stretches: Sequence[Holding], squeeze: float
        ) -> tuple[tuple[Actuation, ...], ...]:
            unit = system.force_unit * system.size
            return tuple(
                (Actuation((), np.full((2, 2), nominal / unit), np.inf),)
                for _, nominal, _ in segments
            )

    system = ContactSystem(pushed_block())
    profile = TorqueProfile(system, Given(system.load), 5.0)
    for low, _, high in segments:
        z = np.tile(system.configuration(system.problem.start), (2, 1))
        limits = np.full((2, 2), low), np.full((2, 2), high)
        profile.add(Formation((0, 1, 2, 3)), z, np.zeros((2, 4, 5)), limits)
    joined = profile.joined()
    return joined.torques[:, 0], joined.entries[:, 0]


def test_limits_that_overlap_are_crossed_in_the_middle_of_the_overlap() -> None:
    torques, entries = profile_of((0.0, 0.1, 0.25), (0.15, 0.3, 0.5))
    np.testing.assert_allclose(torques, [0.1, 0.2, 0.3])
    np.testing.assert_allclose(entries, [0.1, 0.2])


def test_limits_that_do_not_meet_are_left_at_their_end() -> None:
    torques, entries = profile_of((0.0, 0.1, 0.15), (0.2, 0.3, 0.5))
    np.testing.assert_allclose(torques, [0.1, 0.15, 0.3])
    np.testing.assert_allclose(entries, [0.1, 0.2])


def test_equal_middles_are_not_changed() -> None:
    torques, _ = profile_of((0.0, 0.1, 0.2), (-0.2, 0.1, 0.4))
    np.testing.assert_allclose(torques, [0.1, 0.1, 0.1])


def test_squeeze_must_be_above_zero() -> None:
    with pytest.raises(CfplanError, match=r'squeeze: got 0\.0, expected weights above zero'):
        TrajectoryOptions(squeeze=0.0)


def test_reversed_plans_keep_nominal_torques_inside_the_limits() -> None:
    back = planned('trinkle_hunter_1991')[1].reversed()
    assert (back.torque_nominal >= back.torque_lower).all()
    assert (back.torque_nominal <= back.torque_upper).all()
    again = back.reversed()
    np.testing.assert_array_equal(
        again.torque_nominal, planned('trinkle_hunter_1991')[1].torque_nominal
    )
