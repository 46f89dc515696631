"""What must accelerate slowly for motion to be quasi-static: the object, and links with mass.

A body of mass m whose centre accelerates with a pushes back with the force m a, and with the
moment I α when it turns. Motion is quasi-static where these are a small share ε of the weight:
|a| ≤ ε g, kept for x and y apart with 1 / √2 of it, and I |α| ≤ ε m g L, L being the body's size.
Without gravity one newton takes the place of the weight.
"""

from __future__ import annotations

import numpy as np

from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray, centroid, diameter, second_moment


def moving_masses(
    system: ContactSystem, z: FloatArray, share: float
) -> tuple[FloatArray, FloatArray]:
    """Coordinates of all bodies that have mass and move, and limits of their acceleration.

    Density is taken as uniform; where the centre of mass is not the centroid, the moment of
    inertia is that of the uniform body about the centre of mass.

    Args:
        system: Compiled problem, with all joints.
        z: Shape (f, 3 + n).
        share: ε.

    Returns:
        Shapes (f, 3 b) and (3 b,): x and y of the centre of mass in m and the angle in rad of
        each of the b bodies, and limits in m/s² and rad/s².
    """
    problem = system.problem
    gravity = float(np.hypot(*problem.gravity))
    vertices, mass = problem.object.vertices, problem.object.mass
    coordinates = [z[:, :2] * system.size, z[:, 2:3]]
    limits = _limits(vertices, mass, problem.object.center_of_mass, gravity, share)
    links = [link for finger in problem.hand.fingers for link in finger.links]
    heavy = [k for k, link in enumerate(links) if link.mass > 0.0]
    placed = [problem.hand.link_frames(joints) for joints in z[:, 3:]] if heavy else []
    for k in heavy:
        middle = centroid(links[k].vertices)
        origin = np.array([origins[k] for origins, _ in placed])
        angle = np.array([angles[k] for _, angles in placed])
        arm = complex(*middle) * np.exp(1j * angle)
        coordinates += [origin + np.column_stack([arm.real, arm.imag]), angle[:, None]]
        limits += _limits(links[k].vertices, links[k].mass, middle, gravity, share)
    return np.concatenate(coordinates, axis=1), np.array(limits)


def _limits(
    vertices: FloatArray, mass: float, center: FloatArray, gravity: float, share: float
) -> list[float]:
    weight = mass * gravity if gravity > 0.0 else 1.0
    along = share * weight / mass / np.sqrt(2.0)
    turning = share * weight * diameter(vertices) / (mass * second_moment(vertices, center))
    return [along, along, turning]
