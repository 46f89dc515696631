"""The force that a contact must carry at least, its gradient, and motions that take it away."""

from __future__ import annotations

from collections import Counter
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import linprog

from cfplan_core import load_problem
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.gaps import gap_gradients
from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import Stability
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.planning.drives import ToConfiguration
from cfplan_core.planning.force_drive import ToForce, least_force, wrench_slopes
from cfplan_core.planning.grasp_check import examine_problem
from cfplan_core.planning.milestones import Milestone
from cfplan_core.planning.pieces import Region
from cfplan_core.planning.pushing import Pusher
from cfplan_core.planning.tracing import Tracer
from cfplan_core.planning.transitions import surroundings

MANY = Path(__file__).parents[2] / 'config' / 'problems' / 'many_joints'
LOAD = np.array([0.0, -1.0, 0.0])


@cache
def system() -> ContactSystem:
    return ContactSystem(load_problem(MANY / 'two_fingers_two_joints.yaml'))


def random_configuration(seed: int) -> FloatArray:
    rng = np.random.default_rng(seed)
    return np.concatenate([rng.normal(size=3), rng.uniform(-1.0, 1.0, system().joint_count)])


@pytest.mark.parametrize('seed', range(4))
def test_slopes_of_wrenches_are_those_of_finite_differences(seed: int) -> None:
    z, step = random_configuration(seed), 1e-6
    pairs = np.arange(0, system().contact_count, 7)

    def wrenches(at: FloatArray) -> FloatArray:
        return gap_gradients(system(), system().place(at[None]), pairs)[0, :, :3]

    differences = np.stack(
        [
            (wrenches(z + step * unit) - wrenches(z - step * unit)) / (2.0 * step)
            for unit in np.eye(len(z))
        ],
        axis=-1,
    )
    np.testing.assert_allclose(wrench_slopes(system(), z, pairs), differences, atol=1e-7)


def test_plate_on_two_fingertips_shares_its_weight_by_the_lever_rule() -> None:
    # Two vertical contacts at x = -1 and x = 3, and one that only keeps it from sliding.
    wrenches = np.array([[0.0, 1.0, -1.0], [0.0, 1.0, 3.0], [1.0, 0.0, 0.0]])
    assert least_force(wrenches, LOAD, 0)[0] == pytest.approx(0.75)
    assert least_force(wrenches, LOAD, 1)[0] == pytest.approx(0.25)
    assert least_force(wrenches, LOAD, 2)[0] == pytest.approx(0.0)


@pytest.mark.parametrize('seed', range(20))
def test_least_force_is_that_of_a_linear_program(seed: int) -> None:
    rng = np.random.default_rng(seed)
    wrenches = rng.normal(size=(5, 3))
    for contact in range(5):
        cost = np.eye(5)[contact]
        answer = linprog(cost, A_eq=wrenches.T, b_eq=-LOAD, method='highs')
        force, basis = least_force(wrenches, LOAD, contact)
        if answer.status != 0:
            assert force == np.inf
            assert basis == ()
        else:
            assert force == pytest.approx(answer.fun, abs=1e-9)


@cache
def start() -> tuple[Tracer, Formation, FloatArray]:
    tracer = Tracer(system(), FrictionlessModel(system().load))
    found = examine_problem(system(), tracer.model).start
    assert found is not None
    return tracer, Formation(tuple(found.pairs.tolist())), found.z


def test_gradient_of_the_force_is_that_of_finite_differences() -> None:
    tracer, formation, z = start()
    checked = 0
    for pair in formation.pairs:
        drive = ToForce(system(), tracer.model, system().load, formation, pair)
        value, slope = drive.value(z)
        if value <= 0.0:
            continue
        checked += 1
        units = np.eye(len(z))
        differences = [
            (drive.value(z + 1e-6 * unit)[0] - drive.value(z - 1e-6 * unit)[0]) / 2e-6
            for unit in units
        ]
        np.testing.assert_allclose(slope, differences, atol=1e-5)
    assert checked > 0


@cache
def tilted() -> tuple[Pusher, Milestone]:
    """A grasp of three contacts, each of which presses: the object tips over one vertex."""
    tracer, _, z = start()

    def region(known: list[Region], of: Formation, stability: Stability) -> Region:
        return Region(0, of, stability, 2, z[None], (), [])

    pusher = Pusher(tracer, Counter(), region)
    at = Milestone(z, surroundings(system(), z), None, ())
    weights = np.zeros(system().dof)
    weights[:3] = 1.0
    rng = np.random.default_rng(8)
    for _ in range(4):
        wanted = at.z + np.concatenate(
            [rng.normal(size=3) * [0.3, 0.3, 0.4], np.zeros(system().joint_count)]
        )
        at = [at, *pusher.push(at, ToConfiguration(wanted, weights), True)][-1]
    assert len(at.stretches[-1].formation) == 3
    return pusher, at


def drive_of(pair: int, formation: Formation, wanted: float) -> ToForce:
    return ToForce(system(), start()[0].model, system().load, formation, pair, wanted)


@pytest.mark.parametrize('index', range(3))
def test_driven_force_comes_down_to_the_border_of_what_holds(index: int) -> None:
    pusher, at = tilted()
    formation = at.stretches[-1].formation
    drive = drive_of(formation.pairs[index], formation, 0.0)
    before = drive.value(at.z)[0]
    reached = [m for m in pusher.push(at, drive, True) if m.stretches[-1].formation == formation]
    assert reached
    assert drive.value(reached[-1].z)[0] < 0.6 * before
    assert start()[0].margins(formation, reached[-1].z[None]).stable[0] > 0.0


def test_force_is_driven_to_a_value() -> None:
    pusher, at = tilted()
    formation = at.stretches[-1].formation
    drive = drive_of(formation.pairs[1], formation, 0.0)
    half = drive_of(formation.pairs[1], formation, 0.5 * drive.value(at.z)[0])
    *_, last = pusher.push(at, half, True)
    assert last.stretches[-1].formation == formation
    assert drive.value(last.z)[0] == pytest.approx(half.wanted, abs=1e-5)


def test_contact_carries_nothing_where_the_others_hold_alone() -> None:
    tracer, formation, z = start()
    for pair in formation.pairs:
        value, _ = drive_of(pair, formation, 0.0).value(z)
        others = Formation(tuple(other for other in formation.pairs if other != pair))
        margin = float(tracer.margins(others, z[None]).stable[0])
        assert (value <= 0.0) == (margin >= 0.0)
