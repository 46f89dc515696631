"""Hand and object compiled into flat arrays, without units, for the mathematics above.

Lengths are in units of the object's size and forces in units of its weight (1 N without gravity),
so that metres and radians can be compared. Points of the plane are complex numbers x + iy, so
that a rotation is a product. A configuration is z = (x, y, φ, θ_1 … θ_n): position and angle of
the frame in the object's centre of mass, parallel to the object's frame, then the joint angles.
Functions take batches of configurations, shape (s, 3 + n).

All vertices of all bodies stand in one list, the object's first; edge k starts at vertex k. A
*pair* is a vertex of one body and an edge of another; the first `contact_count` pairs are the
possible elemental contacts, the others are between links, which may not meet.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cfplan_core.contact.elements import ElementalContact
from cfplan_core.errors import CfplanError
from cfplan_core.geometry.polygon import FloatArray, centroid, convex_vertices
from cfplan_core.model import Grasp, Problem

IntArray = NDArray[np.intp]
BoolArray = NDArray[np.bool_]
ComplexArray = NDArray[np.complex128]


class Placement(NamedTuple):
    """World positions of all features for a batch of s configurations, as complex numbers.

    Attributes:
        center: Shape (s,), the object's centre of mass.
        axes: Shape (s, n), the joints' axes.
        vertices: Shape (s, v).
        normals: Shape (s, v), outward unit normals of the edges.
    """

    center: ComplexArray
    axes: ComplexArray
    vertices: ComplexArray
    normals: ComplexArray


def as_complex(points: FloatArray) -> ComplexArray:
    """Turn points of shape (k, 2) into complex numbers of shape (k,)."""
    return np.asarray(points[:, 0] + 1j * points[:, 1])


class ContactSystem:
    """A problem's geometry in flat arrays; immutable after construction."""

    def __init__(self, problem: Problem) -> None:
        """Compile a problem.

        Args:
            problem: Must be valid (see `cfplan_core.model.loading`).
        """
        self.problem = problem
        self.size = problem.object.size
        gravity = float(np.hypot(*problem.gravity))
        self.force_unit = problem.object.mass * gravity if gravity > 0.0 else 1.0
        weight = problem.gravity / gravity if gravity > 0.0 else np.zeros(2)
        self.gravity_direction = weight
        self.load = np.array([weight[0], weight[1], 0.0])

        hand = problem.hand
        self.joint_names = hand.joint_names
        self.joint_count = len(hand.joints)
        self.dof = 3 + self.joint_count
        self.lower = np.array([joint.lower for joint in hand.joints])
        self.upper = np.array([joint.upper for joint in hand.joints])
        self._compile_kinematics()
        self._compile_features()
        self._compile_pairs()

    def _compile_kinematics(self) -> None:
        """Tables for link frames: angles = base + C θ, origins = base + D (length · u(angle))."""
        n = self.joint_count
        fingers = self.problem.hand.fingers
        self._accumulate = np.zeros((n, n))
        self._base_angle = np.zeros(n)
        self._base = np.zeros(n, dtype=complex)
        lengths = np.zeros(n)
        k = 0
        for finger in fingers:
            first = k
            for link in finger.links:
                self._accumulate[k, first : k + 1] = 1.0
                self._base_angle[k] = finger.base_angle
                self._base[k] = complex(*finger.base) / self.size
                lengths[k] = link.length / self.size
                k += 1
        self._reach = (self._accumulate - np.eye(n)) * lengths

    def _compile_features(self) -> None:
        problem = self.problem
        hand = problem.hand
        links = [(f, link) for f in hand.fingers for link in f.links]
        outlines = [problem.object.vertices - problem.object.center_of_mass]
        outlines += list(hand.palm)
        outlines += [link.vertices for _, link in links]
        self.convex = np.concatenate([convex_vertices(outline) for outline in outlines])
        self.body_names = ('object', *hand.body_names)
        # Frame 0 is the world, 1 the object, 2 + k link k: the frame that a body is fixed in.
        frames = [1] + [0] * len(hand.palm) + [2 + k for k in range(len(links))]
        counts = [len(outline) for outline in outlines]
        self.first_vertex = np.concatenate([[0], np.cumsum(counts)])[:-1]
        self.body_of = np.repeat(np.arange(len(outlines)), counts)
        self._frame_of = np.array(frames)[self.body_of]
        self._local = as_complex(np.concatenate(outlines)) / self.size
        self.next_vertex = np.concatenate(
            [np.roll(np.arange(c), -1) + f for c, f in zip(counts, self.first_vertex, strict=True)]
        )
        edge = self._local[self.next_vertex] - self._local
        self.edge_length = np.abs(edge)
        self._local_normal = -1j * edge / self.edge_length
        self.previous_vertex = np.argsort(self.next_vertex)
        # moves[b, k]: joint k moves body b.
        self.moves = np.zeros((len(outlines), self.joint_count))
        self.moves[1 + len(hand.palm) :] = self._accumulate
        self._link_mass = np.array([link.mass for _, link in links])
        centroids = np.array([centroid(link.vertices) for _, link in links]).reshape(-1, 2)
        self._link_centroid = as_complex(centroids) / self.size

    def _compile_pairs(self) -> None:
        hand = self.problem.hand
        bodies = len(self.body_names)
        contact_bodies = [(0, b) for b in range(1, bodies)]
        link_body = 1 + len(hand.palm)
        labels: list[tuple[int, int]] = [
            (f, k) for f, finger in enumerate(hand.fingers) for k in range(len(finger.links))
        ]
        hand_bodies = []
        for i, (finger, k) in enumerate(labels):
            if k > 0:
                hand_bodies += [(b, link_body + i) for b in range(1, link_body)]
            for j, (other, m) in enumerate(labels[:i]):
                if other != finger or abs(m - k) > 1:
                    hand_bodies.append((link_body + j, link_body + i))
        vertex, edge = [], []
        self.contact_count = 0
        for pairs in (contact_bodies, hand_bodies):
            for a, b in pairs:
                for first, second in ((a, b), (b, a)):
                    v = np.flatnonzero((self.body_of == first) & self.convex)
                    e = np.flatnonzero(self.body_of == second)
                    vertex.append(np.repeat(v, len(e)))
                    edge.append(np.tile(e, len(v)))
            if pairs is contact_bodies:
                self.contact_count = sum(len(v) for v in vertex)
        self.pair_vertex: IntArray = np.concatenate(vertex)
        self.pair_edge: IntArray = np.concatenate(edge)
        vertex_body = self.body_of[self.pair_vertex]
        edge_body = self.body_of[self.pair_edge]
        self.pair_object_sign = (vertex_body == 0).astype(float) - (edge_body == 0)
        self.pair_moves = self.moves[vertex_body] - self.moves[edge_body]
        self.pair_body = np.where(vertex_body == 0, edge_body, vertex_body)
        self.pair_length = self.edge_length[self.pair_edge]

    @cached_property
    def finger_joints(self) -> tuple[IntArray, ...]:
        """Indices among `joint_names` of each finger's joints, but those that are held."""
        index = {name: k for k, name in enumerate(self.joint_names)}
        return tuple(
            np.array([index[j.name] for j in f.joints if j.name in index], dtype=np.intp)
            for f in self.problem.hand.fingers
        )

    @cached_property
    def _index_of_contact(self) -> dict[ElementalContact, int]:
        return {self.contact(k): k for k in range(self.contact_count)}

    def contact(self, pair: int) -> ElementalContact:
        """Name the elemental contact of a pair index below `contact_count`."""
        vertex, edge = int(self.pair_vertex[pair]), int(self.pair_edge[pair])
        first = self.first_vertex[self.body_of]
        return ElementalContact(
            body=self.body_names[self.pair_body[pair]],
            object_vertex=bool(self.pair_object_sign[pair] > 0),
            vertex=vertex - int(first[vertex]),
            edge=edge - int(first[edge]),
        )

    def contact_names(self, pairs: Sequence[int]) -> tuple[str, ...]:
        """Names of contacts, in the order given."""
        return tuple(str(self.contact(pair)) for pair in pairs)

    def pair(self, contact: ElementalContact) -> int:
        """Index of an elemental contact.

        Raises:
            CfplanError: The hand or the object has no such element, or the vertex is reflex and
                can touch no edge.
        """
        try:
            return self._index_of_contact[contact]
        except KeyError:
            raise CfplanError(
                f'contact {contact}: expected elements of the problem with a convex vertex; '
                f'bodies are {", ".join(self.body_names[1:])}'
            ) from None

    def configuration(self, grasp: Grasp) -> FloatArray:
        """Turn a grasp in SI units into z, shape (3 + n,)."""
        x, y, phi = grasp.object_pose
        com = self.problem.object.center_of_mass
        c, s = np.cos(phi), np.sin(phi)
        center = np.array([x + c * com[0] - s * com[1], y + s * com[0] + c * com[1]]) / self.size
        return np.concatenate([center, [phi], grasp.joints])

    @property
    def whole(self) -> ContactSystem:
        """The system with all joints: itself."""
        return self

    def reduced(self, z: FloatArray) -> FloatArray:
        """Leave out what is held of configurations of the whole system: nothing here."""
        return z

    def expanded(self, z: FloatArray) -> FloatArray:
        """Turn configurations of shape (s, 3 + n) into those of the whole system."""
        return z

    def object_poses(self, z: FloatArray) -> FloatArray:
        """Pose of the object's frame in SI units, shape (s, 3), for configurations (s, 3 + n)."""
        com = self.problem.object.center_of_mass
        c, s = np.cos(z[:, 2]), np.sin(z[:, 2])
        x = z[:, 0] * self.size - (c * com[0] - s * com[1])
        y = z[:, 1] * self.size - (s * com[0] + c * com[1])
        return np.stack([x, y, z[:, 2]], axis=1)

    def place(self, z: FloatArray) -> Placement:
        """World positions of all vertices and normals for configurations z, shape (s, 3 + n)."""
        turns = np.empty((len(z), 2 + self.joint_count), dtype=complex)
        turns[:, 0] = 1.0
        turns[:, 1] = 1j * z[:, 2]
        turns[:, 2:] = 1j * (z[:, 3:] @ self._accumulate.T + self._base_angle)
        np.exp(turns[:, 1:], out=turns[:, 1:])
        origins = np.empty_like(turns)
        origins[:, 0] = 0.0
        origins[:, 1] = z[:, 0] + 1j * z[:, 1]
        origins[:, 2:] = turns[:, 2:] @ self._reach.T + self._base
        turn = turns.take(self._frame_of, axis=1)
        vertices = origins.take(self._frame_of, axis=1) + turn * self._local
        return Placement(origins[:, 1], origins[:, 2:], vertices, turn * self._local_normal)

    def link_weight_torques(self, z: FloatArray) -> FloatArray:
        """Torques that hold the links' own weight.

        Args:
            z: Shape (s, 3 + n).

        Returns:
            Shape (s, n), in units of force times size: minus the gravity load on each joint.
        """
        if not self._link_mass.any():
            return np.zeros((len(z), self.joint_count))
        axes = self.place(z).axes
        turns = np.exp(1j * (z[:, 3:] @ self._accumulate.T + self._base_angle))
        centers = axes + turns * self._link_centroid
        pull = self._link_mass * complex(*self.problem.gravity) / self.force_unit
        arms = centers[:, :, None] - axes[:, None, :]
        load = (arms.conj() * pull[:, None]).imag
        return np.asarray(-(load * self._accumulate).sum(axis=1))
