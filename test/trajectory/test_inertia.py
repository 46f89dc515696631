from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planning.scenes import at, pushed_angles, pushed_block

from cfplan_core.contact.system import ContactSystem
from cfplan_core.model import Problem
from cfplan_core.trajectory.inertia import moving_masses


def with_heavy_link(problem: Problem) -> Problem:
    left, right = problem.hand.fingers
    heavy = replace(left, links=(replace(left.links[0], mass=0.2),))
    return replace(problem, hand=replace(problem.hand, fingers=(heavy, right)))


def configurations(system: ContactSystem) -> np.ndarray:
    return np.array([at(system, x, pushed_angles(x)) for x in np.linspace(-0.003, 0.004, 5)])


def test_the_object_may_accelerate_with_a_share_of_gravity() -> None:
    system = ContactSystem(pushed_block())
    z = configurations(system)
    coordinates, limits = moving_masses(system, z, 0.05)
    np.testing.assert_allclose(coordinates[:, :2], z[:, :2] * system.size)
    np.testing.assert_allclose(coordinates[:, 2], z[:, 2])
    np.testing.assert_allclose(limits[:2], 0.05 * 9.81 / np.sqrt(2.0))


def test_a_box_may_turn_with_a_share_of_its_weight_times_its_size() -> None:
    problem = pushed_block()
    system = ContactSystem(problem)
    low, high = problem.object.vertices.min(axis=0), problem.object.vertices.max(axis=0)
    inertia = ((high - low) ** 2).sum() / 12.0
    _, limits = moving_masses(system, configurations(system), 0.05)
    assert limits[2] == pytest.approx(0.05 * 9.81 * system.size / inertia)


def test_links_with_mass_are_among_the_bodies() -> None:
    problem = with_heavy_link(pushed_block())
    system = ContactSystem(problem)
    z = configurations(system)
    coordinates, limits = moving_masses(system, z, 0.05)
    assert coordinates.shape == (5, 6)
    assert limits.shape == (6,)
    # The centroid as the mean of the link's three corners.
    for row, joints in zip(coordinates, z[:, 3:], strict=True):
        corners = problem.hand.world_vertices(joints)['left.link']
        assert len(corners) == 3
        np.testing.assert_allclose(row[3:5], corners.mean(axis=0), atol=1e-12)
    np.testing.assert_allclose(np.diff(coordinates[:, 5]), np.diff(z[:, 3]), atol=1e-12)


def test_without_gravity_one_newton_takes_the_place_of_the_weight() -> None:
    problem = replace(pushed_block(), gravity=(0.0, 0.0))
    system = ContactSystem(problem)
    _, limits = moving_masses(system, configurations(system), 0.05)
    assert limits[0] == pytest.approx(0.05 / problem.object.mass / np.sqrt(2.0))
