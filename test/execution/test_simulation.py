"""What a drive does without contact, against closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cfplan_core import Finger, Goal, Grasp, Hand, Joint, Link, ManipulatedObject, Problem
from cfplan_core.execution.reference import Reference
from cfplan_core.execution.scene import build_scene
from cfplan_core.execution.simulation import Gains, Run, simulate

STEP = 5e-4
STIFFNESS = 20.0
BLOCK = np.array([[-0.02, -0.01], [0.02, -0.01], [0.02, 0.01], [-0.02, 0.01]])
TABLE = np.array([[-0.5, -0.1], [0.5, -0.1], [0.5, 0.0], [-0.5, 0.0]])
LINK = np.array([[0.0, -0.003], [0.05, -0.003], [0.05, 0.003], [0.0, 0.003]])


def _problem(link_mass: float = 0.0) -> Problem:
    """A block on a table, far from a finger of one link."""
    joint = Joint('knuckle', -3.0, 3.0, 1.0, 0.5)
    finger = Finger(
        'left', np.array([0.2, 0.1]), 0.0, (joint,), (Link('l', 0.05, LINK, link_mass),)
    )
    pose = np.array([0.0, 0.01, 0.0])
    grasp = Grasp(pose, np.array([0.3]))
    gravity = np.array([0.0, -9.81])
    thing = ManipulatedObject(BLOCK, 0.1)
    return Problem('b', gravity, Hand((TABLE,), (finger,)), thing, 0.0, grasp, Goal(pose))


def _run(
    problem: Problem,
    speed: float = 0.0,
    torque: float = 0.0,
    stiff: bool = True,
    error: float = 0.0,
) -> Run:
    times = STEP * np.arange(2000)
    rows = len(times)
    reference = Reference(
        times,
        np.zeros(rows, dtype=np.intp),
        0.3 + speed * times[:, None],
        np.full((rows, 1), speed),
        np.tile(problem.start.object_pose, (rows, 1)),
        np.full((rows, 1), torque),
        np.full((rows, 1), stiff),
    )
    gains = Gains(np.array([STIFFNESS]), np.zeros(1), np.array([0.2]))
    return simulate(build_scene(problem, STEP), reference, gains, np.array([error]), 10)


def test_joint_stands_where_its_sensor_reads_what_was_asked() -> None:
    assert _run(_problem(), error=0.02).joints[-1] == pytest.approx([0.28], abs=1e-6)


def test_joint_follows_a_steady_motion_without_lag() -> None:
    run = _run(_problem(), speed=0.5)
    assert run.joints[-1, 0] == pytest.approx(0.3 + 0.5 * run.times[-1], abs=1e-4)
    assert run.joint_velocities[-1, 0] == pytest.approx(0.5, abs=1e-4)


def test_stiff_joint_yields_to_its_link_by_weight_over_stiffness() -> None:
    sag = 0.08 * 9.81 * 0.025 * np.cos(0.3) / STIFFNESS
    run = _run(_problem(link_mass=0.08))
    assert run.joints[-1, 0] == pytest.approx(0.3 - sag, rel=1e-4)
    assert run.torques[-1, 0] == pytest.approx(STIFFNESS * sag, rel=1e-2)


def test_torque_that_holds_the_link_keeps_it_where_it_is() -> None:
    weight = 0.08 * 9.81 * 0.025 * np.cos(0.3)
    run = _run(_problem(link_mass=0.08), torque=weight)
    assert run.joints[-1, 0] == pytest.approx(0.3, abs=1e-6)


def test_joint_in_torque_is_moved_by_torque() -> None:
    run = _run(_problem(), torque=1e-3, stiff=False)
    # At last the damping of 0.2 N·m·s/rad takes all of the torque.
    assert run.joint_velocities[-1, 0] == pytest.approx(1e-3 / 0.2, rel=1e-2)


def test_torque_ends_at_the_effort_limit() -> None:
    run = _run(_problem(link_mass=5.0))
    assert run.torques.max() == pytest.approx(0.5)


def test_forces_are_between_the_bodies_that_touch() -> None:
    run = _run(_problem())
    vertices, bodies = np.nonzero(run.forces[-1])
    assert vertices.tolist() == [0, 1]
    assert bodies.tolist() == [1, 1]
    assert run.forces[-1].sum() == pytest.approx(0.1 * 9.81, rel=1e-3)


def test_object_that_starts_in_the_table_is_put_on_it_without_a_jump() -> None:
    problem = _problem()
    deep = replace(problem, start=Grasp(np.array([0.0, 0.0095, 0.0]), problem.start.joints))
    heights = _run(deep).object_poses[:, 1]
    assert heights == pytest.approx(np.full(len(heights), 0.01), abs=2e-5)
