from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import linprog

from cfplan_core import load_problem, plan
from cfplan_core.contact.system import ContactSystem
from cfplan_core.errors import CfplanError
from cfplan_core.mechanics.contact_forces import Stretch, contact_forces, least_forces
from cfplan_core.model import Grasp, ManipulatedObject
from cfplan_core.model.hand import transformed
from cfplan_core.report.scene import contact_marks

FloatArray = NDArray[np.float64]

PROBLEMS = Path(__file__).parents[2] / 'config' / 'problems'
DOWN = np.array([0.0, -1.0, 0.0])
SOLVED, INFEASIBLE = 0, 2


def wrench(x: float, y: float, angle: float) -> tuple[float, float, float]:
    """Wrench direction of a contact at (x, y) from the centre of mass, its normal at an angle."""
    return math.cos(angle), math.sin(angle), x * math.sin(angle) - y * math.cos(angle)


def upward(*places: float) -> FloatArray:
    """Contacts under the object that push straight up, shape (1, k, 3)."""
    return np.array([[(0.0, 1.0, x) for x in places]])


@st.composite
def contacts(draw: st.DrawFn) -> FloatArray:
    """1 to 7 contacts, shape (k, 3): anywhere, on a grid, or some flush with a floor."""
    fine = st.tuples(
        *[st.integers(-500, 500).map(lambda k: k / 1000)] * 2,
        st.integers(0, 6283).map(lambda k: k / 1000),
    )
    step = st.sampled_from([-0.5, -0.25, 0.0, 0.25, 0.5])
    coarse = st.tuples(step, step, st.integers(0, 7).map(lambda k: k * math.pi / 4))
    flush = step.map(lambda x: (x, -0.5, math.pi / 2))
    kinds = draw(st.sampled_from([fine, coarse, flush, st.one_of(coarse, flush)]))
    return np.array([wrench(*place) for place in draw(st.lists(kinds, min_size=1, max_size=7))])


@given(contacts())
@settings(max_examples=300)
def test_the_largest_force_is_the_least_that_linear_programming_finds(w: FloatArray) -> None:
    count = len(w)
    found = linprog(
        np.append(np.zeros(count), 1.0),
        A_ub=np.column_stack([np.eye(count), -np.ones(count)]),
        b_ub=np.zeros(count),
        A_eq=np.column_stack([w.T, np.zeros(3)]),
        b_eq=-DOWN,
    )
    assume(found.status in (SOLVED, INFEASIBLE))
    largest = least_forces(w[None], DOWN)[0].max()
    expected = found.fun if found.status == SOLVED else np.nan
    # A force of a thousand weights hangs by rounding on whether there is an equilibrium at all.
    assume(not expected > 1e3)
    assert largest == pytest.approx(expected, rel=1e-6, abs=1e-9, nan_ok=True)


@given(contacts())
@settings(max_examples=200)
def test_of_all_equilibria_with_that_force_it_has_about_the_least_sum(w: FloatArray) -> None:
    forces = least_forces(w[None], DOWN)[0]
    assume(np.isfinite(forces).all() and forces.max() < 1e3)
    bound = forces.max() * (1.0 + 1e-9) + 1e-12
    found = linprog(np.ones(len(w)), A_eq=w.T, b_eq=-DOWN, bounds=(0.0, bound))
    assume(found.status == SOLVED)
    assert forces.sum() <= 1.02 * found.fun + 1e-6


@given(contacts())
@settings(max_examples=200)
def test_forces_push_and_balance_the_load(w: FloatArray) -> None:
    forces = least_forces(w[None], DOWN)[0]
    assume(np.isfinite(forces).all())
    assert forces.min() >= 0.0
    assert forces @ w + DOWN == pytest.approx(0.0, abs=2e-6 * (1.0 + forces.max()))


def test_two_flush_contacts_share_the_weight_by_their_levers() -> None:
    assert least_forces(upward(-0.1, 0.3), DOWN)[0] == pytest.approx([0.75, 0.25])


def test_contacts_that_could_share_the_weight_in_many_ways_share_it_evenly() -> None:
    assert least_forces(upward(-0.4, -0.1, 0.1, 0.4), DOWN)[0] == pytest.approx([0.25] * 4)


def test_a_single_contact_under_the_centre_of_mass_carries_all() -> None:
    assert least_forces(upward(0.0), DOWN)[0] == pytest.approx([1.0])


def test_contacts_that_need_not_push_do_not() -> None:
    squeeze = [wrench(-0.5, 0.2, 0.0), wrench(0.5, 0.2, math.pi)]
    standing = [wrench(-0.2, -0.5, math.pi / 2), wrench(0.3, -0.5, math.pi / 2)]
    forces = least_forces(np.array([[*squeeze, *standing]]), DOWN)[0]
    assert forces == pytest.approx([0.0, 0.0, 0.6, 0.4])


@pytest.mark.parametrize(
    'w',
    [
        upward(0.1, 0.3),
        upward(0.1),
        np.array([[wrench(0.0, 0.5, -math.pi / 2)]]),
        np.array([[wrench(-0.5, 0.0, 0.0), wrench(0.5, 0.0, math.pi)]]),
        np.array([[wrench(-0.2, -0.5, 1.2), wrench(0.2, -0.5, 1.4), wrench(0.4, -0.5, 1.3)]]),
    ],
    ids=['both-on-one-side', 'off-centre', 'from-above', 'no-friction', 'pushed-aside'],
)
def test_without_an_equilibrium_forces_are_nan(w: FloatArray) -> None:
    assert np.isnan(least_forces(w, DOWN)).all()


def test_without_gravity_nothing_need_push() -> None:
    assert least_forces(upward(-0.1, 0.3), np.zeros(3))[0] == pytest.approx([0.0, 0.0])


def test_no_contacts_have_no_forces() -> None:
    assert least_forces(np.zeros((5, 0, 3)), DOWN).shape == (5, 0)


def test_many_configurations_at_once_are_as_one_by_one() -> None:
    random = np.random.default_rng(4)
    w = np.array([[wrench(*place) for place in random.normal(size=(5, 3))] for _ in range(200)])
    together = least_forces(w, DOWN)
    alone = np.concatenate([least_forces(each[None], DOWN) for each in w])
    np.testing.assert_allclose(together, alone, rtol=1e-9)


def test_twenty_contacts_are_no_burden() -> None:
    places = np.linspace(-0.5, 0.5, 20)
    assert least_forces(upward(*places), DOWN)[0] == pytest.approx([0.05] * 20)


@pytest.fixture(scope='module')
def story() -> tuple[ContactSystem, list[Stretch]]:
    problem = load_problem(PROBLEMS / 'trinkle_hunter_1991.yaml')
    result = plan(problem)
    stretches = [
        Stretch(
            segment.contacts,
            result.object_poses[segment.first_frame : segment.last_frame + 1],
            result.joints[segment.first_frame : segment.last_frame + 1],
        )
        for segment in result.segments
    ]
    return ContactSystem(problem), stretches


def test_points_and_normals_are_those_of_the_figures(
    story: tuple[ContactSystem, list[Stretch]],
) -> None:
    system, stretches = story
    for stretch, found in zip(stretches, contact_forces(system, stretches), strict=True):
        for k, (pose, joints) in enumerate(zip(stretch.object_poses, stretch.joints, strict=True)):
            marks = contact_marks(system.problem, Grasp(pose, joints), stretch.contacts)
            np.testing.assert_allclose(found.points[k], [m.point for m in marks], atol=1e-9)
            np.testing.assert_allclose(found.normals[k], [m.normal for m in marks], atol=1e-9)


def test_forces_in_newtons_balance_weight_and_moment_all_along_a_plan(
    story: tuple[ContactSystem, list[Stretch]],
) -> None:
    system, stretches = story
    problem = system.problem
    weight = problem.object.mass * problem.gravity
    for stretch, found in zip(stretches, contact_forces(system, stretches), strict=True):
        pushes = found.forces[..., None] * found.normals
        phi = stretch.object_poses[:, 2]
        com = problem.object.center_of_mass
        center = stretch.object_poses[:, :2] + np.column_stack(
            [
                np.cos(phi) * com[0] - np.sin(phi) * com[1],
                np.sin(phi) * com[0] + np.cos(phi) * com[1],
            ]
        )
        arms = found.points - center[:, None]
        moments = (arms[..., 0] * pushes[..., 1] - arms[..., 1] * pushes[..., 0]).sum(axis=1)
        np.testing.assert_allclose(pushes.sum(axis=1) + weight, 0.0, atol=1e-6)
        np.testing.assert_allclose(moments, 0.0, atol=1e-7)


def test_the_object_s_frame_may_lie_anywhere(
    story: tuple[ContactSystem, list[Stretch]],
) -> None:
    system, stretches = story
    thing = system.problem.object
    shift = np.array([0.03, -0.02])
    moved = ManipulatedObject(thing.vertices + shift, thing.mass, thing.center_of_mass + shift)
    stretch = stretches[1]
    poses = stretch.object_poses.copy()
    for pose in poses:
        pose[:2] -= transformed(shift[None], np.zeros(2), pose[2])[0]
    (expected,) = contact_forces(system, [stretch])
    (found,) = contact_forces(
        ContactSystem(replace(system.problem, object=moved)),
        [Stretch(stretch.contacts, poses, stretch.joints)],
    )
    np.testing.assert_allclose(found.points, expected.points, atol=1e-12)
    np.testing.assert_allclose(found.forces, expected.forces, rtol=1e-6)


def test_forces_do_not_jump_inside_a_segment(
    story: tuple[ContactSystem, list[Stretch]],
) -> None:
    system, stretches = story
    for found in contact_forces(system, stretches):
        steps = np.abs(np.diff(found.forces, axis=0))
        assert steps.max(initial=0.0) < 0.5 * system.force_unit


def test_a_stretch_has_the_same_forces_alone_and_among_others(
    story: tuple[ContactSystem, list[Stretch]],
) -> None:
    system, stretches = story
    for stretch, found in zip(stretches, contact_forces(system, stretches), strict=True):
        alone = contact_forces(system, [stretch])[0]
        np.testing.assert_allclose(alone.forces, found.forces, rtol=1e-9, atol=1e-12)


def test_an_impossible_contact_is_refused_by_name(
    story: tuple[ContactSystem, list[Stretch]],
) -> None:
    system, stretches = story
    wrong = Stretch(['object.v0|thumb.tip.e0'], stretches[0].object_poses, stretches[0].joints)
    with pytest.raises(CfplanError, match=r'object\.v0\|thumb\.tip\.e0'):
        contact_forces(system, [wrong])
