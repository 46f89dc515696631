"""Problems without a solution, why they have none, and twins that differ by one number."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.optimize import linprog

from cfplan_core import PlanResult, Problem, load_problem, plan, verify_plan
from cfplan_core.contact.detection import touching
from cfplan_core.contact.gaps import gap_gradients
from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.geometry.separation import penetration_depth
from cfplan_core.model import Grasp
from cfplan_core.trajectory.plan_result import Status

FOLDER = Path(__file__).parents[2] / 'config' / 'problems' / 'existence'
TWINS = {
    'limit_in_the_way': 'limit_out_of_the_way',
    'link_too_short': 'link_long_enough',
    'gravity_pulls_over': 'gravity_pulls_less',
    'barrier_too_low': 'barrier_high_enough',
    'one_joint_stops_short': 'one_joint_goes_on',
}
# Angles between which a finger is looked at, rad, and what it may be off by then, in m.
FINE = 1e-3
OFF = 1e-4


@cache
def answered(name: str) -> tuple[Problem, PlanResult]:
    problem = load_problem(FOLDER / f'{name}.yaml')
    return problem, plan(problem)


def leaves(content: object, path: tuple[object, ...] = ()) -> dict[tuple[object, ...], object]:
    """Values of a document by where they are."""
    if isinstance(content, dict):
        pairs = list(content.items())
    elif isinstance(content, list):
        pairs = list(enumerate(content))
    else:
        return {path: content}
    return {k: v for key, value in pairs for k, v in leaves(value, (*path, key)).items()}


@pytest.mark.parametrize('name', TWINS)
def test_problem_without_solution_is_infeasible(name: str) -> None:
    _, result = answered(name)
    assert result.status is Status.INFEASIBLE
    assert (
        'Everything that can be reached with stability of first or second order was explored'
        in (result.message)
    )


@pytest.mark.parametrize('name', TWINS.values())
def test_twin_is_solved(name: str) -> None:
    problem, result = answered(name)
    assert result.solved, result.message
    assert verify_plan(problem, result).ok


@pytest.mark.parametrize(('name', 'twin'), TWINS.items())
def test_twins_differ_by_one_number(name: str, twin: str) -> None:
    one, other = (leaves(yaml.safe_load((FOLDER / f'{n}.yaml').read_text())) for n in (name, twin))
    assert one.keys() == other.keys()
    different = [path for path in one if one[path] != other[path] and path != ('name',)]
    assert len(different) == 1
    assert all(isinstance(document[different[0]], float) for document in (one, other))


def wrenches_at_goal(problem: Problem, finger: int) -> tuple[bool, FloatArray]:
    """Tell whether a finger can stay clear of the object at the goal, and how it can touch it.

    Args:
        problem: With the object's pose for a goal, and fingers of one joint.
        finger: Its index.

    Returns:
        False if the finger overlaps the object at all its angles, and the wrenches of all
        contacts that it, or the palm, has with the object at any, up to `OFF`; shape (k, 3).
    """
    system = ContactSystem(problem)
    joints = np.array([0.5 * (joint.lower + joint.upper) for joint in problem.hand.joints])
    pose = problem.goal.object_pose
    assert pose is not None
    thing = problem.object.world_vertices(pose)
    joint = problem.hand.joints[finger]
    name, links = problem.hand.fingers[finger].name, problem.hand.fingers[finger].links
    clear, wrenches = False, []
    for angle in np.append(np.arange(joint.lower, joint.upper, FINE), joint.upper):
        joints[finger] = angle
        link = problem.hand.world_vertices(joints)[f'{name}.{links[0].name}']
        if penetration_depth(thing, link) > OFF:
            continue
        clear = True
        z = system.configuration(Grasp(pose, joints))
        pairs = touching(system, z, OFF / system.size)
        bodies = [system.body_names[system.pair_body[pair]] for pair in pairs]
        own = [body.startswith(('palm', name)) for body in bodies]
        wrenches.append(gap_gradients(system, system.place(z[None]), pairs[own])[0, :, :3])
    return clear, np.concatenate([np.empty((0, 3)), *wrenches])


def span(vectors: FloatArray) -> bool:
    """Tell by linear programming whether vectors positively span R³."""
    if np.linalg.matrix_rank(vectors, 1e-6) < 3:
        return False
    count = len(vectors)
    found = linprog(np.ones(count), A_eq=vectors.T, b_eq=np.zeros(3), bounds=[(1.0, None)] * count)
    return bool(found.status == 0)


def can_be_held_at_goal(problem: Problem) -> bool:
    """Tell whether any contacts, of all that are possible there, hold the object at its goal."""
    found = [wrenches_at_goal(problem, k) for k in range(len(problem.hand.fingers))]
    load = ContactSystem(problem).load
    return all(clear for clear, _ in found) and span(
        np.concatenate([*(wrenches for _, wrenches in found), load[None]])
    )


@pytest.mark.parametrize('name', [name for name in TWINS if name != 'barrier_too_low'])
def test_no_contacts_can_hold_the_object_at_the_goal(name: str) -> None:
    """If all contacts that are possible for any joint angles do not, then no choice of them."""
    assert not can_be_held_at_goal(answered(name)[0])
    assert can_be_held_at_goal(answered(TWINS[name])[0])


def test_left_finger_is_in_the_block_at_every_angle_within_its_limits() -> None:
    assert not wrenches_at_goal(answered('limit_in_the_way')[0], 0)[0]


def width(vertices: FloatArray) -> float:
    """Smallest distance of parallel lines that hold a convex polygon between them."""
    edges = np.roll(vertices, -1, axis=0) - vertices
    normals = np.stack([edges[:, 1], -edges[:, 0]], axis=1) / np.hypot(*edges.T)[:, None]
    heights = vertices @ normals.T
    return float((heights.max(axis=0) - heights.min(axis=0)).min())


def test_block_is_wider_than_the_gap_and_the_barrier_higher_than_anything_can_lift_it() -> None:
    """A convex body passes a door only if that is as wide as it (Strang, 1982).

    To pass above it would have to hang in the air on the way: what pushes it up is a fingertip,
    no higher than the finger is long, or the barrier's top; its sides, wider above, push down.
    """
    problem, _ = answered('barrier_too_low')
    block, barrier = problem.object.vertices, problem.hand.palm[1]
    assert width(block) > barrier[:, 1].min()
    reach = max(float(np.hypot(*f.links[0].vertices.T).max()) for f in problem.hand.fingers)
    diameter = max(math.dist(a, b) for a in block for b in block)
    assert barrier[:, 1].max() - diameter > reach
    starts_left = problem.start.object_pose[0] < barrier[0, 0]
    assert starts_left
    assert problem.goal.object_pose is not None
    assert problem.goal.object_pose[0] > barrier[0, 0]
