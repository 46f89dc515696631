"""Random problems: a convex polygon on a flat palm between two one-joint fingers.

The fingers are turned towards the object until they touch it. Grasps that are stable that way are
starts; goals are taken from what can be explored from there, so that a plan is known to exist.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray, centroid
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.model import Finger, Goal, Grasp, Hand, Joint, Link, ManipulatedObject, Problem
from cfplan_core.planning.grasp_check import check_problem, examine_grasp
from cfplan_core.planning.pieces import Piece
from cfplan_core.planning.roadmap import Roadmap

PALM = [(-0.45, -0.05), (0.45, -0.05), (0.45, 0.0), (-0.45, 0.0)]
LIMITS = (0.05, math.pi - 0.05)
THICKNESS = 0.006


@dataclass(frozen=True, eq=False)
class Exploration:
    """Points and curves that can be reached from a problem's start.

    Attributes:
        system: The compiled problem.
        roadmap: What was found.
        depth: Number of transitions from the start by index of the piece.
    """

    system: ContactSystem
    roadmap: Roadmap
    depth: dict[int, int]

    @property
    def pieces(self) -> list[Piece]:
        """The pieces reached, in the order in which they were found."""
        return [piece for piece in self.roadmap.pieces if piece.index in self.depth]


def random_problem(seed: int) -> Problem:
    """Make a problem whose goal is its start; the same for the same seed."""
    rng = np.random.default_rng(seed)
    return next(problem for problem in _candidates(rng, seed) if not check_problem(problem))


def explore(problem: Problem, most: int = 400) -> Exploration:
    """Search from a problem's start, breadth first, until this many pieces are found."""
    system = ContactSystem(problem)
    roadmap = Roadmap(system, FrictionlessModel(system.load))
    start = examine_grasp(system, roadmap.model, problem.start, 'start', '').z
    queue = [roadmap.root(start)]
    depth = {queue[0].index: 0}
    while queue and len(roadmap.pieces) < most:
        piece = queue.pop(0)
        for _, neighbour in roadmap.neighbours(piece):
            if neighbour.index not in depth:
                depth[neighbour.index] = depth[piece.index] + 1
                queue.append(neighbour)
    return Exploration(system, roadmap, depth)


def goal_at(problem: Problem, z: FloatArray) -> Problem:
    """Replace a problem's goal by the whole grasp z, shape (3 + n,), rounded as in files."""
    (pose,) = np.round(ContactSystem(problem).object_poses(z[None]), 9)
    names = problem.hand.joint_names
    joints = dict(zip(names, np.round(z[3:], 9).tolist(), strict=True))
    return replace(problem, goal=Goal(pose, joints))


def distant_goal(problem: Problem, explored: Exploration, seed: int) -> Problem | None:
    """Replace a problem's goal by a point of a curve some transitions away from the start.

    Returns:
        The problem, or None if no curve is two transitions or more away.
    """
    rng = np.random.default_rng(seed)
    curves = [
        piece
        for piece in explored.pieces
        if piece.dimension == 1 and len(piece.points) > 4 and explored.depth[piece.index] >= 2
    ]
    if not curves:
        return None
    far = min(3, max(explored.depth[piece.index] for piece in curves))
    curves = [piece for piece in curves if explored.depth[piece.index] >= far]
    points = curves[rng.integers(len(curves))].points
    return goal_at(problem, points[rng.integers(2, len(points) - 2)])


def _candidates(rng: np.random.Generator, seed: int) -> Iterator[Problem]:
    """Problems in which both fingers touch the object; most do not hold it."""
    while True:
        thing = ManipulatedObject(_resting(rng, _convex(rng)), 0.1)
        apart = rng.uniform(0.055, 0.085)
        left, right = rng.uniform(0.05, 0.12, size=2)
        pose = np.array([rng.uniform(-apart / 2, apart / 2), 0.0, 0.0])
        outline = thing.world_vertices(pose)
        base = np.array([apart, 0.0])
        # The left finger comes from the left, the right one is its mirror image.
        joints = (
            _turn_to(base + outline, left),
            math.pi - _turn_to(base + outline * [-1.0, 1.0], right),
        )
        hand = Hand((PALM,), (_finger('left', -apart, left), _finger('right', apart, right)))
        if all(LIMITS[0] < angle < LIMITS[1] for angle in joints):
            goal = Goal(pose, dict(zip(hand.joint_names, joints, strict=True)))
            start = Grasp(pose, joints)
            yield Problem(f'random_{seed}', (0.0, -9.81), hand, thing, 0.0, start, goal)


def _convex(rng: np.random.Generator) -> FloatArray:
    """A polygon of three to five vertices, none of them flat."""
    count = rng.integers(3, 6)
    while True:
        angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, count))
        radii = 0.03 * rng.uniform(0.6, 1.0, count)
        vertices = np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)
        x, y = (np.roll(vertices, -1, axis=0) - vertices).T
        if (x * np.roll(y, -1) - y * np.roll(x, -1) > 0.1 * 0.03**2).all():
            return vertices


def _resting(rng: np.random.Generator, vertices: FloatArray) -> FloatArray:
    """Turn a polygon so that one of its edges lies on the x-axis, below its centroid."""
    first = rng.integers(len(vertices))
    edge = vertices[(first + 1) % len(vertices)] - vertices[first]
    c, s = edge / np.linalg.norm(edge)
    turned = (vertices - vertices[first]) @ np.array([[c, -s], [s, c]])
    return np.asarray(np.round(turned - [centroid(turned)[0], 0.0], 9))


def _finger(name: str, base: float, length: float) -> Finger:
    """A finger whose axis lies on its inner edge, towards the other finger."""
    low, high = (0.0, THICKNESS) if base < 0.0 else (-THICKNESS, 0.0)
    outline = [(0.0, low), (length, low), (length, high), (0.0, high)]
    return Finger(
        name,
        (base, 0.0),
        0.0,
        (Joint(f'{name}_joint', *LIMITS, velocity_limit=1.0, effort_limit=5.0),),
        (Link('link', length, outline),),
    )


def _turn_to(outline: FloatArray, length: float) -> float:
    """Angle at which a half-turning edge from the origin, coming from the left, meets a polygon.

    That is the largest polar angle within the edge's length: of a vertex, or of where the circle
    of the edge's end cuts the polygon. Zero if nothing is within reach.
    """
    points = [vertex for vertex in outline if np.hypot(*vertex) <= length]
    for start, end in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        along = end - start
        roots = np.roots([along @ along, 2.0 * start @ along, start @ start - length**2])
        points += [start + t * along for t in roots if np.isreal(t) and 0.0 <= t <= 1.0]
    return max((math.atan2(y, x) for x, y in points), default=0.0)
