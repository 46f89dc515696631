"""Tolerant torques, tried in worlds that are not the planned one: contacts solved for anew."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from cfplan_core import PlanResult, Problem, load_problem, plan
from cfplan_core.contact.disturbance import (
    GEOMETRY,
    JOINT,
    MASS,
    TORQUE,
    Disturbance,
    disturbance,
)
from cfplan_core.contact.elements import parse_contact
from cfplan_core.contact.gaps import gap_gradients, gaps
from cfplan_core.contact.system import ContactSystem, IntArray
from cfplan_core.execution.perturbation import Uncertainty, World, draw
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_forces import configurations
from cfplan_core.mechanics.tolerant_torques import Tolerance, most_tolerant

PROBLEMS = Path(__file__).parents[2] / 'config' / 'problems'
PLACES = [('h045', 1), ('h045', 3), ('h447', 2), ('trinkle_hunter_1991', 1)]
NO_LIMITS = np.full((1, 2), -99.0), np.full((1, 2), 99.0)
NO_LIMITS_OF_THREE = np.full((3, 2), -99.0), np.full((3, 2), 99.0)


@cache
def planned(name: str) -> tuple[Problem, PlanResult]:
    problem = load_problem(PROBLEMS / f'{name}.yaml')
    return problem, plan(problem)


def middle(name: str, segment: int) -> tuple[ContactSystem, FloatArray, IntArray]:
    """Three configurations in the middle of a segment, and its contacts."""
    problem, result = planned(name)
    system, chosen = ContactSystem(problem), result.segments[segment]
    frame = (chosen.first_frame + chosen.last_frame) // 2
    rows = slice(frame - 1, frame + 2)
    z = configurations(system, result.object_poses[rows], result.joints[rows])
    return system, z, np.array([system.pair(parse_contact(c)) for c in chosen.contacts])


def tolerant(system: ContactSystem, z: FloatArray, pairs: IntArray, joint: int) -> Tolerance:
    gradients = gap_gradients(system, system.place(z), pairs)
    limits = tuple(np.full((len(z), system.joint_count), limit) for limit in (-99.0, 99.0))
    errors = disturbance(system, z, pairs)
    cap = np.full(len(z), 50.0)
    found = most_tolerant(gradients, errors, joint, system.load, limits, cap)  # type: ignore[arg-type]
    return Tolerance(found.forces[1:2], found.tolerance[1:2])


def torque_of(
    system: ContactSystem, z: FloatArray, pairs: IntArray, forces: FloatArray
) -> FloatArray:
    gradients = gap_gradients(system, system.place(z), pairs)
    return np.asarray(-forces @ gradients[0, :, 3:])


def forces_in(
    world: World,
    planned_system: ContactSystem,
    z: FloatArray,
    pairs: IntArray,
    joint: int,
    torque: float,
) -> FloatArray:
    """Contact forces where one joint supplies a torque and the others are held, in weights."""
    system = ContactSystem(world.problem)
    # Lengths in units of that world's object, forces of its weight.
    length = planned_system.size / system.size
    z = z * [length, length, 1.0, 1.0, 1.0]
    z[3:] -= np.where(np.arange(2) == joint, 0.0, world.joint_errors)
    free = [0, 1, 2, 3 + joint]
    for _ in range(30):
        placed = system.place(z[None])
        gradients = gap_gradients(system, placed, pairs)[0]
        z[free] -= np.linalg.solve(gradients[:, free], gaps(system, placed, pairs).gap[0])
    assert np.abs(gaps(system, system.place(z[None]), pairs).gap).max() < 1e-12
    unit = planned_system.force_unit * planned_system.size / (system.force_unit * system.size)
    matrix = np.vstack([gradients[:, :3].T, -gradients[:, 3 + joint]])
    return np.linalg.solve(matrix, np.append(-system.load, torque * unit))


@pytest.mark.parametrize(('name', 'segment'), PLACES)
@pytest.mark.parametrize('joint', [0, 1])
def test_contacts_are_kept_by_errors_within_the_tolerance(
    name: str, segment: int, joint: int
) -> None:
    system, z, pairs = middle(name, segment)
    best = tolerant(system, z, pairs, joint)
    scale = 0.8 * min(1.0, float(best.tolerance[0]))
    assert scale > 0.01
    torque = float(torque_of(system, z[1:2], pairs, best.forces[0])[joint])
    errors = Uncertainty(0.0, scale * MASS, scale * GEOMETRY, scale * JOINT)
    random = np.random.default_rng(5)
    for _ in range(60):
        world = draw(system.problem, errors, random)
        assert forces_in(world, system, z[1], pairs, joint, torque).min() > 0.0


@pytest.mark.parametrize(('name', 'segment'), PLACES)
def test_other_torques_are_lost_more_often(name: str, segment: int) -> None:
    """By errors of thrice the tolerance, whether these torques are smaller or larger."""
    system, z, pairs = middle(name, segment)
    joint = max((0, 1), key=lambda j: tolerant(system, z, pairs, j).tolerance[0])
    best = tolerant(system, z, pairs, joint)
    scale = min(3.0 * float(best.tolerance[0]), 3.0)
    errors = Uncertainty(0.0, min(scale * MASS, 0.9), scale * GEOMETRY, scale * JOINT)
    random = np.random.default_rng(7)
    worlds = [draw(system.problem, errors, random) for _ in range(80)]
    torque = float(torque_of(system, z[1:2], pairs, best.forces[0])[joint])

    def kept(factor: float) -> int:
        return sum(
            forces_in(world, system, z[1], pairs, joint, factor * torque).min() > 0.0
            for world in worlds
        )

    most = kept(1.0)
    assert 25 <= most <= 80
    for factor in (0.25, 0.5, 2.0, 4.0, 8.0):
        # A maximum of one number and another, near to it, may differ by a few worlds.
        assert kept(factor) <= most + 5
    assert min(kept(0.1), kept(30.0)) < 0.8 * most


@pytest.mark.parametrize(('name', 'segment'), PLACES)
@pytest.mark.parametrize('joint', [0, 1])
def test_tolerance_is_the_ratio_of_forces_to_the_sum_of_their_changes(
    name: str, segment: int, joint: int
) -> None:
    """Changes by differences of forces: each error is made on its own, and the contacts closed."""
    system, z, pairs = middle(name, segment)
    best = tolerant(system, z, pairs, joint)
    torque = float(torque_of(system, z[1:2], pairs, best.forces[0])[joint])
    free = [0, 1, 2, 3 + joint]

    def solved(
        gap: FloatArray | float = 0.0,
        held: float = 0.0,
        change: FloatArray | float = 0.0,
        load: float = 1.0,
        more: float = 0.0,
    ) -> FloatArray:
        at = z[1].copy()
        at[4 - joint] += held
        for _ in range(8):
            placed = system.place(at[None])
            gradients = gap_gradients(system, placed, pairs)[0]
            apart = gaps(system, placed, pairs).gap[0] + gap
            at[free] -= np.linalg.solve(gradients[:, free], apart)
        gradients = gradients + change
        matrix = np.vstack([gradients[:, :3].T, -gradients[:, 3 + joint]])
        return np.linalg.solve(matrix, np.append(-load * system.load, torque + more))

    errors, step = disturbance(system, z, pairs), 1e-5
    forces = solved()
    disturbed = [solved(load=1.0 + MASS * step), solved(more=TORQUE * step)]
    disturbed += [solved(held=JOINT * step)]
    for unit in step * np.eye(4):
        disturbed += [solved(gap=2.0 * GEOMETRY * unit)]
        disturbed += [solved(change=unit[:, None] * errors.turned[1])]
        disturbed += [solved(change=unit[:, None] * errors.shifted[1])]
    by_friction = solved(change=step * errors.leaning[1]) - forces
    error = np.abs(np.array(disturbed) - forces).sum(axis=0) - np.minimum(by_friction, 0.0)
    expected = float((forces * step / error).min())
    assert float(best.tolerance[0]) == pytest.approx(expected, rel=2e-3)


def test_forces_balance_the_load_within_cap_and_efforts() -> None:
    system, z, pairs = middle('h045', 2)
    gradients = gap_gradients(system, system.place(z), pairs)
    errors = disturbance(system, z, pairs)
    for effort, most in ((99.0, 50.0), (99.0, 1.1), (0.3, 50.0)):
        limits = np.full((3, 2), -effort), np.full((3, 2), effort)
        found = most_tolerant(gradients, errors, 1, system.load, limits, np.full(3, most))
        balance = np.einsum('skw,sk->sw', gradients[..., :3], found.forces)
        np.testing.assert_allclose(balance, -np.tile(system.load, (3, 1)), atol=1e-9)
        assert found.forces.max() <= most + 1e-9
        torques = -np.einsum('skn,sk->sn', gradients[..., 3:], found.forces)
        assert np.abs(torques).max() <= effort + 1e-9


def test_a_torque_that_tells_nothing_tolerates_nothing() -> None:
    system, z, pairs = middle('h045', 1)
    gradients = gap_gradients(system, system.place(z), pairs)
    gradients[..., 4] = 0.0
    limits = np.full((3, 2), -99.0), np.full((3, 2), 99.0)
    errors = disturbance(system, z, pairs)
    found = most_tolerant(gradients, errors, 1, system.load, limits, np.full(3, 5.0))
    np.testing.assert_array_equal(found.tolerance, 0.0)
    assert np.isnan(found.forces).all()


def test_a_contact_that_never_presses_tolerates_nothing() -> None:
    """Without weight and errors: two tips press a block between them, its feet nothing."""
    gradients = np.zeros((1, 4, 5))
    gradients[0, :, :3] = [[0, 1, -0.5], [0, 1, 0.5], [1, 0, -0.3], [-1, 0, 0.3]]
    gradients[0, [2, 3], [3, 4]] = -0.3, -0.3
    nothing = np.zeros_like(gradients)
    errors = Disturbance(nothing, nothing, np.zeros((1, 4, 5, 5)), nothing)
    with np.errstate(all='raise'):
        found = most_tolerant(gradients, errors, 1, np.zeros(3), NO_LIMITS, np.full(1, 5.0))
    np.testing.assert_allclose(found.forces[0, :2], 0.0, atol=1e-12)
    np.testing.assert_allclose(found.tolerance, 0.0, atol=1e-6)


def test_of_nearly_as_tolerant_torques_the_gentlest_is_taken() -> None:
    """Against the first-order tolerance of torques all along the interval, by narrow limits."""
    system, z, pairs = middle('h045', 2)
    gradients = gap_gradients(system, system.place(z), pairs)
    errors = disturbance(system, z, pairs)
    cap = np.full(3, 5.0)
    found = most_tolerant(gradients, errors, 1, system.load, NO_LIMITS_OF_THREE, cap)
    torque = -np.einsum('skn,sk->sn', gradients[..., 3:], found.forces)[1, 1]
    tolerances = []
    for given in np.geomspace(0.05, 8.0, 60):
        limits = np.array([[-99.0, given]] * 3), np.array([[99.0, given * (1.0 + 1e-9)]] * 3)
        at = most_tolerant(gradients, errors, 1, system.load, limits, cap)
        tolerances.append((given, at.tolerance[1]))
    most = max(tolerance for _, tolerance in tolerances)
    assert found.tolerance[1] >= 0.94 * most
    gentler = [tolerance for given, tolerance in tolerances if given < 0.95 * torque]
    assert max(gentler) < 0.96 * most
