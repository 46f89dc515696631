"""A planar hand: fixed palm bodies and fingers of revolute joints."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cfplan_core.geometry.polygon import FloatArray


def frozen_array(values: object, shape: tuple[int, ...]) -> FloatArray:
    """Copy values into a read-only float array.

    Args:
        values: Anything that numpy takes.
        shape: Expected shape; -1 matches any length.

    Raises:
        ValueError: The shape differs.
    """
    array = np.array(values, dtype=np.float64)
    fits = array.ndim == len(shape) and all(
        want in (-1, have) for want, have in zip(shape, array.shape, strict=True)
    )
    if not fits:
        raise ValueError(f'must have shape {shape}, got {array.shape}')
    array.setflags(write=False)
    return array


@dataclass(frozen=True, eq=False)
class Joint:
    """A revolute joint.

    Attributes:
        name: Unique in the hand.
        lower: Smallest angle, rad.
        upper: Largest angle, rad.
        velocity_limit: Largest speed, rad/s.
        effort_limit: Largest torque, N·m.
        acceleration_limit: Largest acceleration, rad/s², or None.
    """

    name: str
    lower: float
    upper: float
    velocity_limit: float
    effort_limit: float
    acceleration_limit: float | None = None


@dataclass(frozen=True, eq=False)
class Link:
    """A rigid link; its frame has its origin at the link's joint and x along the link.

    Attributes:
        name: Unique in its finger.
        length: The next joint's axis lies at (length, 0) in this frame, m.
        vertices: Shape (v, 2), link frame, m, counter-clockwise.
        mass: kg; weight acts at the polygon's centroid.
    """

    name: str
    length: float
    vertices: FloatArray
    mass: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, 'vertices', frozen_array(self.vertices, (-1, 2)))


@dataclass(frozen=True, eq=False)
class Finger:
    """A serial chain, proximal joint first.

    Attributes:
        name: Unique in the hand.
        base: Shape (2,), axis of the first joint in the world frame, m.
        base_angle: Direction of the first link at joint angle zero, rad.
        joints: One per link.
        links: As many as joints.
    """

    name: str
    base: FloatArray
    base_angle: float
    joints: tuple[Joint, ...]
    links: tuple[Link, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, 'base', frozen_array(self.base, (2,)))
        object.__setattr__(self, 'joints', tuple(self.joints))
        object.__setattr__(self, 'links', tuple(self.links))
        if len(self.joints) != len(self.links):
            raise ValueError(
                f'finger {self.name} must have one joint per link, got {len(self.joints)} joints '
                f'and {len(self.links)} links'
            )


@dataclass(frozen=True, eq=False)
class Hand:
    """A palm and fingers.

    Attributes:
        palm: Polygons fixed in the world frame, each of shape (v, 2), m, counter-clockwise.
        fingers: Any number. The hand's joints are those of the fingers, in order.
    """

    palm: tuple[FloatArray, ...]
    fingers: tuple[Finger, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, 'palm', tuple(frozen_array(v, (-1, 2)) for v in self.palm))
        object.__setattr__(self, 'fingers', tuple(self.fingers))

    @cached_property
    def joints(self) -> tuple[Joint, ...]:
        """All joints, finger by finger, proximal first: the order of every joint vector."""
        return tuple(joint for finger in self.fingers for joint in finger.joints)

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Names of `joints`, same order."""
        return tuple(joint.name for joint in self.joints)

    @cached_property
    def body_names(self) -> tuple[str, ...]:
        """Names of the hand's bodies: ``palm.0`` ..., then ``finger.link`` in joint order."""
        palm = tuple(f'palm.{k}' for k in range(len(self.palm)))
        links = tuple(f'{f.name}.{link.name}' for f in self.fingers for link in f.links)
        return palm + links

    def link_frames(self, joints: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Pose of every link frame in the world.

        Args:
            joints: Shape (n,), rad.

        Returns:
            Origins, shape (n, 2), m, and angles, shape (n,), rad; row k belongs to joint k.
        """
        origins = np.empty((len(self.joints), 2))
        angles = np.empty(len(self.joints))
        k = 0
        for finger in self.fingers:
            origin, angle = finger.base, finger.base_angle
            for link in finger.links:
                angle = angle + joints[k]
                origins[k], angles[k] = origin, angle
                origin = origin + link.length * np.array([np.cos(angle), np.sin(angle)])
                k += 1
        return origins, angles

    def world_vertices(self, joints: FloatArray) -> dict[str, FloatArray]:
        """Vertices of every body in the world frame.

        Args:
            joints: Shape (n,), rad.

        Returns:
            Body name to array of shape (v, 2), m, in the order of `body_names`.
        """
        placed = {f'palm.{k}': vertices for k, vertices in enumerate(self.palm)}
        origins, angles = self.link_frames(joints)
        k = 0
        for finger in self.fingers:
            for link in finger.links:
                placed[f'{finger.name}.{link.name}'] = transformed(
                    link.vertices, origins[k], angles[k]
                )
                k += 1
        return placed


def transformed(vertices: FloatArray, origin: FloatArray, angle: float) -> FloatArray:
    """Place body-fixed points: rotate by an angle (rad), then shift by an origin (m)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(vertices @ np.array([[c, s], [-s, c]]) + origin)
