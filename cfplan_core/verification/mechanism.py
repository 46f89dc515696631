"""Forward kinematics of hand and object, with complex numbers: x + iy for a point."""

from __future__ import annotations

import cmath
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial.distance import pdist

from cfplan_core.model import Problem

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Body:
    """A palm body or a link.

    Attributes:
        name: ``palm.N`` or ``finger.link``.
        finger: Index of its finger, or None for the palm.
        chain: Columns of the joints that move it, proximal first.
        outline: Shape (v,), complex, m, in the world frame (palm) or the link's frame.
        mass: kg.
        centroid: Complex, m, same frame.
    """

    name: str
    finger: int | None
    chain: tuple[int, ...]
    outline: ComplexArray
    mass: float
    centroid: complex


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything placed in the world.

    Attributes:
        pose: Shape (3,), of the object frame: m, m, rad.
        joints: Shape (n,), rad.
        object: Shape (v, 2), vertices, m.
        center: Complex, the object's centre of mass, m.
        outlines: Body name to vertices, shape (v, 2), m.
        axes: Shape (n,), complex, axis of every joint, m.
        masses: Pairs of a body and its centroid (complex, m), for the links that have mass.
    """

    pose: FloatArray
    joints: FloatArray
    object: FloatArray
    center: complex
    outlines: dict[str, FloatArray]
    axes: ComplexArray
    masses: tuple[tuple[Body, complex], ...]


@dataclass(frozen=True, eq=False)
class Mechanism:
    """A problem's bodies and lengths.

    Attributes:
        problem: Where it comes from.
        bodies: Palm and links by name.
        size: Largest distance between two vertices of the object, m.
        lever: Largest distance of a point of the hand or the object from an axis it turns
            about, at most, m.
    """

    problem: Problem
    bodies: dict[str, Body]
    size: float
    lever: float

    def scene(self, pose: FloatArray, joints: FloatArray) -> Scene:
        """Place everything.

        Args:
            pose: Shape (3,), of the object frame: m, m, rad.
            joints: Shape (n,), rad.
        """
        thing = self.problem.object
        turn, shift = cmath.exp(1j * float(pose[2])), complex(pose[0], pose[1])
        outlines, masses = {}, []
        for body in self.bodies.values():
            if body.finger is None:
                outlines[body.name] = _pairs(body.outline)
        axes = np.empty(len(joints), dtype=np.complex128)
        column = 0
        for finger in self.problem.hand.fingers:
            axis = complex(finger.base[0], finger.base[1])
            angle = finger.base_angle
            for link in finger.links:
                angle += float(joints[column])
                direction = cmath.exp(1j * angle)
                body = self.bodies[f'{finger.name}.{link.name}']
                axes[column] = axis
                outlines[body.name] = _pairs(axis + direction * body.outline)
                if body.mass > 0.0:
                    masses.append((body, axis + direction * body.centroid))
                axis += link.length * direction
                column += 1
        return Scene(
            pose=pose,
            joints=joints,
            object=_pairs(shift + turn * _complex(thing.vertices)),
            center=shift + turn * complex(*thing.center_of_mass),
            outlines=outlines,
            axes=axes,
            masses=tuple(masses),
        )


def mechanism_of(problem: Problem) -> Mechanism:
    """Take a problem's bodies and lengths."""
    bodies = {}
    for k, vertices in enumerate(problem.hand.palm):
        bodies[f'palm.{k}'] = Body(f'palm.{k}', None, (), _complex(vertices), 0.0, 0j)
    thing = problem.object
    lever = float(np.linalg.norm(thing.vertices - thing.center_of_mass, axis=1).max())
    column = 0
    for f, finger in enumerate(problem.hand.fingers):
        chain: tuple[int, ...] = ()
        stretched = 0.0
        for link in finger.links:
            chain = (*chain, column)
            name = f'{finger.name}.{link.name}'
            centroid = shapely.Polygon(link.vertices).centroid
            outline = _complex(link.vertices)
            bodies[name] = Body(
                name, f, chain, outline, link.mass, complex(centroid.x, centroid.y)
            )
            lever = max(lever, stretched + float(np.abs(outline).max()))
            stretched += abs(link.length)
            column += 1
    return Mechanism(problem, bodies, float(pdist(thing.vertices).max()), lever)


def _complex(points: FloatArray) -> ComplexArray:
    return np.asarray(points[:, 0] + 1j * points[:, 1])


def _pairs(points: ComplexArray) -> FloatArray:
    return np.column_stack([points.real, points.imag])
