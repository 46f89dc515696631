from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from cfplan_core import load_problem
from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.geometry.separation import penetration_depth
from cfplan_core.planning.clearance import Clearance

PATH = (
    Path(__file__).parents[2]
    / 'config'
    / 'problems'
    / 'many_joints'
    / 'four_fingers_five_joints.yaml'
)


@cache
def system() -> ContactSystem:
    return ContactSystem(load_problem(PATH))


def drawn(seed: int, count: int = 12) -> FloatArray:
    rng = np.random.default_rng(seed)
    z = np.tile(system().configuration(system().problem.start), (count, 1))
    z[:, :3] += rng.normal(size=(count, 3)) * 0.3
    z[:, 3:] = rng.uniform(system().lower, system().upper, (count, system().joint_count))
    return z


def outline(z: FloatArray, body: int) -> FloatArray:
    vertices = system().place(z[None]).vertices[0, system().body_of == body]
    return np.stack([vertices.real, vertices.imag], axis=1)


def distance(a: FloatArray, b: FloatArray) -> float:
    """Distance of convex polygons that are apart: of a vertex of one from an edge of the other."""
    least = np.inf
    for points, others in ((a, b), (b, a)):
        edge = np.roll(others, -1, axis=0) - others
        offset = points[:, None] - others
        place = np.clip((offset * edge).sum(axis=-1) / (edge**2).sum(axis=-1), 0.0, 1.0)
        away = np.linalg.norm(offset - place[..., None] * edge, axis=-1)
        least = min(least, float(away.min()))
    return least


@pytest.mark.parametrize('seed', range(3))
def test_bound_is_negative_where_bodies_overlap_and_else_at_most_their_distance(
    seed: int,
) -> None:
    clearance = Clearance(system(), np.arange(5, 10))
    z = drawn(seed, 30)
    overlapping = 0
    for row, point in zip(clearance.distances(z), z, strict=True):
        for bound, (one, two) in zip(row, clearance.bodies, strict=True):
            a, b = outline(point, one), outline(point, two)
            overlap = penetration_depth(a, b) > 1e-9
            overlapping += overlap
            assert (bound < 0.0) == overlap
            assert overlap or bound <= distance(a, b) + 1e-9
    assert overlapping > 5


def test_bodies_alone_are_those_of_the_finger_the_object_and_the_palm() -> None:
    names = system().body_names
    clearance = Clearance(system(), np.arange(5, 10), alone=True)
    seen = {names[k] for k in clearance.bodies.ravel()}
    assert seen == {'object', 'palm.0', *(f'high_left.link_{k}' for k in range(1, 6))}


def test_two_fingers_are_looked_at_without_anything_else() -> None:
    names = system().body_names
    clearance = Clearance(system(), np.arange(5), np.arange(5, 10))
    for one, two in clearance.bodies:
        fingers = {names[one].split('.')[0], names[two].split('.')[0]}
        assert fingers == {'low_left', 'high_left'}
