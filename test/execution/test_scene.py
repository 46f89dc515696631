"""The MuJoCo model is the problem: bodies, places, contacts, and the laws of motion."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import mujoco
import numpy as np
import pytest

from cfplan_core import Finger, Goal, Grasp, Hand, Joint, Link, ManipulatedObject, Problem
from cfplan_core.contact.gaps import gaps
from cfplan_core.contact.system import ContactSystem
from cfplan_core.execution.scene import Scene, build_scene
from cfplan_core.mechanics.contact_forces import configurations

STEP = 5e-4
BLOCK = np.array([[-0.02, -0.01], [0.02, -0.01], [0.02, 0.01], [-0.02, 0.01]])
NOTCHED = np.array(
    [[0.0, 0.0], [0.06, 0.0], [0.06, 0.04], [0.04, 0.04], [0.03, 0.02], [0.02, 0.04], [0.0, 0.04]]
)
TABLE = np.array([[-0.5, -0.1], [0.5, -0.1], [0.5, 0.0], [-0.5, 0.0]])


def _problem(
    vertices: np.ndarray = BLOCK,
    pose: tuple[float, float, float] = (0.0, 0.01, 0.0),
    palm: tuple[np.ndarray, ...] = (TABLE,),
    link_mass: float = 0.0,
) -> Problem:
    """A block on a table beside a finger of two links."""
    joints = tuple(Joint(name, -3.0, 3.0, 1.0, 5.0) for name in ('knuckle', 'middle'))
    outline = np.array([[0.0, 0.0], [0.05, 0.0], [0.05, 0.006], [0.0, 0.006]])
    links = tuple(Link(name, 0.05, outline, link_mass) for name in ('near', 'far'))
    hand = Hand(palm, (Finger('left', np.array([0.2, 0.1]), 0.3, joints, links),))
    grasp = Grasp(np.array(pose), np.array([0.2, -0.4]))
    gravity = np.array([0.0, -9.81])
    goal = Goal(object_pose=np.array(pose))
    return Problem('block', gravity, hand, ManipulatedObject(vertices, 0.1), 0.0, grasp, goal)


def _at(scene: Scene, grasp: Grasp) -> Any:
    data = mujoco.MjData(scene.model)
    data.qpos[:] = [*grasp.object_pose, *grasp.joints]
    mujoco.mj_forward(scene.model, data)
    return data


def _moments(vertices: np.ndarray, about: np.ndarray) -> tuple[float, float]:
    """Area and polar second moment by a sum over a fine grid."""
    from matplotlib.path import Path as Outline

    low, high = vertices.min(axis=0), vertices.max(axis=0)
    count = 400
    grid = np.stack(np.meshgrid(*((np.arange(count) + 0.5) / count for _ in range(2))), axis=-1)
    points = low + grid.reshape(-1, 2) * (high - low)
    inside = points[Outline(vertices).contains_points(points)]
    cell = float(np.prod(high - low)) / count**2
    return len(inside) * cell, float(((inside - about) ** 2).sum() * cell)


def test_block_has_the_mass_and_the_inertia_of_a_rectangle() -> None:
    model = build_scene(_problem(), STEP).model
    assert model.body('object').mass[0] == pytest.approx(0.1)
    assert model.body('object').inertia[2] == pytest.approx(0.1 * (0.04**2 + 0.02**2) / 12.0)


def test_inertia_of_an_object_with_a_notch_is_that_of_its_area() -> None:
    problem = _problem(NOTCHED)
    area, moment = _moments(NOTCHED, problem.object.center_of_mass)
    body = build_scene(problem, STEP).model.body('object')
    assert body.inertia[2] == pytest.approx(0.1 * moment / area, rel=1e-2)
    assert body.ipos[:2] == pytest.approx(problem.object.center_of_mass)


@pytest.mark.parametrize('vertices', [BLOCK, NOTCHED])
@pytest.mark.parametrize('seed', range(5))
def test_distances_in_the_engine_are_the_gaps_of_the_planner(
    vertices: np.ndarray, seed: int
) -> None:
    problem = _problem(vertices)
    system = ContactSystem(problem)
    scene = build_scene(problem, STEP)
    generator = np.random.default_rng(seed)
    pose = [*generator.uniform([0.1, 0.2], [0.3, 0.4]), generator.uniform(-3.0, 3.0)]
    grasp = Grasp(np.array(pose), generator.uniform(-1.0, 1.0, 2))
    data = _at(scene, grasp)
    z = configurations(system, grasp.object_pose[None], grasp.joints[None])
    gap, offset = gaps(system, system.place(z), slice(0, system.contact_count))
    ball_of = {int(v): g for g, v in enumerate(scene.vertex_of_geom) if v >= 0}
    compared = 0
    for pair in range(system.contact_count):
        facing = 0.02 < offset[0, pair] < system.pair_length[pair] - 0.02
        if not facing or gap[0, pair] < 0.0:
            continue
        vertex = int(system.pair_vertex[pair])
        body = int(system.body_of[system.pair_edge[pair]])
        pieces = np.flatnonzero(scene.body_of_geom == body)
        distance = min(
            mujoco.mj_geomDistance(scene.model, data, ball_of[vertex], int(piece), 10.0, None)
            for piece in pieces
        )
        # Another edge of the body may be nearer; corners are rounded by a thousandth at most.
        assert distance <= gap[0, pair] * system.size + 2e-3 * system.size
        compared += distance >= gap[0, pair] * system.size - 2e-3 * system.size
    assert compared >= 3


def test_bodies_are_where_the_planner_has_them() -> None:
    problem = _problem(NOTCHED)
    scene = build_scene(problem, STEP)
    grasp = Grasp(np.array([0.03, 0.2, 0.7]), np.array([0.5, -1.1]))
    data = _at(scene, grasp)
    system = ContactSystem(problem)
    placed = np.concatenate(
        [
            problem.object.world_vertices(grasp.object_pose),
            *problem.hand.world_vertices(grasp.joints).values(),
        ]
    )
    balls = {int(v): data.geom_xpos[g, :2] for g, v in enumerate(scene.vertex_of_geom) if v >= 0}
    assert sorted(balls) == np.flatnonzero(system.convex).tolist()
    for vertex, center in balls.items():
        assert np.linalg.norm(center - placed[vertex]) < 3e-3 * problem.object.size


def test_contacts_are_possible_exactly_where_the_planner_considers_them() -> None:
    problem = _problem(NOTCHED)
    system = ContactSystem(problem)
    scene = build_scene(problem, STEP)
    considered = set(
        zip(system.pair_vertex.tolist(), system.body_of[system.pair_edge].tolist(), strict=True)
    )
    model = scene.model
    modelled = {
        (int(scene.vertex_of_geom[a]), int(scene.body_of_geom[b]))
        for a, b in zip(model.pair_geom1, model.pair_geom2, strict=True)
    } | {
        (int(scene.vertex_of_geom[b]), int(scene.body_of_geom[a]))
        for a, b in zip(model.pair_geom1, model.pair_geom2, strict=True)
    }
    assert {pair for pair in modelled if -1 not in pair} == considered
    assert not model.geom_contype.any()
    assert not model.geom_conaffinity.any()


def test_object_that_is_dropped_falls_by_half_g_t_squared() -> None:
    problem = _problem(pose=(0.0, 0.5, 0.4))
    scene = build_scene(problem, STEP)
    data = _at(scene, problem.start)
    for _ in range(400):
        mujoco.mj_step(scene.model, data)
    fallen = problem.start.object_pose[1] - data.qpos[1]
    assert fallen == pytest.approx(0.5 * 9.81 * 0.2**2, rel=5e-3)
    assert data.qpos[[0, 2]] == pytest.approx([0.0, 0.4], abs=1e-9)


def test_block_on_the_table_presses_half_its_weight_at_each_corner() -> None:
    problem = _problem()
    scene = build_scene(problem, STEP)
    data = _at(scene, problem.start)
    for _ in range(2000):
        mujoco.mj_step(scene.model, data)
    forces = data.efc_force[data.contact.efc_address]
    assert sorted(forces) == pytest.approx([0.1 * 9.81 / 2] * 2, rel=1e-3)
    assert data.qpos[1] == pytest.approx(0.01, abs=1e-6)


def test_finger_swings_about_its_joint_as_a_pendulum() -> None:
    problem = _problem(link_mass=0.05)
    hand = problem.hand
    near = replace(
        hand.fingers[0], joints=hand.fingers[0].joints[:1], links=(hand.fingers[0].links[0],)
    )
    hanging = Grasp(problem.start.object_pose, np.array([-0.5 * np.pi - 0.3 + 0.02]))
    problem = replace(problem, hand=Hand((TABLE,), (near,)), start=hanging)
    scene = build_scene(problem, STEP)
    data = _at(scene, problem.start)
    speeds = []
    for _ in range(4000):
        mujoco.mj_step(scene.model, data)
        speeds.append(float(data.qvel[3]))
    turns = [k for k, (a, b) in enumerate(pairwise(speeds)) if a < 0.0 <= b]
    period = STEP * float(np.diff(turns).mean())
    arm = float(np.hypot(0.025, 0.003))
    inertia = 0.05 * ((0.05**2 + 0.006**2) / 12.0 + arm**2) + scene.model.dof_armature[3]
    assert period == pytest.approx(2.0 * np.pi * np.sqrt(inertia / (0.05 * 9.81 * arm)), rel=1e-2)


def test_link_without_mass_does_not_fall() -> None:
    problem = _problem()
    scene = build_scene(problem, STEP)
    data = _at(scene, problem.start)
    for _ in range(400):
        mujoco.mj_step(scene.model, data)
    assert data.qpos[3:] == pytest.approx(problem.start.joints, abs=1e-9)


@pytest.mark.parametrize(('friction', 'slides'), [(0.3, True), (0.8, False)])
def test_block_on_a_slope_slides_if_the_slope_is_steeper_than_the_friction(
    friction: float, slides: bool
) -> None:
    problem = replace(_problem(), gravity=9.81 * np.array([np.sin(0.5), -np.cos(0.5)]))
    scene = build_scene(problem, STEP, friction)
    data = _at(scene, problem.start)
    for _ in range(400):
        mujoco.mj_step(scene.model, data)
    expected = 0.5 * 9.81 * (np.sin(0.5) - friction * np.cos(0.5)) * 0.2**2 if slides else 0.0
    assert data.qpos[0] == pytest.approx(expected, rel=0.03, abs=1e-4)
