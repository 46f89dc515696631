from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cfplan_core.model import Finger, Goal, Grasp, Hand, Joint, Link, ManipulatedObject, Problem
from cfplan_core.verification.mechanism import Mechanism, mechanism_of

ANGLES = st.lists(st.floats(-3.0, 3.0), min_size=4, max_size=4)


def joint(name: str) -> Joint:
    return Joint(name, -3.0, 3.0, 1.0, 5.0)


def link(name: str, length: float, mass: float = 0.0) -> Link:
    outline = [(-0.002, -0.003), (length, -0.001), (length + 0.004, 0.002), (0.001, 0.004)]
    return Link(name, length, outline, mass)


@pytest.fixture(scope='module')
def mechanism() -> Mechanism:
    long = Finger(
        'long',
        (0.03, -0.01),
        0.4,
        (joint('a'), joint('b'), joint('c')),
        (link('one', 0.05), link('two', 0.03, 0.1), link('three', 0.02, 0.05)),
    )
    short = Finger('short', (-0.03, 0.0), 2.0, (joint('d'),), (link('one', 0.04),))
    table = [(-0.1, -0.1), (0.1, -0.1), (0.1, 0.0)]
    thing = ManipulatedObject([(0.0, 0.0), (0.03, 0.0), (0.0, 0.04)], 0.1)
    grasp = Grasp((0.0, 0.0, 0.0), np.zeros(4))
    problem = Problem('m', (0.0, -9.81), Hand((table,), (long, short)), thing, 0.0, grasp, Goal())
    return mechanism_of(problem)


@settings(max_examples=50)
@given(angles=ANGLES, pose=st.lists(st.floats(-3.0, 3.0), min_size=3, max_size=3))
def test_bodies_are_where_the_model_puts_them(
    mechanism: Mechanism, angles: list[float], pose: list[float]
) -> None:
    scene = mechanism.scene(np.array(pose), np.array(angles))
    expected = mechanism.problem.hand.world_vertices(np.array(angles))
    assert list(scene.outlines) == list(expected)
    for name, outline in expected.items():
        np.testing.assert_allclose(scene.outlines[name], outline, atol=1e-14)
    thing = mechanism.problem.object.world_vertices(np.array(pose))
    np.testing.assert_allclose(scene.object, thing, atol=1e-14)


def test_size_is_the_longest_side_of_the_triangle(mechanism: Mechanism) -> None:
    assert mechanism.size == pytest.approx(0.05)


def test_lever_is_the_reach_of_the_stretched_finger(mechanism: Mechanism) -> None:
    assert mechanism.lever == pytest.approx(0.05 + 0.03 + math.hypot(0.024, 0.002))


def test_link_turns_with_the_joints_before_it_only(mechanism: Mechanism) -> None:
    chains = {name: body.chain for name, body in mechanism.bodies.items()}
    assert chains == {
        'palm.0': (),
        'long.one': (0,),
        'long.two': (0, 1),
        'long.three': (0, 1, 2),
        'short.one': (3,),
    }
