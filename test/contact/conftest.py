"""A hand with everything: several palms, fingers of three, one and two joints."""

from __future__ import annotations

import numpy as np
import pytest

from cfplan_core.contact.system import ContactSystem
from cfplan_core.model import Finger, Goal, Grasp, Hand, Joint, Link, ManipulatedObject, Problem

L_SHAPE = [(0.0, 0.0), (0.05, 0.0), (0.05, 0.02), (0.02, 0.02), (0.02, 0.04), (0.0, 0.04)]
STEP = [(-0.3, 0.0), (-0.3, -0.1), (0.3, -0.1), (0.3, 0.03), (0.1, 0.03), (0.1, 0.0)]
WEDGE = [(-0.1, 0.1), (-0.05, 0.05), (-0.02, 0.12)]


def finger(
    name: str, base: tuple[float, float], base_angle: float, *links: tuple[float, float]
) -> Finger:
    """Links of given length and mass, all 6 mm wide at the joint, 4 mm at the end."""
    return Finger(
        name,
        base,
        base_angle,
        tuple(Joint(f'{name}_{k}', -3.0, 3.0, 1.0, 5.0) for k in range(len(links))),
        tuple(
            Link(
                f'link_{k}',
                length,
                [(0.0, -0.003), (length, -0.001), (length, 0.003), (0.0, 0.003)],
                mass,
            )
            for k, (length, mass) in enumerate(links)
        ),
    )


@pytest.fixture(scope='session')
def rich_problem() -> Problem:
    """An L-shaped object, its centre of mass off the centroid, six joints, two palms."""
    hand = Hand(
        (STEP, WEDGE),
        (
            finger('left', (-0.1, 0.01), 0.4, (0.05, 0.03), (0.04, 0.02), (0.03, 0.01)),
            finger('thumb', (0.0, 0.1), -1.2, (0.06, 0.05)),
            finger('right', (0.12, -0.02), 2.0, (0.07, 0.0), (0.05, 0.04)),
        ),
    )
    thing = ManipulatedObject(L_SHAPE, 0.15, (0.021, 0.008))
    grasp = Grasp((0.01, 0.02, 0.3), np.zeros(6))
    return Problem('rich', (1.5, -9.6), hand, thing, 0.0, grasp, Goal(grasp.object_pose))


@pytest.fixture(scope='session')
def rich(rich_problem: Problem) -> ContactSystem:
    return ContactSystem(rich_problem)
