"""All grasps of three contacts for given joint angles, by enumeration: no exploration.

For a turn φ of the object every gap is linear in its place: two contacts give it. Along φ the
object stays clear of the hand until a third contact closes; that is where three touch. Whether
bodies overlap is told by separating lines, whether three contacts hold the object by the signs of
the only forces that balance its weight.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.model import Problem

_TURNS = 240
_HALVINGS = 48
_TOUCH = 1e-8
_FORCE = 1e-6


@dataclass(frozen=True, eq=False)
class Scene:
    """The hand for fixed joint angles; convex bodies, lengths in m.

    Attributes:
        names: Of the hand's bodies.
        bodies: Their corners, each of shape (k, 2).
        outline: The object's corners around its centre of mass, shape (m, 2).
    """

    names: tuple[str, ...]
    bodies: tuple[FloatArray, ...]
    outline: FloatArray


@dataclass(frozen=True, eq=False)
class Held:
    """A grasp: its contacts by name, the centre of mass and the turn, shape (3,)."""

    contacts: frozenset[str]
    pose: FloatArray


def scene_of(problem: Problem, joints: FloatArray) -> Scene:
    """Place a hand."""
    bodies = problem.hand.world_vertices(joints)
    outline = problem.object.vertices - np.array(problem.object.center_of_mass)
    return Scene(tuple(bodies), tuple(bodies.values()), outline)


def _normals(corners: FloatArray) -> FloatArray:
    along = np.roll(corners, -1, axis=0) - corners
    return np.stack([along[:, 1], -along[:, 0]], axis=1) / np.hypot(*along.T)[:, None]


def _turned(points: FloatArray, phi: FloatArray) -> FloatArray:
    """Points turned by each angle; shape (s, k, 2)."""
    c, s = np.cos(phi)[:, None], np.sin(phi)[:, None]
    return np.stack([c * points[:, 0] - s * points[:, 1], s * points[:, 0] + c * points[:, 1]], 2)


class Enumeration:
    """Everything about contacts of one scene."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        # A contact: body, vertex and edge, and whether the vertex is the object's.
        self.contacts: list[tuple[int, int, int, bool]] = []
        for b, body in enumerate(scene.bodies):
            many = len(scene.outline)
            self.contacts += [(b, v, e, True) for v in range(many) for e in range(len(body))]
            self.contacts += [(b, v, e, False) for v in range(len(body)) for e in range(many)]
        self.names = [
            f'object.v{v}|{scene.names[b]}.e{e}' if own else f'object.e{e}|{scene.names[b]}.v{v}'
            for b, v, e, own in self.contacts
        ]
        self.sides = [_normals(body) for body in scene.bodies]
        # For each body, by edge of either, the contacts with all vertices of the other.
        self.separating = [
            [
                [k for k, c in enumerate(self.contacts) if (c[0], c[2], c[3]) == (b, e, own)]
                for own, edges in ((True, len(body)), (False, len(scene.outline)))
                for e in range(edges)
            ]
            for b, body in enumerate(scene.bodies)
        ]
        self.lengths = np.array(
            [
                np.hypot(*(np.roll(c, -1, axis=0) - c)[e])
                for b, _, e, own in self.contacts
                for c in [scene.bodies[b] if own else scene.outline]
            ]
        )

    def lines(self, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Gaps, and places along the edges, as functions of the object's place.

        Returns:
            Slopes, shape (2, s, c, 2), and offsets, (2, s, c).
        """
        outline = _turned(self.scene.outline, phi)
        own = _turned(_normals(self.scene.outline), phi)
        slopes = np.empty((2, len(phi), len(self.contacts), 2))
        bases = np.empty(slopes.shape[:3])
        for k, (b, v, e, object_vertex) in enumerate(self.contacts):
            body = self.scene.bodies[b]
            if object_vertex:
                normal = np.broadcast_to(self.sides[b][e], (len(phi), 2))
                apart, sign = outline[:, v] - body[e], 1.0
            else:
                normal, apart, sign = own[:, e], body[v] - outline[:, e], -1.0
            along = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
            for which, direction in enumerate((normal, along)):
                slopes[which, :, k] = sign * direction
                bases[which, :, k] = (apart * direction).sum(axis=1)
        return slopes, bases

    @staticmethod
    def at(slopes: FloatArray, bases: FloatArray, place: FloatArray) -> FloatArray:
        """Values at places of shape (s, 2); shape (s, c)."""
        return np.asarray((slopes * place[:, None]).sum(axis=2) + bases)

    def apart(self, gaps: FloatArray) -> FloatArray:
        """Signed distance of the object from the hand's bodies, shape (s,); negative overlaps."""
        nearest = np.full(len(gaps), np.inf)
        for sides in self.separating:
            best = np.max([gaps[:, side].min(axis=1) for side in sides], axis=0)
            nearest = np.minimum(nearest, best)
        return nearest

    def grasps(self, load: FloatArray) -> list[Held]:
        """All grasps that exactly three contacts hold.

        Args:
            load: Direction of gravity, shape (2,).
        """
        phi = np.linspace(-np.pi, np.pi, _TURNS + 1) + 1e-4
        slopes, bases = self.lines(phi)
        found: dict[tuple[frozenset[str], tuple[float, ...]], Held] = {}
        for pair in combinations(range(len(self.contacts)), 2):
            two = list(pair)
            place, good = self._between(slopes[0][:, two], bases[0][:, two])
            along = self.at(slopes[1][:, two], bases[1][:, two], place)
            good &= ((along > 0.0) & (along < self.lengths[two])).all(axis=1)
            some = np.flatnonzero(good)
            if not len(some):
                continue
            clear = self.apart(self.at(slopes[0][some], bases[0][some], place[some]))
            # Contacts of the pair have no gap: clear is zero where nothing else is nearer.
            free = clear > -_TOUCH
            beside = np.diff(some) == 1
            for k in np.flatnonzero((free[1:] != free[:-1]) & beside):
                held = self._third(two, phi[some[k]], phi[some[k + 1]], bool(free[k]), load)
                if held is not None:
                    key = (held.contacts, tuple(np.round(held.pose, 6)))
                    found.setdefault(key, held)
        return list(found.values())

    @staticmethod
    def _between(slopes: FloatArray, bases: FloatArray) -> tuple[FloatArray, np.ndarray]:
        """Where two gaps vanish, shape (s, 2), and whether that is one place."""
        a, b = slopes[:, 0], slopes[:, 1]
        determinant = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        regular = np.abs(determinant) > 1e-6
        safe = np.where(regular, determinant, 1.0)
        x = (-bases[:, 0] * b[:, 1] + bases[:, 1] * a[:, 1]) / safe
        y = (-bases[:, 1] * a[:, 0] + bases[:, 0] * b[:, 0]) / safe
        return np.stack([x, y], axis=1), regular

    def _third(
        self, two: list[int], low: float, high: float, free_below: bool, load: FloatArray
    ) -> Held | None:
        """Halve an interval of turns to where a third contact closes."""
        for _ in range(_HALVINGS):
            middle = np.array([0.5 * (low + high)])
            slopes, bases = self.lines(middle)
            place, _ = self._between(slopes[0][:, two], bases[0][:, two])
            free = bool(self.apart(self.at(slopes[0], bases[0], place))[0] > -1e-13)
            low, high = (middle[0], high) if free == free_below else (low, middle[0])
        phi = np.array([low if free_below else high])
        slopes, bases = self.lines(phi)
        place, _ = self._between(slopes[0][:, two], bases[0][:, two])
        gaps, along = (self.at(slopes[k], bases[k], place)[0] for k in (0, 1))
        near = (np.abs(gaps) < _TOUCH) & (along > -_TOUCH) & (along < self.lengths + _TOUCH)
        touching = np.flatnonzero(near).tolist()
        if len(touching) != 3 or not set(two) <= set(touching):
            return None
        if not self._holds(touching, phi, place[0], slopes[0, 0], load):
            return None
        names = frozenset(self.names[k] for k in touching)
        return Held(names, np.append(place[0], (phi[0] + np.pi) % (2 * np.pi) - np.pi))

    def _holds(
        self,
        touching: list[int],
        phi: FloatArray,
        place: FloatArray,
        slopes: FloatArray,
        load: FloatArray,
    ) -> bool:
        outline = _turned(self.scene.outline, phi)[0] + place
        wrenches = []
        for k in touching:
            b, v, _, own = self.contacts[k]
            arm = (outline[v] if own else self.scene.bodies[b][v]) - place
            n = slopes[k]
            wrenches.append([*n, (arm[0] * n[1] - arm[1] * n[0]) / 0.03])
        matrix = np.array(wrenches).T
        if np.linalg.cond(matrix) > 1e9:
            return False
        return bool((np.linalg.solve(matrix, [-load[0], -load[1], 0.0]) > _FORCE).all())
