from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cfplan_core import CfplanError, ManipulatedObject, Problem
from cfplan_core.execution.perturbation import Uncertainty, draw


def _draws(problem: Problem, uncertainty: Uncertainty, count: int = 200) -> list:
    return [draw(problem, uncertainty, np.random.default_rng(k)) for k in range(count)]


def test_world_without_uncertainty_is_the_planned_one(problem: Problem) -> None:
    world = draw(problem, Uncertainty(), np.random.default_rng(0))
    assert world.problem.object.mass == problem.object.mass
    assert np.array_equal(world.problem.object.vertices, problem.object.vertices)
    assert not world.joint_errors.any()
    assert world.friction == 0.0


def test_mass_spreads_evenly_up_to_its_error(problem: Problem) -> None:
    masses = [w.problem.object.mass / 0.1 for w in _draws(problem, Uncertainty(mass_error=0.2))]
    assert min(masses) >= 0.8
    assert max(masses) <= 1.2
    assert np.mean(masses) == pytest.approx(1.0, abs=0.03)
    assert np.std(masses) == pytest.approx(0.2 / np.sqrt(3.0), rel=0.15)


def test_vertices_of_object_and_links_move_up_to_their_error(problem: Problem) -> None:
    reach = 0.01 * problem.object.size
    moved = []
    for world in _draws(problem, Uncertainty(geometry_error=0.01), 50):
        shift = world.problem.object.vertices - problem.object.vertices
        moved.append(np.abs(shift).max())
        for finger, planned in zip(world.problem.hand.fingers, problem.hand.fingers, strict=True):
            moved.append(np.abs(finger.links[0].vertices - planned.links[0].vertices).max())
            assert finger.links[0].length == planned.links[0].length
    assert 0.9 * reach < max(moved) <= reach
    assert min(moved) > 0.0


def test_centre_of_mass_stays_where_it_is(problem: Problem) -> None:
    world = draw(problem, Uncertainty(geometry_error=0.01), np.random.default_rng(0))
    assert np.array_equal(world.problem.object.center_of_mass, problem.object.center_of_mass)


def test_joint_errors_stay_within_the_noise(problem: Problem) -> None:
    errors = np.array([w.joint_errors for w in _draws(problem, Uncertainty(joint_noise=0.01))])
    assert 0.009 < np.abs(errors).max() <= 0.01


def test_outline_that_does_not_stay_convex_is_refused(problem: Problem) -> None:
    turns = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    wheel = ManipulatedObject(0.03 * np.stack([np.cos(turns), np.sin(turns)], axis=1), 0.1)
    with pytest.raises(CfplanError, match='do not stay polygons with the same convex corners'):
        draw(
            replace(problem, object=wheel),
            Uncertainty(geometry_error=0.2),
            np.random.default_rng(0),
        )


@pytest.mark.parametrize(
    ('errors', 'message'),
    [
        ({'friction': -0.1}, 'friction: got -0.1, expected 0 to 10'),
        ({'mass_error': 1.0}, 'mass_error: got 1.0, expected 0 to 0.99'),
        ({'geometry_error': float('nan')}, 'geometry_error: got nan'),
        ({'joint_noise': 4.0}, 'joint_noise: got 4.0, expected 0 to 1'),
    ],
)
def test_impossible_uncertainty_is_refused(errors: dict[str, float], message: str) -> None:
    with pytest.raises(CfplanError, match=message):
        Uncertainty(**errors)
