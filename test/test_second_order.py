"""Plans through grasps of two contacts, as a user sees them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from planning.pegs import HALF, WIDTH, cradle, finger, formation, lowest_nearby, swing, two_fingers

from cfplan_core import (
    PlanOptions,
    PlanResult,
    Problem,
    explore,
    load_problem,
    plan,
    read_plan,
    verify_plan,
    write_plan,
)
from cfplan_core.contact.curvature import wrench_rates
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.gaps import gap_gradients
from cfplan_core.contact.system import ContactSystem
from cfplan_core.exploration import Exploration, configurations
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import Stability
from cfplan_core.mechanics.second_order import curvature
from cfplan_core.model import Goal, Grasp
from cfplan_core.planning.grasp_check import check_problem, describe_grasp
from cfplan_core.planning.manifold import project
from cfplan_core.trajectory.plan_margin import plan_margin, plan_ratios
from cfplan_core.trajectory.plan_result import Status
from cfplan_core.verification.mechanism import mechanism_of
from cfplan_core.verification.second_order import second_order_margin
from cfplan_core.verification.touching import parse_pair

FOLDER = Path(__file__).parents[1] / 'config' / 'problems'
LEDGES = load_problem(FOLDER / 'second_order' / 'square_between_ledges.yaml')


@cache
def between_ledges(prefer: str = 'first') -> PlanResult:
    return plan(LEDGES, PlanOptions(prefer=prefer))


def symmetric(problem: Problem, spread: float) -> Grasp:
    """The square upright on two fingertips that are WIDTH + 2 spread apart, at equal heights."""
    finger = problem.hand.fingers[1]
    x = WIDTH / 2 + spread - finger.base[0]
    reach = finger.links[0].length
    angle = np.pi - np.arccos(-x / reach)
    tip = finger.base[1] + reach * np.sin(angle)
    pose = (0.0, tip + HALF - (WIDTH / 2 + spread), 0.0)
    return Grasp(pose, (np.pi - angle, angle))


def moved(problem: Problem, start: Grasp, goal: Grasp) -> Problem:
    joints = dict(zip(problem.hand.joint_names, goal.joints, strict=True))
    return replace(problem, start=start, goal=Goal(goal.object_pose, joints))


@pytest.mark.parametrize('prefer', ['first', 'fewest-segments', 'shortest', 'robust'])
def test_way_between_ledges_leads_over_two_contacts_and_is_certified(prefer: str) -> None:
    result = between_ledges(prefer)
    assert result.solved, result.message
    assert [segment.stability for segment in result.segments] == [
        'force_closure',
        'second_order',
        'force_closure',
    ]
    report = verify_plan(LEDGES, result)
    assert report.ok, report.failures


def test_without_second_order_there_is_no_way_between_the_ledges() -> None:
    result = plan(LEDGES, PlanOptions(second_order=False))
    assert result.status is Status.INFEASIBLE
    assert 'with stability of first order was explored' in result.message


def test_torques_are_continuous_where_a_contact_lets_go() -> None:
    result = between_ledges()
    for k, segment in enumerate(result.segments[1:], start=1):
        at = segment.first_frame
        np.testing.assert_allclose(result.entry_lower[k], result.torque_lower[at], atol=1e-9)
        np.testing.assert_allclose(result.entry_upper[k], result.torque_upper[at], atol=1e-9)


def test_torque_of_two_contacts_is_that_of_virtual_work() -> None:
    """The joint raises the weight: τ = m g dy/dθ along the plan, by differences of its frames."""
    result = between_ledges()
    segment = result.segments[1]
    rows = slice(segment.first_frame, segment.last_frame + 1)
    height, angle = result.object_poses[rows, 1], result.joints[rows, 0]
    expected = 0.1 * 9.81 * np.gradient(height, angle)
    np.testing.assert_allclose(result.torque_lower[rows, 0][2:-2], expected[2:-2], atol=3e-4)
    np.testing.assert_array_equal(result.torque_lower[rows][1:], result.torque_upper[rows][1:])


def test_plan_file_keeps_the_class(tmp_path: Path) -> None:
    write_plan(between_ledges(), tmp_path / 'plan.json')
    again = read_plan(tmp_path / 'plan.json')
    assert again.segments == between_ledges().segments
    assert verify_plan(LEDGES, again).ok


def test_reversed_plan_is_certified() -> None:
    back = between_ledges().reversed()
    goal = LEDGES.goal.grasp(LEDGES.hand)
    assert goal is not None
    assert verify_plan(moved(LEDGES, goal, LEDGES.start), back).ok


def test_claim_of_force_closure_for_two_contacts_is_found() -> None:
    result = between_ledges()
    first, second, third = result.segments
    lie = replace(result, segments=(first, replace(second, stability='force_closure'), third))
    assert not verify_plan(LEDGES, lie).ok


def test_two_contacts_that_touch_but_do_not_balance_are_found() -> None:
    """The square of one frame turned by 1e-4 along both contacts, with the joint where it was."""
    result = between_ledges()
    system = ContactSystem(LEDGES)
    z = system.configuration(Grasp(result.object_poses[5], result.joints[5]))
    pairs = formation(system, *result.segments[1].contacts).array
    held = np.eye(system.dof)[[2, 3]]
    turned = project(system, pairs, z, held, (z + 1e-4 * np.eye(system.dof)[2])[None]).points
    poses = result.object_poses.copy()
    poses[5] = system.object_poses(turned)[0]
    report = verify_plan(LEDGES, replace(result, object_poses=poses))
    assert {(failure.frame, failure.check) for failure in report.failures} >= {(5, 'stability')}


def test_grasp_of_two_contacts_is_described_and_accepted() -> None:
    problem = cradle()
    described = describe_grasp(problem, problem.start)
    assert (described.stability, described.dimension) == ('second_order', 1)
    assert check_problem(problem) == ()


def test_rounded_grasp_of_two_contacts_is_brought_into_balance() -> None:
    problem = cradle()
    pose = tuple(np.round(np.array(problem.start.object_pose) + np.array([2e-8, -3e-8, 1e-7]), 9))
    joints = np.round(problem.start.joints, 7)
    rounded = replace(
        problem, start=Grasp(pose, joints), goal=Goal(contacts=('object.e2|palm.0.v2',))
    )
    assert describe_grasp(rounded, rounded.start).stability == 'second_order'
    result = plan(rounded)
    assert result.solved
    assert verify_plan(rounded, result).ok


@pytest.mark.parametrize('turn', [1e-4, 0.01])
def test_two_contacts_off_balance_are_refused(turn: float) -> None:
    """Turned along both contacts, so that they touch and do not hold."""
    problem = cradle()
    corner = WIDTH / 2 * np.array([np.sin(2.0 * turn), -np.cos(2.0 * turn)])
    pose = (corner[0] - HALF * np.sin(turn), corner[1] + HALF * np.cos(turn), turn)
    off = replace(problem, start=Grasp(pose, problem.start.joints))
    (finding,) = check_problem(off)
    assert finding.field == 'start'
    assert 'unstable' in finding.value


def test_start_of_two_contacts_is_refused_where_second_order_does_not_count() -> None:
    result = plan(cradle(), PlanOptions(second_order=False))
    assert result.status is Status.INVALID
    assert 'stability of second order does not count' in result.message
    assert 'at least three contacts' in result.message


@pytest.mark.parametrize(
    'options',
    [
        PlanOptions(),
        PlanOptions(prefer='shortest'),
        PlanOptions(max_needed_force=1.2),
        PlanOptions(max_contacts=3),
    ],
    ids=['first', 'shortest', 'force', 'contacts'],
)
def test_two_fingers_lower_the_square_by_spreading(options: PlanOptions) -> None:
    """On the way that is symmetric its height is known; the plan's ends lie on it."""
    problem = two_fingers(())
    problem = moved(problem, symmetric(problem, 0.0), symmetric(problem, 0.004))
    result = plan(problem, options)
    assert result.solved, result.message
    assert {segment.stability for segment in result.segments} == {'second_order'}
    report = verify_plan(problem, result)
    assert report.ok, report.failures


@pytest.mark.parametrize('seam', [None, 0.029], ids=['whole', 'in parts'])
def test_bar_swings_down_as_its_wall_turns(seam: float | None) -> None:
    problem = swing(seam)
    problem = replace(problem, goal=Goal(joints={'wall_joint': 0.5}))
    result = plan(problem)
    assert result.solved, result.message
    assert [s.stability for s in result.segments] == ['second_order'] * (1 if seam is None else 2)
    report = verify_plan(problem, result)
    assert report.ok, report.failures


@pytest.mark.parametrize('prefer', ['first', 'shortest'])
@pytest.mark.parametrize('turn', [0.3, -0.4])
def test_orientation_alone_is_reached_on_two_fingers(turn: float, prefer: str) -> None:
    problem = two_fingers(())
    start = symmetric(problem, 0.0)
    problem = replace(problem, start=start, goal=Goal(orientation=turn))
    result = plan(problem, PlanOptions(prefer=prefer))
    assert result.solved, result.message
    assert result.object_poses[-1, 2] == pytest.approx(turn, abs=1e-3)
    report = verify_plan(problem, result)
    assert report.ok, report.failures


def test_goal_of_exactly_two_contacts_is_reached_by_letting_the_ledge_go() -> None:
    pair = ('object.e2|palm.0.v2', 'object.e3|finger.link.v1')
    problem = replace(LEDGES, goal=Goal(contacts=pair, exact_contacts=True))
    result = plan(problem)
    assert result.solved, result.message
    assert result.segments[-1].contacts == pair
    assert verify_plan(problem, result).ok


@pytest.mark.parametrize('prefer', ['first', 'shortest'])
def test_hand_of_three_joints_moves_what_two_of_its_fingers_hold(prefer: str) -> None:
    problem = two_fingers(())
    far = finger('far', (0.3, 0.0))
    start, goal = (
        Grasp(grasp.object_pose, (*grasp.joints, angle))
        for grasp, angle in ((symmetric(problem, 0.0), 1.0), (symmetric(problem, 0.004), 1.2))
    )
    hand = replace(problem.hand, fingers=(*problem.hand.fingers, far))
    problem = moved(replace(problem, hand=hand), start, goal)
    result = plan(problem, PlanOptions(prefer=prefer))
    assert result.solved, result.message
    assert {segment.stability for segment in result.segments} == {'second_order'}
    assert verify_plan(problem, result).ok


def test_held_finger_leaves_a_curve() -> None:
    problem = two_fingers(())
    start = symmetric(problem, 0.002)
    name = problem.hand.joint_names[0]
    goal = Goal(joints={problem.hand.joint_names[1]: float(start.joints[1]) + 0.02})
    problem = replace(problem, start=start, goal=goal)
    result = plan(problem, PlanOptions(held_joints=(name,)))
    assert result.solved, result.message
    assert np.ptp(result.joints[:, 0]) == 0.0
    assert verify_plan(problem, result).ok


def test_exploration_shows_the_class_unless_it_does_not_count() -> None:
    found = explore(LEDGES)
    classes = [found.graph.nodes[k]['stability'] for k in found.graph]
    assert sorted(classes) == ['force_closure', 'force_closure', 'second_order']
    strict = explore(LEDGES, second_order=False)
    assert {strict.graph.nodes[k]['stability'] for k in strict.graph} == {'force_closure'}


@cache
def explored(name: str) -> Exploration:
    return explore(load_problem(FOLDER / f'{name}.yaml'))


def held_by_two(found: Exploration) -> Iterator[tuple[Formation, FloatArray]]:
    """Some configurations of all parts that are stable to second order."""
    for piece in found.pieces():
        if piece.stability is Stability.SECOND_ORDER:
            points = configurations(piece)
            yield piece.formation, points[:: max(1, len(points) // 6)]


def test_curvature_is_that_which_the_verifier_finds_by_differences_of_gaps() -> None:
    """Every part of the example that two contacts hold, far from the scenes made for them."""
    found = explored('h122')
    system, mechanism = found.system, mechanism_of(found.problem)
    compared = 0
    for formation_of_two, points in held_by_two(found):
        names = system.contact_names(formation_of_two.pairs)
        contacts = [parse_pair(name, mechanism) for name in names]
        placed = system.place(points)
        wrenches = gap_gradients(system, placed, formation_of_two.array)[..., :3]
        rates = wrench_rates(system, placed, formation_of_two.array)
        claimed = curvature(wrenches, rates, system.load)
        for z, value in zip(points, claimed, strict=True):
            scene = mechanism.scene(system.object_poses(z[None])[0], z[3:])
            expected = second_order_margin(mechanism, scene, contacts)
            assert value == pytest.approx(expected, rel=1e-4, abs=1e-5)
            assert expected > 0.0
            compared += 1
    assert compared > 20


def test_energy_is_least_wherever_two_contacts_are_said_to_hold() -> None:
    found = explored('h122')
    for formation_of_two, points in held_by_two(found):
        for z in points:
            margin = found.roadmap.tracer.margins(formation_of_two, z[None])
            if margin.stable[0] > 0.02:
                assert lowest_nearby(found.system, z, formation_of_two.array, 2e-3) > 0.0


def test_instant_of_second_order_between_two_segments_of_first_order_is_certified() -> None:
    """Two of four contacts stop pressing at once, and one of them presses again at once."""
    found = explored('h122')
    system, names = found.system, found.problem.hand.joint_names

    def grasp(z: FloatArray) -> Grasp:
        pose = tuple(system.object_poses(z[None])[0].round(9))
        return Grasp(pose, tuple(z[3:].round(9)))

    met = [
        (piece, other)
        for piece in found.pieces()
        for _, other in found.roadmap.settling.beside(piece)
        if piece.dimension == 1 and other.stability is Stability.FORCE_CLOSURE
    ]
    assert met
    for piece, other in met:
        points = configurations(other)
        start, goal = grasp(piece.points[len(piece.points) // 2]), grasp(points[len(points) // 2])
        joints = dict(zip(names, goal.joints, strict=True))
        problem = replace(found.problem, start=start, goal=Goal(goal.object_pose, joints))
        result = plan(problem)
        assert result.solved, result.message
        report = verify_plan(problem, result)
        assert report.ok, report.failures


def test_example_problem_has_the_same_plan_with_and_without() -> None:
    problem = load_problem(FOLDER / 'h122.yaml')
    with_it, without = (plan(problem, PlanOptions(second_order=s)) for s in (True, False))
    assert with_it.segments == without.segments
    np.testing.assert_array_equal(with_it.joints, without.joints)


def test_margin_does_not_vanish_where_the_square_settles() -> None:
    """Two contacts hold it there: what the third carries does not matter."""
    ratios = plan_ratios(LEDGES, between_ledges())
    for before, after in pairwise(ratios):
        assert min(before.hold[-1], after.hold[0]) > 0.5


@pytest.mark.parametrize('prefer', ['fewest-segments', 'shortest', 'robust'])
def test_margin_of_the_plan_over_two_contacts_is_that_of_its_frames(prefer: str) -> None:
    """Between frames motion is not quite straight: two contacts nearly balance the object."""
    result = between_ledges(prefer)
    assert result.margin == pytest.approx(plan_margin(LEDGES, result), rel=0.05)
    assert result.margin > 0.05
