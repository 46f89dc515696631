"""Paths between two configurations of one contact formation."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from cfplan_core import load_problem
from cfplan_core.contact.detection import touching
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.gaps import gap_gradients, gaps
from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.planning.connecting import connect, projected_path
from cfplan_core.planning.grasp_check import examine_problem
from cfplan_core.planning.pieces import SAME
from cfplan_core.planning.tracing import STEP, Tracer

PATH = (
    Path(__file__).parents[2]
    / 'config'
    / 'problems'
    / 'many_joints'
    / 'two_fingers_three_joints.yaml'
)


@cache
def scene() -> tuple[ContactSystem, Tracer, Formation, FloatArray]:
    """A grasp of two fingers of three joints on an object that lies on the palm."""
    system = ContactSystem(load_problem(PATH))
    model = FrictionlessModel(system.load)
    start = examine_problem(system, model).start
    assert start is not None
    return system, Tracer(system, model), Formation(tuple(start.pairs.tolist())), start.z


def wandered(seed: int, steps: int = 6) -> FloatArray:
    """A configuration of the scene's formation, reached from its grasp by a random walk."""
    _, tracer, formation, z = scene()
    rng = np.random.default_rng(seed)
    for _ in range(steps):
        wanted = z + rng.normal(size=len(z)) * 0.5

        def steer(at: FloatArray, basis: FloatArray, to: FloatArray = wanted) -> FloatArray | None:
            ahead = np.asarray(basis.T @ (basis @ (to - at)))
            return ahead if np.abs(ahead).max() > 0.01 else None

        points = tracer.follow(formation, z, steer, longest=0.5).points
        # Well before whatever ended the walk.
        z = points[len(points) // 2]
    return z


def assert_inside(points: FloatArray) -> None:
    system, tracer, formation, _ = scene()
    placed = system.place(points)
    assert np.abs(gaps(system, placed, formation.array).gap).max() < 1e-9
    margins = tracer.model.margins(gap_gradients(system, placed, formation.array))
    assert (margins.stable > 0.0).all()
    assert (points[:, 3:] >= system.lower).all()
    assert (points[:, 3:] <= system.upper).all()
    assert np.abs(np.diff(points, axis=0)).max() < 1.5 * STEP
    for z in points:
        assert tuple(touching(system, z, 1e-6).tolist()) == formation.pairs


@pytest.mark.parametrize('seed', range(4))
def test_path_stays_inside_the_formation(seed: int) -> None:
    _, tracer, formation, start = scene()
    end = wandered(seed)
    path = connect(tracer, formation, start, end)
    assert path is not None
    np.testing.assert_array_equal(path[0], start)
    np.testing.assert_allclose(path[-1], end, atol=SAME)
    assert_inside(path)


class Post:
    """Two coordinates stay out of a disc."""

    reason = 'a post stands there'

    def __init__(self, columns: list[int], center: FloatArray, radius: float) -> None:
        self._columns, self._center, self._radius = columns, center, radius

    def margins(self, z: FloatArray, gradients: FloatArray) -> FloatArray:
        off = z[:, self._columns] - self._center
        return np.asarray(np.linalg.norm(off, axis=1) - self._radius)

    def finding(self, z: FloatArray, gradients: FloatArray) -> tuple[str, str]:
        return 'inside', 'outside'


@pytest.mark.parametrize('seed', range(3))
def test_trees_find_a_way_around_what_the_straight_line_runs_into(seed: int) -> None:
    system, tracer, formation, start = scene()
    end = wandered(seed)
    # The coordinates that change most span the plane in which the post stands.
    columns = np.argsort(-np.abs(end - start))[:2].tolist()
    straight = projected_path(tracer, formation, start, end)
    assert straight is not None
    middle = straight[len(straight) // 2, columns]
    radius = 0.3 * float(np.linalg.norm((end - start)[columns]))
    post = Post(columns, middle, radius)
    blocked = Tracer(system, tracer.model, bounds=(post,))
    assert projected_path(blocked, formation, start, end) is None
    path = connect(blocked, formation, start, end, seed=seed, most=200)
    assert path is not None
    assert_inside(path)
    assert (post.margins(path, np.empty(0)) > 0.0).all()


def test_same_seed_same_path() -> None:
    _, tracer, formation, start = scene()
    end = wandered(3)
    one, other = (connect(tracer, formation, start, end, seed=5) for _ in range(2))
    assert one is not None
    assert other is not None
    np.testing.assert_array_equal(one, other)


def test_no_path_to_where_another_contact_is_kept() -> None:
    _, tracer, formation, start = scene()
    elsewhere = start.copy()
    elsewhere[1] += 0.5
    assert connect(tracer, formation, start, elsewhere, most=4) is None
