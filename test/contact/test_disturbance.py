"""What errors do to contacts, against problems that have these errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from planning.scenes import FEET, TIPS, at, pushed_angles, pushed_block

from cfplan_core.contact.disturbance import FRICTION, GEOMETRY, disturbance
from cfplan_core.contact.elements import parse_contact
from cfplan_core.contact.gaps import gap_gradients
from cfplan_core.contact.system import ContactSystem, IntArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.model import Problem

STEP = 1e-6


def block() -> tuple[Problem, ContactSystem, FloatArray, IntArray]:
    """The pushed block on its way to the right, and its four contacts."""
    problem = pushed_block()
    system = ContactSystem(problem)
    z = np.array([at(system, x, pushed_angles(x)) for x in (0.001, 0.002, 0.003)])
    return problem, system, z, np.array([system.pair(parse_contact(c)) for c in (*FEET, *TIPS)])


def gradient_with(problem: Problem, change: FloatArray, z: FloatArray, pair: int) -> FloatArray:
    """Gradient of a gap with the object's vertices moved, in units of the planned size."""
    size = problem.object.size
    thing = replace(problem.object, vertices=problem.object.vertices + size * change)
    system = ContactSystem(replace(problem, object=thing))
    units = np.array([size, size, 1.0, 1.0, 1.0]) / [system.size, system.size, 1.0, 1.0, 1.0]
    found = gap_gradients(system, system.place((z * units)[None]), np.array([pair]))[0, 0]
    return np.asarray(found * [1.0, 1.0, *[system.size / size] * 3])


def test_an_edge_of_the_object_that_is_turned_turns_the_wrench() -> None:
    """Edge 3 goes from the top left corner down to v0: its ends move apart, to either side."""
    problem, system, z, pairs = block()
    change = np.zeros((4, 2))
    # Turned anticlockwise about the contact, so that the gap stays zero.
    contact = system.place(z).vertices[1, system.pair_vertex[pairs[2]]]
    ends = system.place(z).vertices[1, [3, 0]]
    arms = ends - contact
    change[[3, 0]] = STEP * np.stack([-arms.imag, arms.real], axis=1)
    found = gradient_with(problem, change, z[1], pairs[2])
    before = gradient_with(problem, 0.0 * change, z[1], pairs[2])
    unit = disturbance(system, z, pairs).turned[1, 2] / (2.0 * GEOMETRY / abs(ends[1] - ends[0]))
    np.testing.assert_allclose((found - before) / STEP, unit, atol=1e-4)


def test_a_foot_farther_along_the_palm_has_another_moment() -> None:
    problem, system, z, pairs = block()
    change = np.zeros((4, 2))
    change[1] = STEP, 0.0
    found = gradient_with(problem, change, z[1], pairs[1])
    before = gradient_with(problem, 0.0 * change, z[1], pairs[1])
    by_unit = disturbance(system, z, pairs).shifted[1, 1] / GEOMETRY
    # Along the palm's upper edge is to the left.
    np.testing.assert_allclose((found - before) / STEP, -by_unit, atol=1e-6)


def test_a_tip_farther_along_an_edge_has_another_lever() -> None:
    problem, system, z, pairs = block()
    placed = system.place(z)
    edge = system.pair_edge[pairs[2]]
    along = 1j * placed.normals[1, edge] * np.exp(-1j * z[1, 3])

    def gradient(step: float) -> FloatArray:
        left, right = problem.hand.fingers
        vertices = left.links[0].vertices.copy()
        vertices[1] += step * problem.object.size * np.array([along.real, along.imag])
        moved = replace(left, links=(replace(left.links[0], vertices=vertices),))
        changed = replace(problem, hand=replace(problem.hand, fingers=(moved, right)))
        other = ContactSystem(changed)
        return np.asarray(gap_gradients(other, other.place(z[1:2]), pairs[2:3])[0, 0])

    by_unit = disturbance(system, z, pairs).shifted[1, 2] / GEOMETRY
    assert abs(by_unit[3]) > 0.5
    np.testing.assert_allclose((gradient(STEP) - gradient(0.0)) / STEP, by_unit, atol=1e-6)


def test_friction_at_the_feet_pulls_against_the_way_of_the_block() -> None:
    _, system, z, pairs = block()
    for way, sign in ((z, -1.0), (z[::-1], 1.0)):
        leaning = disturbance(system, way, pairs).leaning[1]
        # At the feet, half a width on either side of the centre and below it.
        low = z[1, 1]
        for foot in (0, 1):
            expected = [sign * FRICTION, 0.0, sign * FRICTION * low, 0.0, 0.0]
            np.testing.assert_allclose(leaning[foot], expected, atol=1e-9)


def test_without_motion_friction_has_no_direction() -> None:
    _, system, z, pairs = block()
    np.testing.assert_array_equal(disturbance(system, z[:1], pairs).leaning, 0.0)
