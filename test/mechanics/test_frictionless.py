from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, linprog

from cfplan_core.errors import JammedError
from cfplan_core.mechanics.frictionless import FrictionlessModel

FloatArray = NDArray[np.float64]

UNDECIDABLE = 1e-6
"""Nearer to zero than this the sign of a margin is not asked for."""

DOWN = np.array([0.0, -1.0, 0.0])
NONE = np.zeros(3)
OPTIMAL, INFEASIBLE, UNBOUNDED = 0, 2, 3


def row(x: float, y: float, angle: float, *joints: float) -> tuple[float, ...]:
    """Gap gradient of a contact at (x, y) from the centre of mass, its normal at an angle."""
    n_x, n_y = math.cos(angle), math.sin(angle)
    return (n_x, n_y, x * n_y - y * n_x, *joints)


@st.composite
def gap_gradients(
    draw: st.DrawFn, noises: tuple[float, ...] = (0.0, 0.0, 1e-5, 1e-3)
) -> FloatArray:
    """3 to 8 contacts and two joints: random, or parallel, redundant, duplicated, or nearly so."""
    thousandths = st.integers(-1000, 1000).map(lambda k: k / 1000)
    fine = st.tuples(thousandths, thousandths, st.integers(0, 6283).map(lambda k: k / 1000))
    steps = st.sampled_from([-0.5, -0.25, 0.0, 0.25, 0.5])
    coarse = st.tuples(steps, steps, st.integers(0, 7).map(lambda k: k * math.pi / 4))
    places = draw(
        st.one_of(
            st.lists(fine, min_size=3, max_size=6),
            st.lists(coarse, min_size=3, max_size=6),
            st.lists(st.one_of(fine, coarse), min_size=3, max_size=6),
        )
    )
    for index in draw(st.lists(st.integers(0, len(places) - 1), max_size=2)):
        x, y, angle = places[index]
        places.append((x, y, angle + draw(st.sampled_from([0.0, math.pi]))))
    noise = np.random.default_rng(draw(st.integers(0, 1000))).normal(size=(len(places), 3))
    moved = np.array(places) + draw(st.sampled_from(noises)) * noise
    still = st.tuples(st.just(0.0), st.just(0.0))
    arms = st.one_of(still, st.tuples(thousandths, thousandths))
    return np.array([row(*place, *draw(arms)) for place in moved])


loads = st.one_of(
    st.just(DOWN),
    st.just(NONE),
    st.integers(0, 6283).map(lambda k: np.array([math.cos(k / 1000), math.sin(k / 1000), 0.0])),
)
speeds = st.tuples(*[st.integers(-1000, 1000).map(lambda k: k / 1000)] * 2).map(np.array)


def solve(
    objective: FloatArray,
    bounds: tuple[float | None, float | None],
    equal: tuple[FloatArray, FloatArray] | None = None,
    below: tuple[FloatArray, FloatArray] | None = None,
) -> OptimizeResult:
    """Solve a linear program to 1e-10; an example that the solver gives up on is passed over."""
    a_eq, b_eq = equal or (None, None)
    a_ub, b_ub = below or (None, None)
    program = linprog(
        objective,
        A_ub=a_ub,
        b_ub=b_ub,
        A_eq=a_eq,
        b_eq=b_eq,
        bounds=bounds,
        options={
            'presolve': False,
            'primal_feasibility_tolerance': 1e-10,
            'dual_feasibility_tolerance': 1e-10,
        },
    )
    assume(program.status in (OPTIMAL, INFEASIBLE, UNBOUNDED))
    return program


def rank(rows: FloatArray) -> int:
    return int(np.linalg.matrix_rank(rows[:, :3], tol=1e-9))


def largest_least_force(rows: FloatArray, load: FloatArray) -> float:
    """Largest t, at most 1, such that forces c ≥ t balance the load; -inf if no forces do."""
    count = len(rows)
    equal = (np.column_stack([rows[:, :3].T, np.zeros(3)]), -load)
    below = (np.column_stack([-np.eye(count), np.ones(count)]), np.zeros(count))
    capped = (
        np.vstack([below[0], np.eye(count + 1)[-1:]]),
        np.append(below[1], 1.0),
    )
    objective = np.append(np.zeros(count), -1.0)
    program = solve(objective, (None, None), equal, capped)
    return -program.fun if program.status == OPTIMAL else -math.inf


@given(rows=gap_gradients(), load=loads)
def test_stability_is_that_of_a_linear_program(rows: FloatArray, load: FloatArray) -> None:
    """Stable: the wrenches have rank 3 and forces, all above zero, balance the load."""
    margin = FrictionlessModel(load).margins(rows[None]).stable[0]
    assume(abs(margin) >= UNDECIDABLE or margin == 0.0)
    least = largest_least_force(rows, load)
    assert (margin > 0.0) == (rank(rows) == 3 and least > 1e-9)


@given(rows=gap_gradients(), load=loads)
def test_form_closure_is_that_of_a_linear_program(rows: FloatArray, load: FloatArray) -> None:
    """Form closure: the wrenches have rank 3 and forces, all above zero, balance without load."""
    margin = FrictionlessModel(load).margins(rows[None]).form_closure[0]
    assume(abs(margin) >= UNDECIDABLE or margin == 0.0)
    assert (margin > 0.0) == (rank(rows) == 3 and largest_least_force(rows, NONE) > 1e-9)


@given(rows=gap_gradients(), load=loads)
def test_form_closure_is_stable_by_no_smaller_a_margin(rows: FloatArray, load: FloatArray) -> None:
    margins = FrictionlessModel(load).margins(rows[None])
    assert margins.stable[0] >= margins.form_closure[0]


@pytest.mark.parametrize('count', [0, 1, 2])
def test_two_contacts_are_not_stable(count: int) -> None:
    rows = np.array([row(-1.0, -1.0, math.pi / 2), row(1.0, -1.0, math.pi / 2)])[:count]
    margins = FrictionlessModel(DOWN).margins(rows[None])
    assert margins.stable[0] < 0.0
    assert margins.form_closure[0] < 0.0


def limit_by_program(rows: FloatArray, load: FloatArray, joint: int, sign: float) -> float:
    """Largest of ± the torque -Jᵀ c over forces c ≥ 0 that balance the load."""
    program = solve(sign * rows[:, 3 + joint], (0.0, None), (rows[:, :3].T, -load))
    if program.status == INFEASIBLE:
        return math.nan
    return math.inf if program.status == UNBOUNDED else -program.fun


@settings(max_examples=150)
@given(rows=gap_gradients(noises=(0.0, 1e-3)), load=loads)
def test_torque_limits_are_those_of_linear_programs(rows: FloatArray, load: FloatArray) -> None:
    """With infinities where the programs are unbounded and NaN where they are infeasible."""
    found = np.concatenate(FrictionlessModel(load).torque_limits(rows[None]))
    if rank(rows) < 3:
        assert np.isnan(found).all()
        return
    expected = np.array(
        [[s * limit_by_program(rows, load, j, s) for j in (0, 1)] for s in (-1.0, 1.0)]
    )
    size = np.abs(expected[np.isfinite(expected)]).max(initial=1.0)
    assume(size < 1e5)
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-7 * size)


@given(rows=gap_gradients(), load=loads)
def test_torque_limits_of_held_grasps_are_in_order(rows: FloatArray, load: FloatArray) -> None:
    model = FrictionlessModel(load)
    assume(model.margins(rows[None]).stable[0] > UNDECIDABLE)
    lower, upper = model.torque_limits(rows[None])
    assert (lower <= upper).all()


@given(rows=gap_gradients(noises=(0.0, 1e-3)))
def test_without_load_torques_are_zero_or_unbounded(rows: FloatArray) -> None:
    assume(rank(rows) == 3)
    lower, upper = FrictionlessModel(NONE).torque_limits(rows[None])
    assert set(lower.flat) <= {0.0, -math.inf}
    assert set(upper.flat) <= {0.0, math.inf}


@pytest.mark.parametrize('size', [1e-15, 1e-12, 1e-10, 1e-8])
def test_redundant_contacts_that_rounding_makes_independent_do_not_change_the_limits(
    size: float,
) -> None:
    """Five contacts on two lines, and one twice: many of their determinants are all but zero."""
    rows = np.array(
        [
            row(-0.4, -0.4, math.pi / 2, 0.0, 0.0),
            row(0.4, -0.4, math.pi / 2, 0.0, 0.0),
            row(-0.4, 0.2, 0.0, -0.5, 0.0),
            row(0.4, -0.2, math.pi, 0.0, 0.2),
            row(0.4, -0.2, math.pi, 0.0, 0.2),
            row(0.1, -0.4, math.pi / 2, 0.0, 0.0),
            row(-0.4, 0.1, 0.0, -0.4, 0.0),
        ]
    )
    disturbed = np.repeat(rows[None], 200, axis=0)
    disturbed[..., :3] += size * np.random.default_rng(11).normal(size=(200, 7, 3))
    model = FrictionlessModel(DOWN)
    for found, expected in zip(
        model.torque_limits(disturbed), model.torque_limits(rows[None]), strict=True
    ):
        np.testing.assert_allclose(
            found, np.repeat(expected, 200, axis=0), atol=1e-12 + 100 * size
        )


def test_limits_of_a_batch_are_those_of_each() -> None:
    generator = np.random.default_rng(7)
    angles, places = generator.uniform(0.0, 6.3, (40, 5)), generator.uniform(-1.0, 1.0, (40, 5, 4))
    batch = np.array(
        [
            [row(*p[:2], a, *p[2:]) for p, a in zip(ps, an, strict=True)]
            for ps, an in zip(places, angles, strict=True)
        ]
    )
    model = FrictionlessModel(DOWN)
    lower, upper = model.torque_limits(batch)
    for k, rows in enumerate(batch):
        one = model.torque_limits(rows[None])
        np.testing.assert_array_equal((lower[k], upper[k]), (one[0][0], one[1][0]))
    assert np.isnan(lower).any()
    assert np.isfinite(lower).any()


@pytest.mark.parametrize('count', [0, 1])
def test_one_contact_has_no_torque_limits(count: int) -> None:
    rows = np.array([row(-1.0, -1.0, math.pi / 2, 0.5), row(1.0, -1.0, math.pi / 2, 0.5)])
    lower, upper = FrictionlessModel(DOWN).torque_limits(rows[None, :count])
    assert lower.shape == upper.shape == (1, 1)
    assert np.isnan([lower, upper]).all()


def test_two_contacts_beside_the_weight_have_one_torque() -> None:
    """Half of the weight rests on each, with a lever of one half."""
    rows = np.array([row(-1.0, -1.0, math.pi / 2, 0.5), row(1.0, -1.0, math.pi / 2, 0.5)])
    lower, upper = FrictionlessModel(DOWN).torque_limits(rows[None])
    np.testing.assert_allclose([lower, upper], [[[-0.5]], [[-0.5]]])


@pytest.mark.parametrize('shift', [1e-3, 3.0])
def test_two_contacts_that_do_not_balance_have_no_torque_limits(shift: float) -> None:
    rows = np.array([row(-1.0, -1.0, math.pi / 2, 0.5), row(1.0, -1.0, 1.5, 0.5)])
    rows[0, 2] += shift
    lower, upper = FrictionlessModel(DOWN).torque_limits(rows[None])
    assert np.isnan([lower, upper]).all()


def test_hand_without_joints_has_no_torques() -> None:
    rows = np.array([row(-1.0, -1.0, math.pi / 2), row(1.0, 0.0, 2.0), row(0.0, 1.0, 1.0)])
    lower, upper = FrictionlessModel(DOWN).torque_limits(rows[None])
    assert lower.shape == upper.shape == (1, 0)


limits = st.one_of(st.just(math.inf), st.integers(0, 3000).map(lambda k: k / 1000))


@given(
    rows=gap_gradients(noises=(0.0, 1e-3)),
    load=loads,
    below=st.tuples(limits, limits).map(np.array),
    above=st.tuples(limits, limits).map(np.array),
)
def test_torques_between_limits_hold_where_a_linear_program_finds_some(
    rows: FloatArray, load: FloatArray, below: FloatArray, above: FloatArray
) -> None:
    """By how much all limits must be widened for an equilibrium within them: not at all."""
    assume(rank(rows) == 3)
    ends = np.concatenate([above, below])
    kept = np.isfinite(ends)
    arms = np.concatenate([-rows[:, 3:].T, rows[:, 3:].T])[kept]
    program = solve(
        np.append(np.zeros(len(rows)), 1.0),
        (0.0, None),
        (np.column_stack([rows[:, :3].T, np.zeros(3)]), -load),
        (np.column_stack([arms, -np.ones(len(arms))]), ends[kept]),
    )
    needed = program.fun if program.status == OPTIMAL else math.inf
    assume(needed == 0.0 or needed > 1e-6)
    held = FrictionlessModel(load).holds_within(rows[None], -below[None], above[None])
    assert held.tolist() == [needed == 0.0]


def test_limits_that_each_joint_can_keep_may_not_hold_together() -> None:
    """One force drives both joints: its torques are -c and -2 c, so (-1.5, -1.5) cannot be."""
    rows = np.array(
        [
            row(-1.0, -1.0, math.pi / 2, 0.0, 0.0),
            row(1.0, -1.0, math.pi / 2, 0.0, 0.0),
            row(-1.0, 0.2, 0.0, 1.0, 2.0),
            row(1.0, 0.2, math.pi, 0.0, 0.0),
        ]
    )[None]
    model = FrictionlessModel(DOWN)
    lower, upper = model.torque_limits(rows)
    assert (lower == -math.inf).all()
    np.testing.assert_allclose(upper, 0.0, atol=1e-12)
    together, one = np.array([[-1.6, -1.6]]), np.array([[-1.6, -3.2]])
    assert not model.holds_within(rows, together, together + 0.2)[0]
    assert model.holds_within(rows, one, one + 0.2)[0]


def fastest_fall(rows: FloatArray, load: FloatArray, speed: FloatArray) -> OptimizeResult:
    """Minimise -fᵀ v over object velocities v that keep all gaps open."""
    return solve(-load, (None, None), below=(-rows[:, :3], rows[:, 3:] @ speed))


@settings(max_examples=80)
@given(rows=gap_gradients(noises=(0.0, 1e-3)), load=loads, speed=speeds)
def test_grasp_jams_where_no_velocity_keeps_its_gaps_open(
    rows: FloatArray, load: FloatArray, speed: FloatArray
) -> None:
    """Contacts of rank below 3 count as jammed too: they do not determine a motion."""
    moves = rank(rows) == 3 and fastest_fall(rows, NONE, speed).status == OPTIMAL
    try:
        FrictionlessModel(load).motion(rows, speed)
    except JammedError:
        assert not moves
    else:
        assert moves


@settings(max_examples=80)
@given(rows=gap_gradients(noises=(0.0, 1e-3)), load=loads, speed=speeds)
def test_object_falls_as_fast_as_a_linear_program_lets_it(
    rows: FloatArray, load: FloatArray, speed: FloatArray
) -> None:
    assume(rank(rows) == 3)
    program = fastest_fall(rows, load, speed)
    assume(program.status == OPTIMAL)
    motion = FrictionlessModel(load).motion(rows, speed)
    fall = float(load @ motion.object_velocity)
    assert fall == pytest.approx(-program.fun, rel=1e-6, abs=1e-6)


@settings(max_examples=80)
@given(rows=gap_gradients(noises=(0.0, 1e-3)), load=loads, speed=speeds)
def test_power_of_the_load_is_that_of_the_joints_against_some_equilibrium(
    rows: FloatArray, load: FloatArray, speed: FloatArray
) -> None:
    """Duality: the least -fᵀ v is the largest -(J θ̇)·c over forces c ≥ 0 with W c = -f."""
    assume(rank(rows) == 3)
    program = solve(rows[:, 3:] @ speed, (0.0, None), (rows[:, :3].T, -load))
    assume(program.status == OPTIMAL)
    motion = FrictionlessModel(load).motion(rows, speed)
    size = 1.0 + np.abs(program.x).max()
    power = -float(load @ motion.object_velocity)
    assert power == pytest.approx(-program.fun, rel=1e-6, abs=1e-7 * size)


@given(rows=gap_gradients(), load=loads, speed=speeds)
def test_gap_rates_are_those_of_the_velocity_and_not_negative(
    rows: FloatArray, load: FloatArray, speed: FloatArray
) -> None:
    try:
        motion = FrictionlessModel(load).motion(rows, speed)
    except JammedError:
        assume(False)
    size = 1.0 + np.abs(motion.object_velocity).max()
    expected = rows[:, :3] @ motion.object_velocity + rows[:, 3:] @ speed
    assert (motion.gap_rates >= 0.0).all()
    np.testing.assert_allclose(motion.gap_rates, expected, atol=2e-9 * size)


@settings(max_examples=60)
@given(rows=gap_gradients(noises=(0.0, 1e-3)), load=loads, speed=speeds)
def test_motion_is_unique_where_programs_find_no_other(
    rows: FloatArray, load: FloatArray, speed: FloatArray
) -> None:
    """The width of the set of the best velocities, by a program each way along each axis."""
    assume(rank(rows) == 3)
    program = fastest_fall(rows, load, speed)
    assume(program.status == OPTIMAL)
    motion = FrictionlessModel(load).motion(rows, speed)
    below = (
        np.vstack([-rows[:, :3], -load]),
        np.append(rows[:, 3:] @ speed, program.fun),
    )
    width = 0.0
    for axis in np.concatenate([np.eye(3), -np.eye(3)]):
        furthest = solve(-axis, (-1e3, 1e3), below=below)
        assume(furthest.status == OPTIMAL)
        width = max(width, -furthest.fun - axis @ motion.object_velocity)
    assume(width < 1e-5 or width > 1e-2)
    assert motion.unique == (width < 1e-5)


def test_jam_says_at_which_joint_velocity() -> None:
    """A wall on the left, a fingertip that comes from the right."""
    rows = np.array(
        [
            row(-1.0, 0.5, 0.0, 0.0),
            row(-1.0, -0.5, 0.0, 0.0),
            row(0.0, -1.0, math.pi / 2, 0.0),
            row(1.0, 0.0, math.pi, -1.0),
        ]
    )
    with pytest.raises(JammedError, match=r'all 4 gaps open at joint velocity \[0\.25\]'):
        FrictionlessModel(DOWN).motion(rows, np.array([0.25]))


@pytest.mark.parametrize('count', [0, 1, 2])
def test_too_few_contacts_do_not_determine_a_motion(count: int) -> None:
    rows = np.array([row(-1.0, -1.0, math.pi / 2, 0.0), row(1.0, -1.0, math.pi / 2, 0.0)])[:count]
    with pytest.raises(JammedError, match=f'rank below 3.*{count} contacts'):
        FrictionlessModel(DOWN).motion(rows, np.zeros(1))


def test_pinwheel_of_four_contacts_is_form_closure() -> None:
    """Left and right push it one way round, top and bottom the other: all forces one balance."""
    pinwheel = np.array(
        [
            row(-1.0, 0.5, 0.0, 0.1),
            row(1.0, -0.5, math.pi, 0.2),
            row(0.5, -1.0, math.pi / 2, 0.3),
            row(-0.5, 1.0, -math.pi / 2, 0.4),
        ]
    )
    np.testing.assert_allclose(pinwheel[:, :3].sum(axis=0), 0.0, atol=1e-12)
    model = FrictionlessModel(DOWN)
    assert model.margins(pinwheel[None]).form_closure[0] > 0.1
    lower, upper = model.torque_limits(pinwheel[None])
    # The top finger may as well not push: then c = (1/2, 1/2, 1, 0) carries the weight.
    np.testing.assert_allclose(upper, [[-(0.1 * 0.5 + 0.2 * 0.5 + 0.3)]])
    np.testing.assert_array_equal(lower, [[-math.inf]])


def test_four_contacts_that_all_push_it_one_way_round_are_not_form_closure() -> None:
    turned = np.array(
        [
            row(-1.0, 0.5, 0.0),
            row(1.0, -0.5, math.pi),
            row(-0.5, -1.0, math.pi / 2),
            row(0.5, 1.0, -math.pi / 2),
        ]
    )
    assert FrictionlessModel(NONE).margins(turned[None]).form_closure[0] < 0.0


def test_four_contacts_towards_the_centre_are_not_form_closure() -> None:
    angles = np.arange(4) * math.pi / 2 + 0.2
    central = np.array([row(-math.cos(a), -math.sin(a), a) for a in angles])
    assert FrictionlessModel(NONE).margins(central[None]).form_closure[0] <= 1e-12


def test_without_gravity_only_form_closure_is_stable() -> None:
    rows = np.array([row(x, -1.0, math.pi / 2) for x in (-1.0, 1.0)])
    rows = np.concatenate([rows, [row(-1.0, 0.0, 0.0), row(1.0, 0.2, math.pi)]])
    assert FrictionlessModel(DOWN).margins(rows[None]).stable[0] > 0.0
    assert FrictionlessModel(NONE).margins(rows[None]).stable[0] <= 0.0
