"""A manipulation problem: hand, object, gravity, start grasp and goal."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from cfplan_core.errors import CfplanError
from cfplan_core.geometry.polygon import FloatArray, centroid, diameter
from cfplan_core.model.hand import Hand, frozen_array, transformed


@dataclass(frozen=True, eq=False)
class ManipulatedObject:
    """A rigid polygon.

    Attributes:
        vertices: Shape (v, 2), object frame, m, counter-clockwise.
        mass: kg.
        center_of_mass: Shape (2,), object frame, m; the centroid if not given.
    """

    vertices: FloatArray
    mass: float
    center_of_mass: FloatArray = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        object.__setattr__(self, 'vertices', frozen_array(self.vertices, (-1, 2)))
        com = centroid(self.vertices) if self.center_of_mass is None else self.center_of_mass
        object.__setattr__(self, 'center_of_mass', frozen_array(com, (2,)))

    @cached_property
    def size(self) -> float:
        """Largest distance between two vertices, m."""
        return diameter(self.vertices)

    def world_vertices(self, object_pose: FloatArray) -> FloatArray:
        """World vertices, shape (v, 2), m, for a pose (x, y, φ) of the object's frame."""
        return transformed(self.vertices, object_pose[:2], float(object_pose[2]))


@dataclass(frozen=True, eq=False)
class Grasp:
    """A configuration of object and hand.

    Attributes:
        object_pose: Shape (3,): x, y in m and φ in rad of the object frame in the world.
        joints: Shape (n,), rad, in the order of `Hand.joints`.
    """

    object_pose: FloatArray
    joints: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, 'object_pose', frozen_array(self.object_pose, (3,)))
        object.__setattr__(self, 'joints', frozen_array(self.joints, (-1,)))


@dataclass(frozen=True)
class Tolerance:
    """How near the plan's last frame must come to the goal: m, rad, rad."""

    position: float = 1e-4
    angle: float = 1e-3
    joints: float = 1e-3

    @property
    def wide(self) -> bool:
        """True if more is allowed than a goal's numbers may be off for being rounded."""
        usual = Tolerance()
        return (
            self.position > usual.position
            or self.angle > usual.angle
            or self.joints > usual.joints
        )


@dataclass(frozen=True, eq=False)
class Goal:
    """What the last frame must be; at least one of the parts is given, the others are free.

    Attributes:
        object_pose: Shape (3,), as in `Grasp`, or None for any.
        joints: Joint name to angle in rad; joints that are not named are free.
        contacts: Names of elemental contacts that must all touch, or None for any.
        tolerance: How exactly.
        position: Shape (2,), x, y in m of the object's frame where its angle is free; beside
            `object_pose` it is refused.
        orientation: Angle of the object's frame in rad, turns counted, where its position is
            free; beside `object_pose` it is refused.
        exact_contacts: True if nothing but `contacts` may touch, so that they are the contact
            formation.

    Raises:
        CfplanError: Position or orientation is given twice, or contacts are to be exact and none
            is given.
    """

    object_pose: FloatArray | None = None
    joints: Mapping[str, float] | None = None
    contacts: tuple[str, ...] | None = None
    tolerance: Tolerance = field(default_factory=Tolerance)
    position: FloatArray | None = None
    orientation: float | None = None
    exact_contacts: bool = False

    def __post_init__(self) -> None:
        for name, shape in (('object_pose', (3,)), ('position', (2,))):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, frozen_array(value, shape))
        for name in ('position', 'orientation'):
            if self.object_pose is not None and getattr(self, name) is not None:
                raise CfplanError(
                    f'goal: got {name} beside object_pose, expected one of them: a pose has both'
                )
        if self.exact_contacts and not self.contacts:
            raise CfplanError('goal: got exact_contacts without contacts, expected their names')

    @property
    def object_position(self) -> FloatArray | None:
        """Shape (2,), x, y in m wanted of the object's frame, or None for any."""
        return self.position if self.object_pose is None else self.object_pose[:2]

    @property
    def object_angle(self) -> float | None:
        """Angle in rad wanted of the object's frame, or None for any."""
        return self.orientation if self.object_pose is None else float(self.object_pose[2])

    def grasp(self, hand: Hand) -> Grasp | None:
        """Return the goal as a grasp if pose and every joint are given, else None."""
        position, angle = self.object_position, self.object_angle
        if position is None or angle is None or self.joints is None:
            return None
        if any(name not in self.joints for name in hand.joint_names):
            return None
        joints = np.array([self.joints[name] for name in hand.joint_names])
        return Grasp(np.append(position, angle), joints)


@dataclass(frozen=True, eq=False)
class Problem:
    """All that a plan depends on.

    Attributes:
        name: For people and file names.
        gravity: Shape (2,), m/s².
        hand: Palm and fingers.
        object: What is manipulated.
        friction: Coulomb coefficient of every contact; the frictionless model takes 0 only.
        start: First grasp.
        goal: Last grasp, or part of one.
    """

    name: str
    gravity: FloatArray
    hand: Hand
    object: ManipulatedObject
    friction: float
    start: Grasp
    goal: Goal

    def __post_init__(self) -> None:
        object.__setattr__(self, 'gravity', frozen_array(self.gravity, (2,)))
