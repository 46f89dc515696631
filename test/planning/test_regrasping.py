"""Fingers that change their places on an object at rest."""

from __future__ import annotations

from collections import Counter
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from cfplan_core import load_problem
from cfplan_core.contact.detection import touching
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.geometry.separation import penetration_depth
from cfplan_core.mechanics.contact_model import Stability
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.planning.free_motion import FreeMotion
from cfplan_core.planning.grasp_check import examine_problem
from cfplan_core.planning.milestones import Milestone
from cfplan_core.planning.parking import parked_postures
from cfplan_core.planning.pieces import Region
from cfplan_core.planning.pushing import Pusher
from cfplan_core.planning.regrasping import Regrasping
from cfplan_core.planning.touching_postures import TouchingPostures
from cfplan_core.planning.tracing import Tracer
from cfplan_core.planning.transitions import TOUCH, surroundings

PATH = (
    Path(__file__).parents[2]
    / 'config'
    / 'problems'
    / 'many_joints'
    / 'four_fingers_five_joints.yaml'
)
# Joints of the two lower fingers, which are free in the goal.
FREE = (np.arange(0, 5), np.arange(15, 20))


@cache
def scene() -> tuple[ContactSystem, FrictionlessModel, FloatArray]:
    """A box on the palm, held by two fingers of four."""
    system = ContactSystem(load_problem(PATH))
    model = FrictionlessModel(system.load)
    goal = examine_problem(system, model).goal
    assert goal is not None
    return system, model, goal.z


def deepest_overlap(z: FloatArray) -> float:
    """How deep the bodies that may not overlap do so, in object sizes."""
    system = scene()[0]
    vertices = system.place(z[None]).vertices[0]
    outlines = [
        np.stack([part.real, part.imag], axis=1)
        for part in (vertices[system.body_of == k] for k in range(len(system.body_names)))
    ]
    pairs = {
        tuple(sorted((int(a), int(b))))
        for a, b in zip(
            system.body_of[system.pair_vertex], system.body_of[system.pair_edge], strict=True
        )
    }
    return max(penetration_depth(outlines[a], outlines[b]) for a, b in pairs)


def held(z: FloatArray) -> Milestone:
    return Milestone(z, surroundings(scene()[0], z), None, ())


@pytest.mark.parametrize('joints', FREE, ids=['left', 'right'])
def test_drawn_postures_touch_with_their_contact_alone(joints: FloatArray) -> None:
    system, _, z = scene()
    before = set(touching(system, z, TOUCH).tolist())
    drawn = TouchingPostures(system, joints).draw(
        z, z[None, 3 + joints], 12, np.random.default_rng(1)
    )
    assert len(drawn.angles) > 3
    for angles, pair in zip(drawn.angles, drawn.pairs, strict=True):
        placed = z.copy()
        placed[3 + joints] = angles
        assert set(touching(system, placed, TOUCH).tolist()) - before == {int(pair)}
        assert (angles >= system.lower[joints]).all()
        assert (angles <= system.upper[joints]).all()


def test_parked_postures_are_clear_of_the_object_at_both_ends() -> None:
    system, model, z = scene()
    start = examine_problem(system, model).start
    assert start is not None
    joints = FREE[0]
    parked = parked_postures(system, joints, start.z, z, 2, np.random.default_rng(0))
    assert len(parked) == 2
    for end in (start.z, z):
        for angles in parked:
            placed = end.copy()
            placed[3 + joints] = angles
            assert FreeMotion(system, joints).alone(placed[None])[0]


def test_way_through_free_space_keeps_all_else_at_rest_and_clear() -> None:
    system, _, z = scene()
    joints = FREE[0]
    parked = parked_postures(system, joints, z, z, 1, np.random.default_rng(0))[0]
    end = z.copy()
    end[3 + joints] = parked
    nothing = np.empty(0, dtype=np.intp)
    way = FreeMotion(system, joints).way(z, nothing, end, nothing, np.random.default_rng(0), 300)
    assert way is not None
    np.testing.assert_array_equal(way[-1], end)
    others = np.setdiff1d(np.arange(system.dof), 3 + joints)
    for before, after in zip([z, *way[:-1]], way, strict=True):
        for place in np.linspace(0.0, 1.0, 25):
            between = before + place * (after - before)
            np.testing.assert_array_equal(between[others], z[others])
            assert deepest_overlap(between) < 1e-6


def test_there_is_no_way_to_where_the_finger_overlaps() -> None:
    system, _, z = scene()
    joints = FREE[0]
    rng = np.random.default_rng(0)
    end = z.copy()
    while deepest_overlap(end) < 0.05:
        end[3 + joints] = rng.uniform(system.lower[joints], system.upper[joints])
    nothing = np.empty(0, dtype=np.intp)
    assert FreeMotion(system, joints).way(z, nothing, end, nothing, rng, 20) is None


def test_grasp_is_changed_with_the_object_at_rest_and_held() -> None:
    system, model, z = scene()
    tracer = Tracer(system, model)

    def region_of(known: list[Region], formation: Formation, stability: Stability) -> Region:
        return Region(0, formation, stability, 2, z[None], (), [])

    rng = np.random.default_rng(2)
    end = z.copy()
    for joints in FREE:
        drawn = TouchingPostures(system, joints).draw(z, z[None, 3 + joints], 40, rng)
        for angles in drawn.angles:
            other = end.copy()
            other[3 + joints] = angles
            if deepest_overlap(other) < 1e-6:
                end = other
                break
    wanted = held(end)
    assert len(wanted.around.pairs) == len(held(z).around.pairs) + 2
    pusher = Pusher(tracer, Counter(), region_of)
    chain, done = Regrasping(system, model, pusher, z, z, rng).join(held(z), wanted)
    assert done
    np.testing.assert_allclose(chain[-1].z, end, atol=1e-7)
    at = z
    for milestone in chain:
        for stretch in milestone.stretches:
            np.testing.assert_allclose(stretch.points[0], at, atol=1e-9)
            at = stretch.points[-1]
            assert np.abs(stretch.points[:, :3] - z[:3]).max() < 1e-9
            assert (tracer.margins(stretch.formation, stretch.points).stable > 0.0).all()
            assert max(deepest_overlap(point) for point in stretch.points) < 1e-6
