from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from planning.pegs import (
    HALF,
    ON_PEG,
    ON_TIP,
    UPRIGHT,
    balanced,
    cradle,
    formation,
    hanger,
    lowest_nearby,
    rocker,
    seat,
)

from cfplan_core.contact.curvature import wrench_rates
from cfplan_core.contact.gaps import gap_gradients
from cfplan_core.contact.system import ContactSystem, IntArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.mechanics.second_order import (
    curvature,
    imbalance,
    pair_forces,
    second_order_margin,
    unbalanced_margin,
)
from cfplan_core.model import Grasp, Problem
from cfplan_core.planning.tracing import stability_margins

SEAT = ('object.e2|palm.0.v2', 'object.e3|palm.1.v3')
HANGER = ('object.e0|palm.0.v2', 'object.e4|palm.1.v2')
ROCKER = ('object.v2|palm.0.e0', 'object.v0|palm.1.e2')


def at_start(problem: Problem, *names: str) -> tuple[ContactSystem, FloatArray, IntArray]:
    system = ContactSystem(problem)
    pairs = formation(system, *names).array
    return system, system.configuration(problem.start), pairs


def pair_of(
    system: ContactSystem, z: FloatArray, pairs: IntArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Arguments of the functions of two contacts at one configuration."""
    placed = system.place(z[None])
    wrenches = gap_gradients(system, placed, pairs)[..., :3]
    return wrenches, wrench_rates(system, placed, pairs), system.load


def curvature_by_angle(system: ContactSystem, z: FloatArray, pairs: IntArray) -> float:
    """Second derivative of the energy by the object's angle, in weights times sizes."""
    wrenches, rates, load = pair_of(system, z, pairs)
    tangent = np.cross(*wrenches[0])
    return float(curvature(wrenches, rates, load)[0] * (tangent @ tangent) / tangent[2] ** 2)


@pytest.mark.parametrize('width', [0.006, 0.01, 0.013, 0.016, 0.024])
def test_square_on_two_pegs_has_the_curvature_of_its_height(width: float) -> None:
    """The centre's height is d cos φ − (w/2) cos 2φ; d is half the diagonal."""
    system, z, pairs = at_start(seat(width), *SEAT)
    expected = (2.0 * width - HALF) / system.size
    assert curvature_by_angle(system, z, pairs) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize('depth', [-0.005, 0.01, 0.024, 0.04])
def test_object_on_two_pegs_under_its_roof_has_the_curvature_of_its_height(depth: float) -> None:
    """Its height is (w/2) cos 2φ − D cos φ: it hangs safely where D > 2 w."""
    system, z, pairs = at_start(hanger(0.012, depth), *HANGER)
    expected = (depth - 2.0 * 0.012) / system.size
    assert curvature_by_angle(system, z, pairs) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize('depth', [0.0, 0.02, 0.03, 0.05])
def test_bar_in_a_v_has_the_curvature_of_its_height(depth: float) -> None:
    """Its height is (L/2) cos φ − D cos φ: it rocks where its mass is below the V's corner."""
    system, z, pairs = at_start(rocker(0.06, depth), *ROCKER)
    expected = (depth - 0.03) / system.size
    assert curvature_by_angle(system, z, pairs) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(('width', 'stable'), [(0.0099, False), (0.0101, True), (0.016, True)])
def test_square_stands_on_pegs_more_than_half_its_half_diagonal_apart(
    width: float, stable: bool
) -> None:
    system, z, pairs = at_start(seat(width), *SEAT)
    margin = float(second_order_margin(*pair_of(system, z, pairs))[0])
    assert (margin > 0.0) == stable
    assert abs(margin) < 0.35


def test_margin_vanishes_in_proportion_where_the_seat_becomes_too_narrow() -> None:
    margins = []
    for excess in (1e-4, 1e-5, 1e-6):
        system, z, pairs = at_start(seat((HALF + excess) / 2.0), *SEAT)
        margins.append(float(second_order_margin(*pair_of(system, z, pairs))[0]))
    assert margins[0] / margins[1] == pytest.approx(10.0, rel=1e-2)
    assert margins[1] / margins[2] == pytest.approx(10.0, rel=1e-2)


def test_margin_is_that_of_the_smaller_force_where_a_contact_hardly_presses() -> None:
    """A plumb normal below the centre of mass carries everything, the other nothing."""
    slanted = np.array([np.cos(2.0), np.sin(2.0), 0.3])
    for push in (1e-2, 1e-3):
        first = -(np.array([0.0, -1.0, 0.0]) + push * slanted)
        wrenches = np.array([[first, slanted]])
        strong = np.full((1, 2, 3, 3), 0.0)
        tangent = np.cross(first, slanted)
        # A curvature of one: ∂w_1 such that ∇h·t = −|t|².
        strong[0, 0] = np.outer(np.cross(slanted, [0.0, -1.0, 0.0]), -tangent)
        strong[0, 0] /= np.linalg.norm(np.cross(slanted, [0.0, -1.0, 0.0])) ** 2
        margin = second_order_margin(wrenches, strong, np.array([0.0, -1.0, 0.0]))
        assert margin[0] == pytest.approx(push, rel=1e-9)


@pytest.mark.parametrize('turn', [0.1, -0.3])
def test_two_contacts_off_balance_have_no_margin(turn: float) -> None:
    system, z, pairs = at_start(seat(0.016, turn), *SEAT)
    assert second_order_margin(*pair_of(system, z, pairs))[0] == -1.0


def test_object_that_lies_flat_is_not_stable() -> None:
    """Both contacts upright: nothing keeps it from sliding."""
    level = np.array([[[0.0, 1.0, -0.3], [0.0, 1.0, 0.4]]])
    margin = second_order_margin(level, np.zeros((1, 2, 3, 3)), np.array([0.0, -1.0, 0.0]))
    assert margin[0] == 0.0


def test_without_gravity_two_contacts_hold_nothing() -> None:
    system, z, pairs = at_start(seat(0.016), *SEAT)
    wrenches, rates, _ = pair_of(system, z, pairs)
    assert second_order_margin(wrenches, rates, np.zeros(3))[0] == -1.0


def test_opposite_contacts_have_no_margin() -> None:
    opposite = np.array([[[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]])
    margin = second_order_margin(opposite, np.ones((1, 2, 3, 3)), np.array([0.0, -1.0, 0.0]))
    assert margin[0] <= 0.0


def test_model_that_is_told_so_does_not_count_second_order() -> None:
    system, z, pairs = at_start(seat(0.016), *SEAT)
    gradients = gap_gradients(system, system.place(z[None]), pairs)
    for counts in (True, False):
        model = FrictionlessModel(system.load, counts)
        margins = stability_margins(system, model, z[None], gradients, pairs)
        assert (margins.stable[0] > 0.0) == counts
        assert margins.second_order


def test_forces_of_a_symmetric_seat_are_known() -> None:
    """Two normals at 45° share the weight: c = 1 / √2 each."""
    system, z, pairs = at_start(seat(0.016), *SEAT)
    wrenches, _, load = pair_of(system, z, pairs)
    forces, rest = pair_forces(wrenches, load)
    np.testing.assert_allclose(forces, np.sqrt([[0.5, 0.5]]), rtol=1e-12)
    assert rest[0] < 1e-12


@given(
    st.floats(-0.1, 0.1),
    st.floats(-0.01, 0.01),
    st.floats(-0.015, 0.015),
)
@settings(max_examples=40, deadline=None)
def test_margin_is_positive_just_where_the_energy_is_least(
    bend: float, sideways: float, upwards: float
) -> None:
    """Of an unsymmetrical square on peg and tip, brought into balance."""
    problem = cradle(())
    thing = type(problem.object)(problem.object.vertices, 0.1, (sideways, upwards))
    problem = type(problem)(**{**vars(problem), 'object': thing})
    system = ContactSystem(problem)
    start = Grasp(problem.start.object_pose, (UPRIGHT + bend,))
    z, pairs = balanced(system, start, ON_PEG, ON_TIP)
    arguments = pair_of(system, z, pairs)
    _, rest = pair_forces(arguments[0], arguments[2])
    assume(rest[0] < 1e-9)
    assume(np.abs(z[:3]).max() < 3.0)
    margin = float(unbalanced_margin(*arguments)[0])
    assume(abs(margin) > 0.02)
    lowest = lowest_nearby(system, z, pairs, 3e-3)
    assert (lowest > 0.0) == (margin > 0.0)


@pytest.mark.parametrize(
    ('problem', 'names'),
    [
        (seat(0.016), SEAT),
        (seat(0.009), SEAT),
        (hanger(0.012, 0.04), HANGER),
        (hanger(0.012, 0.01), HANGER),
        (rocker(0.06, 0.05), ROCKER),
        (rocker(0.06, 0.01), ROCKER),
    ],
    ids=['wide seat', 'narrow seat', 'hung low', 'hung high', 'low rocker', 'high rocker'],
)
def test_closed_forms_have_their_minima_where_the_margin_says(
    problem: Problem, names: tuple[str, str]
) -> None:
    system, z, pairs = at_start(problem, *names)
    margin = second_order_margin(*pair_of(system, z, pairs))[0]
    assert (lowest_nearby(system, z, pairs, 3e-3) > 0.0) == (margin > 0.0)


def test_imbalance_has_the_gradient_of_finite_differences() -> None:
    problem = cradle(())
    system = ContactSystem(problem)
    pairs = formation(system, ON_PEG, ON_TIP).array
    z = system.configuration(Grasp((0.001, 0.013, 0.2), (UPRIGHT + 0.05,)))
    gradient = imbalance(*pair_of(system, z, pairs))[1][0]
    step = 1e-6 * np.eye(system.dof)
    differences = [
        imbalance(*pair_of(system, z + e, pairs))[0][0]
        - imbalance(*pair_of(system, z - e, pairs))[0][0]
        for e in step
    ]
    np.testing.assert_allclose(gradient, np.array(differences) / 2e-6, atol=1e-8)
