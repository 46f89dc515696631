"""A made-up plan of the 1991 problem, traced by Newton's method, to draw and tabulate.

It is geometrically and statically right (contacts held to 1e-10 m, torque limits from an
independent linear program) but not the planner's: its trees are invented.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import linprog

from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.model import (
    Finger,
    Goal,
    Grasp,
    Hand,
    Joint,
    Link,
    ManipulatedObject,
    Problem,
)
from cfplan_core.model.loading import load_problem
from cfplan_core.report.scene import contact_marks
from cfplan_core.trajectory.plan_result import (
    PlanResult,
    Segment,
    Statistics,
    Status,
    TreeNode,
)

Trees = tuple[tuple[TreeNode, ...], tuple[TreeNode, ...]]
PROBLEMS = Path(__file__).parents[2] / 'config' / 'problems'
V0, V1, V2 = (f'object.v{k}|palm.0.e2' for k in range(3))
L3, L0, LTIP = 'object.v3|left.link_1.e0', 'object.v0|left.link_1.e0', 'object.e3|left.link_1.v1'
R2, RTIP = 'object.v2|right.link_2.e2', 'object.e2|right.link_2.v2'
R3 = 'object.v3|right.link_2.e2'
FORM, FORCE = 'form_closure', 'force_closure'
# Contacts, stability, the coordinate that is driven (x or φ of the object) and where it ends:
# a number, or None for the place where the next stretch's contacts are reached.
STRETCHES = (
    ((V0, V1, L3, R2), FORM, 0, -0.0176),
    ((V0, V1, L3, R2), FORCE, 0, None),
    ((V1, L0, L3, R2), FORCE, 2, None),
    ((V1, L0, L3, RTIP), FORM, 2, -0.756405441),
    ((V1, L0, LTIP, RTIP), FORM, 2, None),
    ((V1, L0, LTIP, R3), FORCE, 2, None),
    ((V1, V2, L0, R3), FORCE, 0, -0.011123125),
)
CORNER_GUESSES = {2: -0.0562, 3: -0.293, 5: -0.93, 6: -1.13}


def gaps(problem: Problem, contacts: Sequence[str], z: FloatArray) -> FloatArray:
    """Signed distances of vertices to edge lines at z = (pose, joints), m."""
    result = []
    bodies = problem.hand.world_vertices(z[3:])
    vertices = problem.object.world_vertices(z[:3])
    for name, mark in zip(
        contacts, contact_marks(problem, Grasp(z[:3], z[3:]), contacts), strict=True
    ):
        on_object, on_hand = name.split('|')
        if '.v' in on_object:
            body, edge = on_hand.rsplit('.e', 1)
            result.append(float((mark.point - bodies[body][int(edge)]) @ mark.normal))
        else:
            edge = on_object.rsplit('.e', 1)[1]
            result.append(float((vertices[int(edge)] - mark.point) @ mark.normal))
    return np.array(result)


def jacobian(problem: Problem, contacts: Sequence[str], z: FloatArray) -> FloatArray:
    """Derivatives of `gaps` by central differences, shape (k, 3 + n)."""
    step = 1e-6 * np.eye(len(z))
    return np.array(
        [(gaps(problem, contacts, z + h) - gaps(problem, contacts, z - h)) / 2e-6 for h in step]
    ).T


def drive(
    problem: Problem, contacts: Sequence[str], z: FloatArray, coordinate: int, value: float | None
) -> FloatArray:
    """Solve for contacts, and for one coordinate's value if it is given, by Newton's method."""
    rows = np.eye(len(z))[[coordinate] if value is not None else []]
    for _ in range(12):
        residual = np.append(gaps(problem, contacts, z), rows @ z - (value or 0.0))
        if np.abs(residual).max() < 1e-12:
            break
        derivative = np.vstack([jacobian(problem, contacts, z), rows])
        z = z - np.linalg.lstsq(derivative, residual, rcond=None)[0]
    return z


def torque_limits(
    problem: Problem, contacts: Sequence[str], z: FloatArray
) -> tuple[list[float], list[float]]:
    """Smallest and largest torque of every joint over all equilibria, N·m."""
    derivative = jacobian(problem, contacts, z)
    scale = np.diag([1.0, 1.0, 30.0])
    balance = scale @ derivative[:, :3].T
    load = -scale @ np.append(problem.object.mass * problem.gravity, 0.0)
    limits: tuple[list[float], list[float]] = ([], [])
    for column in derivative[:, 3:].T:
        for sign, found in zip((1.0, -1.0), limits, strict=True):
            answer = linprog(-sign * column, A_eq=balance, b_eq=load, bounds=(0.0, None))
            found.append(sign * answer.fun if answer.status == 0 else -sign * np.inf)
    return limits


def random_tree(seed: int, nodes: int, formations: Sequence[tuple[str, ...]]) -> list[TreeNode]:
    """A tree of dead ends hanging on whatever comes first, parents before children."""
    chance = random.Random(seed)
    tree = [TreeNode(None, formations[0], FORCE, 1, False, False)]
    while len(tree) < nodes:
        parent = chance.randrange(max(0, len(tree) - 8), len(tree))
        tree.append(
            TreeNode(
                parent,
                chance.choice(formations),
                chance.choice([FORM, FORCE, FORCE, 'second_order', '']),
                chance.choice([0, 1, 1, 2]),
                False,
                False,
            )
        )
    return tree


def made_up_formations(seed: int, count: int) -> list[tuple[str, ...]]:
    """Distinct sets of three to five contacts of the 1991 problem's elements."""
    chance = random.Random(seed)
    names = [f'object.v{k}|palm.0.e2' for k in range(4)]
    names += [f'object.v{k}|left.link_1.e{j}' for k in range(4) for j in range(2)]
    names += [f'object.e{k}|right.link_2.v{j}' for k in range(4) for j in range(2)]
    found: dict[tuple[str, ...], None] = {}
    while len(found) < count:
        found[tuple(sorted(chance.sample(names, chance.choice([3, 4, 4, 4, 5]))))] = None
    return list(found)


def trees_of_size(initial: int, goal: int) -> Trees:
    """Two trees with a path of three and two arcs that meets in a common formation."""
    formations = made_up_formations(1, max(3, (initial + goal) // 2))
    meeting = formations[-1]
    trees = []
    for seed, size, arcs in ((2, initial, 3), (3, goal, 2)):
        arcs = min(arcs, size - 1)
        tree = random_tree(seed, max(size - arcs, 1), formations)
        tree[0] = TreeNode(None, formations[seed - 2], FORM, 1, True, False)
        parent = 0
        for k in range(arcs):
            last = k == arcs - 1
            contacts = meeting if last else formations[(5 * seed + k) % len(formations)]
            tree.append(TreeNode(parent, contacts, FORCE, 0 if last else 1, True, last))
            parent = len(tree) - 1
        trees.append(tuple(tree))
    return trees[0], trees[1]


@pytest.fixture
def make_trees() -> Callable[[int, int], Trees]:
    """`trees_of_size`, for tests."""
    return trees_of_size


@pytest.fixture(scope='session')
def problem() -> Problem:
    """The problem of 1991."""
    return load_problem(PROBLEMS / 'trinkle_hunter_1991.yaml')


@pytest.fixture(scope='session')
def result(problem: Problem) -> PlanResult:
    """A plan of seven segments with form closure on one, both or no sides."""
    z = np.append(problem.start.object_pose, problem.start.joints)
    z = drive(problem, STRETCHES[0][0], z, 0, float(z[0]))
    frames, limits, segments = [z], [torque_limits(problem, STRETCHES[0][0], z)], []
    for k, (contacts, stability, coordinate, end) in enumerate(STRETCHES):
        first = len(frames) - 1
        corner = z
        if end is None:
            both = tuple(dict.fromkeys(contacts + STRETCHES[k + 1][0]))
            for value in np.linspace(z[coordinate], CORNER_GUESSES[k + 1], 20)[1:]:
                corner = drive(problem, contacts, corner, coordinate, value)
            end = float(drive(problem, both, corner, coordinate, None)[coordinate])
        steps = max(2, int(np.ceil(abs(end - z[coordinate]) / (0.003, 0, 0.05)[coordinate])))
        for value in np.linspace(z[coordinate], end, steps + 1)[1:]:
            z = drive(problem, contacts, z, coordinate, float(value))
            frames.append(z)
            limits.append(torque_limits(problem, contacts, z))
        segments.append(Segment(contacts, stability, first, len(frames) - 1))
    states = np.array(frames)
    moved = np.abs(np.diff(states[:, 3:], axis=0)).max(axis=1)
    initial, goal = trees_of_size(12, 9)
    path = [n for n in range(len(initial)) if initial[n].on_path]
    held = [tuple(dict.fromkeys(STRETCHES[1][0] + STRETCHES[2][0])), STRETCHES[1][0]]
    dressed = list(initial)
    for n, contacts in zip(
        path, [STRETCHES[0][0], STRETCHES[0][0], held[1], held[0]], strict=True
    ):
        node = dressed[n]
        dressed[n] = TreeNode(
            node.parent, contacts, node.stability, node.dimension, True, node.shared
        )
    meeting = list(goal)
    meeting[-1] = TreeNode(goal[-1].parent, held[0], FORCE, 0, True, True)
    meeting[0] = TreeNode(None, STRETCHES[-1][0], FORCE, 1, True, False)
    return PlanResult(
        problem=problem.name,
        status=Status.SOLVED,
        joint_names=problem.hand.joint_names,
        times=np.concatenate([[0.0], np.cumsum(np.maximum(moved, 1e-3))]),
        joints=states[:, 3:],
        object_poses=states[:, :3],
        torque_lower=np.array([lower for lower, _ in limits]),
        torque_upper=np.array([upper for _, upper in limits]),
        segments=tuple(segments),
        statistics=Statistics(0.08, len(dressed), len(meeting), 14, 61, {'unstable': 30}),
        trees=(tuple(dressed), tuple(meeting)),
    )


@pytest.fixture
def still(result: PlanResult) -> PlanResult:
    """A plan of one frame: the start is the goal."""
    return replace(
        result,
        times=result.times[:1],
        joints=result.joints[:1],
        object_poses=result.object_poses[:1],
        torque_lower=result.torque_lower[:1],
        torque_upper=result.torque_upper[:1],
        segments=(replace(result.segments[0], last_frame=0),),
    )


@pytest.fixture(scope='session')
def unsolved(problem: Problem) -> PlanResult:
    """A search that ended without a plan."""
    failures = {'the object falls': 40, 'links collide': 11, 'joint limit': 2}
    return PlanResult(
        problem=problem.name,
        status=Status.BUDGET_EXHAUSTED,
        joint_names=problem.hand.joint_names,
        message='time budget of 2 s used up',
        statistics=Statistics(2.0, 8, 6, 23, 53, failures),
        trees=trees_of_size(8, 6),
    )


@pytest.fixture(scope='session')
def three_joints() -> tuple[Problem, PlanResult]:
    """A finger of two links and one of one link, a notched object: not in equilibrium."""
    bar = [[0.0, -0.004], [0.06, -0.004], [0.06, 0.004], [0.0, 0.004]]
    joints = [Joint(name, -3.0, 3.0, 1.0, 2.0) for name in ('knuckle', 'tip_joint', 'thumb_joint')]
    hand = Hand(
        ([[-0.1, -0.02], [0.1, -0.02], [0.1, 0.0], [-0.1, 0.0]],),
        (
            Finger(
                'index',
                [-0.07, 0.0],
                0.0,
                joints[:2],
                (Link('proximal', 0.06, bar), Link('distal', 0.06, bar)),
            ),
            Finger('thumb', [0.07, 0.0], 0.0, joints[2:], (Link('only', 0.06, bar),)),
        ),
    )
    notched = [[-0.02, 0.0], [0.02, 0.0], [0.02, 0.03], [0.0, 0.015], [-0.02, 0.03]]
    start = Grasp([0.0, 0.0, 0.0], [1.6, -1.2, 2.0])
    made_up = Problem(
        'three', [0.0, -9.81], hand, ManipulatedObject(notched, 0.2), 0.0, start, Goal(None, None)
    )
    s = np.linspace(0.0, 1.0, 31)
    contacts = ('object.v0|palm.0.e2', 'object.v1|palm.0.e2', 'object.e4|index.distal.v2')
    plan = PlanResult(
        problem='three',
        status=Status.SOLVED,
        joint_names=hand.joint_names,
        times=1.5 * s,
        joints=start.joints + np.outer(s, [0.4, -0.3, 0.2]),
        object_poses=np.outer(s, [0.01, 0.0, 0.0]),
        torque_lower=np.column_stack([-0.1 - s, -np.full(31, np.inf), -0.02 * s]),
        torque_upper=np.column_stack([0.2 - 0.1 * s, np.full(31, np.inf), 0.05 + 0.3 * s**2]),
        segments=(
            Segment(contacts, FORCE, 0, 10),
            Segment(contacts[:2], 'second_order', 10, 11),
            Segment(contacts, FORM, 11, 30),
        ),
    )
    return made_up, plan
