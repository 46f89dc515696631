"""What a plan does not know of the world it is executed in."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from cfplan_core.errors import CfplanError
from cfplan_core.geometry.polygon import (
    FloatArray,
    convex_vertices,
    first_self_intersection,
    signed_area,
)
from cfplan_core.model import Problem

_ATTEMPTS = 100


@dataclass(frozen=True)
class Uncertainty:
    """How far the executed world may be from the planned one; errors are uniform within these.

    Attributes:
        friction: Coulomb coefficient of every contact: this, not up to this.
        mass_error: Of the object's mass, as a part of it.
        geometry_error: Of each coordinate of every vertex of object and links, in sizes of the
            object.
        joint_noise: Of each joint's zero, rad.
    """

    friction: float = 0.0
    mass_error: float = 0.0
    geometry_error: float = 0.0
    joint_noise: float = 0.0

    def __post_init__(self) -> None:
        for field, most in (
            ('friction', 10.0),
            ('mass_error', 0.99),
            ('geometry_error', 0.2),
            ('joint_noise', 1.0),
        ):
            value = getattr(self, field)
            if not (math.isfinite(value) and 0.0 <= value <= most):
                raise CfplanError(f'{field}: got {value}, expected 0 to {most:g}')

    @property
    def random(self) -> bool:
        """True if no two draws are alike."""
        return bool(self.mass_error or self.geometry_error or self.joint_noise)

    @property
    def none(self) -> bool:
        """True if the executed world is the planned one."""
        return not (self.random or self.friction)


@dataclass(frozen=True, eq=False)
class World:
    """A world drawn from an uncertainty.

    Attributes:
        problem: With the masses and outlines that things really have.
        friction: Coulomb coefficient of every contact.
        joint_errors: Shape (n,), rad: what each joint's sensor says above its angle.
    """

    problem: Problem
    friction: float
    joint_errors: FloatArray


def draw(problem: Problem, uncertainty: Uncertainty, generator: np.random.Generator) -> World:
    """Draw a world.

    Args:
        problem: As planned.
        uncertainty: How far from it.
        generator: Its state decides.

    Raises:
        CfplanError: Outlines disturbed so much do not stay polygons with the same convex corners.
    """
    mass = problem.object.mass * (1.0 + uncertainty.mass_error * generator.uniform(-1.0, 1.0))
    reach = uncertainty.geometry_error * problem.object.size

    def disturbed(vertices: FloatArray) -> FloatArray:
        return _disturbed(vertices, reach, generator.uniform) if reach else vertices

    thing = replace(problem.object, vertices=disturbed(problem.object.vertices), mass=mass)
    fingers = tuple(
        replace(
            finger,
            links=tuple(replace(link, vertices=disturbed(link.vertices)) for link in finger.links),
        )
        for finger in problem.hand.fingers
    )
    hand = replace(problem.hand, fingers=fingers)
    noise = uncertainty.joint_noise * generator.uniform(-1.0, 1.0, len(hand.joints))
    return World(replace(problem, hand=hand, object=thing), uncertainty.friction, noise)


def _disturbed(
    vertices: FloatArray, reach: float, uniform: Callable[..., FloatArray]
) -> FloatArray:
    """Shift every vertex so that the outline stays simple and convex corners stay convex."""
    convex = convex_vertices(vertices)
    for _ in range(_ATTEMPTS):
        shifted = vertices + reach * uniform(-1.0, 1.0, vertices.shape)
        if (
            signed_area(shifted) > 0.0
            and (convex_vertices(shifted) == convex).all()
            and first_self_intersection(shifted) is None
        ):
            return np.asarray(shifted)
    raise CfplanError(
        f'geometry_error: outlines disturbed by {reach:g} m do not stay polygons with the same '
        'convex corners; expected less'
    )
