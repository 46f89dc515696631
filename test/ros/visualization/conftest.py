from __future__ import annotations

import numpy as np
import pytest
from ros.visualization.examples import PROBLEMS, Planned, planned_file

from cfplan_core import Problem
from cfplan_core.model import Finger, Goal, Grasp, Hand, Joint, Link, ManipulatedObject


@pytest.fixture(params=PROBLEMS, ids=lambda path: path.stem)
def planned(request: pytest.FixtureRequest) -> Planned:
    """Each of the example problems with its plan."""
    return planned_file(request.param)


@pytest.fixture
def story() -> Planned:
    """The problem of 1991 with its plan."""
    return planned_file(next(p for p in PROBLEMS if p.stem == 'trinkle_hunter_1991'))


@pytest.fixture
def rich() -> Problem:
    """Concave bodies, two palms, fingers of three, one and two links."""

    def finger(name: str, base: tuple[float, float], angle: float, *lengths: float) -> Finger:
        hook = [(0.0, -0.004), (0.05, -0.004), (0.05, 0.01), (0.04, 0.0), (0.0, 0.004)]
        return Finger(
            name,
            base,
            angle,
            tuple(Joint(f'{name}_{k}', -3.0, 3.0, 1.0, 5.0) for k in range(len(lengths))),
            tuple(Link(f'link_{k}', length, hook) for k, length in enumerate(lengths)),
        )

    step = [(-0.3, 0.0), (-0.3, -0.1), (0.3, -0.1), (0.3, 0.03), (0.1, 0.03), (0.1, 0.0)]
    wedge = [(-0.1, 0.1), (-0.05, 0.05), (-0.02, 0.12)]
    comb = [(0.0, 0.0), (0.05, 0.0), (0.05, 0.03), (0.04, 0.03), (0.04, 0.01), (0.03, 0.01)]
    comb += [(0.03, 0.03), (0.02, 0.03), (0.02, 0.01), (0.01, 0.01), (0.01, 0.03), (0.0, 0.03)]
    hand = Hand(
        (step, wedge),
        (
            finger('left', (-0.1, 0.01), 0.4, 0.05, 0.04, 0.03),
            finger('thumb', (0.0, 0.1), -1.2, 0.06),
            finger('right', (0.12, -0.02), 2.0, 0.07, 0.05),
        ),
    )
    thing = ManipulatedObject(comb, 0.15)
    grasp = Grasp((0.01, 0.02, 7.3), np.array([0.3, -0.7, 1.1, 0.2, -2.0, 2.9]))
    return Problem('rich', (0.0, -9.81), hand, thing, 0.0, grasp, Goal(grasp.object_pose))
