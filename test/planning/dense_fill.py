"""A second way to find a sheet: flood fill, step by step, with its own geometry and mechanics.

Poses are solved for by Newton's method on numerical derivatives of the contacts' gaps; bodies are
tested for overlap as polygons; stable is what three positive contact forces balance.
"""

from __future__ import annotations

import numpy as np

from cfplan_core.contact.elements import parse_contact
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.geometry.separation import penetration_depth
from cfplan_core.model import Problem

_STEP = 1e-6
# Overlap, m, that is taken for rounding.
_OVERLAP = 1e-8
# A contact force, in weights, below which a contact is lost.
_FORCE = 1e-6


class DenseFill:
    """All configurations on a grid that steps from a first one reach with the same contacts.

    Attributes:
        nodes: Poses of the object's frame, m and rad, by node.
    """

    def __init__(
        self,
        problem: Problem,
        contacts: tuple[str, ...],
        pose: FloatArray,
        joints: FloatArray,
        spacing: float,
        most: int = 20000,
    ) -> None:
        self.problem = problem
        self.contacts = [parse_contact(name) for name in contacts]
        self.joints, self.spacing = joints, spacing
        self.lower = np.array([joint.lower for joint in problem.hand.joints])
        self.upper = np.array([joint.upper for joint in problem.hand.joints])
        first = (0, 0)
        self.nodes = {first: self._pose(first, pose)}
        front = [first]
        while front and len(self.nodes) < most:
            node = front.pop()
            for i, j in ((1, 0), (-1, 0), (0, 1), (0, -1)):
                beside = (node[0] + i, node[1] + j)
                if beside in self.nodes:
                    continue
                found = self._pose(beside, self.nodes[node])
                if found is not None and self._holds(beside, found):
                    self.nodes[beside] = found
                    front.append(beside)

    def angles(self, node: tuple[int, int]) -> FloatArray:
        """Joint angles at a node."""
        return np.asarray(self.joints + self.spacing * np.array(node))

    def _pose(self, node: tuple[int, int], guess: FloatArray) -> FloatArray:
        bodies = self.problem.hand.world_vertices(self.angles(node))
        size = self.problem.object.size
        pose = guess.copy()
        for _ in range(12):
            gap = self._gaps(bodies, pose)[0]
            slopes = np.empty((3, 3))
            for column, scale in enumerate((size, size, 1.0)):
                moved = pose.copy()
                moved[column] += _STEP * scale
                slopes[:, column] = (self._gaps(bodies, moved)[0] - gap) / _STEP
            change = np.linalg.lstsq(slopes, gap, rcond=None)[0]
            change = change / max(1.0, 5.0 * float(np.abs(change).max()))
            pose = pose - change * (size, size, 1.0)
            if np.abs(change).max() < 1e-10:
                break
        near = np.abs((pose - guess) / (size, size, 1.0)).max() < 0.3
        return pose if near and np.abs(change).max() < 1e-8 else None

    def _gaps(
        self, bodies: dict[str, FloatArray], pose: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Gaps, shape (3,), in sizes; wrenches of unit forces, (3, 3); room on edges, (3,)."""
        thing = self.problem.object.world_vertices(pose)
        c, s = np.cos(pose[2]), np.sin(pose[2])
        x, y = self.problem.object.center_of_mass
        center = np.add(pose[:2], (c * x - s * y, s * x + c * y))
        size = self.problem.object.size
        gap, wrench, room = np.empty(3), np.empty((3, 3)), np.empty(3)
        for k, contact in enumerate(self.contacts):
            body = bodies[contact.body]
            vertices, edges = (thing, body) if contact.object_vertex else (body, thing)
            point = vertices[contact.vertex]
            start, end = edges[contact.edge], edges[(contact.edge + 1) % len(edges)]
            along = (end - start) / np.linalg.norm(end - start)
            outward = np.array([along[1], -along[0]])
            gap[k] = outward @ (point - start) / size
            offset = along @ (point - start)
            room[k] = min(offset, np.linalg.norm(end - start) - offset)
            force = outward if contact.object_vertex else -outward
            arm = point - center
            wrench[k] = *force, (arm[0] * force[1] - arm[1] * force[0]) / size
        return gap, wrench, room

    def _holds(self, node: tuple[int, int], pose: FloatArray) -> bool:
        joints = self.angles(node)
        if (joints < self.lower).any() or (joints > self.upper).any():
            return False
        bodies = self.problem.hand.world_vertices(joints)
        _, wrench, room = self._gaps(bodies, pose)
        load = np.append(np.array(self.problem.gravity) / np.hypot(*self.problem.gravity), 0.0)
        if abs(np.linalg.det(wrench)) < 1e-9 or (room < 0.0).any():
            return False
        if (np.linalg.solve(wrench.T, -load) < _FORCE).any():
            return False
        thing = self.problem.object.world_vertices(pose)
        links = [body for name, body in bodies.items() if not name.startswith('palm')]
        depth = max(penetration_depth(thing, body) for body in bodies.values())
        return max(depth, penetration_depth(*links)) < _OVERLAP
