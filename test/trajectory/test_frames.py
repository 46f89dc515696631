from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from planning.scenes import (
    BASE,
    FEET,
    HALF,
    LEFT,
    TIPS,
    at,
    pushed_angles,
    pushed_block,
    squeezed_angles,
    squeezed_trapezoid,
)
from random_problems import distant_goal, explore, random_problem
from scipy.optimize import linprog

from cfplan_core.contact.detection import touching
from cfplan_core.contact.elements import parse_contact
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.gaps import gaps
from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.model import Finger, Grasp, Hand, Problem
from cfplan_core.model.loading import load_problem
from cfplan_core.options import ACCELERATION
from cfplan_core.planning.grasp_check import examine_problem
from cfplan_core.planning.roadmap import Roadmap
from cfplan_core.planning.search import Leg, Search
from cfplan_core.trajectory.frames import Frames, build_frames, grazing_legs, overloaded_legs
from cfplan_core.trajectory.plan_result import Segment
from cfplan_core.trajectory.timing import fastest, joint_velocities, rest_frames, strongest

PROBLEMS = Path(__file__).parents[2] / 'config' / 'problems'
WEIGHT = 0.1 * 9.81
# Of the format cfplan/plan/1: of a joint or the object's angle in rad, of its position in sizes.
LARGEST = 0.05


@dataclass(frozen=True, eq=False)
class Case:
    """A path and its frames."""

    system: ContactSystem
    model: FrictionlessModel
    legs: list[Leg]
    frames: Frames

    @property
    def z(self) -> FloatArray:
        """All frames, shape (f, 3 + n)."""
        pairs = zip(self.frames.object_poses, self.frames.joints, strict=True)
        return np.array([self.system.configuration(Grasp(*pair)) for pair in pairs])


def case(problem: Problem, start: FloatArray, goal: FloatArray) -> Case:
    system = ContactSystem(problem)
    model = FrictionlessModel(system.load)
    search = Search(Roadmap(system, model), start, goal)
    assert search.run()
    legs = search.path()
    return Case(system, model, legs, build_frames(system, model, legs))


def between_grasps(problem: Problem) -> Case:
    system = ContactSystem(problem)
    examined = examine_problem(system, FrictionlessModel(system.load))
    assert examined.goal is not None
    return case(problem, examined.start.z, examined.goal.z)


def pushed(problem: Problem, start: float, goal: float) -> Case:
    """Slide the block from place to place."""
    system = ContactSystem(problem)
    return case(problem, *(at(system, x, pushed_angles(x)) for x in (start, goal)))


def squeezed() -> Case:
    system = ContactSystem(squeezed_trapezoid())
    ends = (at(system, x, squeezed_angles(x)) for x in (-0.0045, 0.0095))
    return case(squeezed_trapezoid(), *ends)


def random_case(seed: int) -> Case:
    problem = random_problem(seed)
    far = distant_goal(problem, explore(problem), seed)
    assert far is not None
    return between_grasps(far)


@pytest.fixture(scope='module')
def cases() -> dict[str, Case]:
    return {
        '1991': between_grasps(load_problem(PROBLEMS / 'trinkle_hunter_1991.yaml')),
        'pushed': pushed(pushed_block(), -0.0045, 0.005),
        'squeezed': squeezed(),
        **{f'random {seed}': random_case(seed) for seed in (6, 15, 22)},
    }


NAMES = ('1991', 'pushed', 'squeezed', 'random 6', 'random 15', 'random 22')
every_case = pytest.mark.parametrize('name', NAMES)


@every_case
def test_steps_are_within_the_limits_of_the_format(name: str, cases: dict[str, Case]) -> None:
    frames, size = cases[name].frames, cases[name].system.size
    assert np.abs(np.diff(frames.joints, axis=0)).max() <= LARGEST
    assert np.abs(np.diff(frames.object_poses[:, 2])).max() <= LARGEST
    moved = np.linalg.norm(np.diff(frames.object_poses[:, :2], axis=0), axis=1)
    assert moved.max() <= LARGEST * size


@every_case
def test_times_strictly_increase_from_zero(name: str, cases: dict[str, Case]) -> None:
    times = cases[name].frames.times
    assert times[0] == 0.0
    assert (np.diff(times) > 0.0).all()


@every_case
def test_joints_keep_their_limits_between_frames(name: str, cases: dict[str, Case]) -> None:
    """And some limit is used: no stretch between rests takes much longer than it has to."""
    frames = cases[name].frames
    limits = [joint.velocity_limit for joint in cases[name].system.problem.hand.joints]
    rests = rest_frames(frames.joints, frames.segments)
    velocities = joint_velocities(frames.times, frames.joints, rests)
    speeds = fastest(frames.times, frames.joints, velocities) / limits
    strengths = strongest(frames.times, frames.joints, velocities) / ACCELERATION
    assert (speeds <= 1.0 + 1e-9).all()
    assert (strengths <= 1.0 + 1e-5).all()


@every_case
def test_inertial_forces_are_small_beside_the_weight(name: str, cases: dict[str, Case]) -> None:
    it = cases[name]
    center = it.z[:, :2] * it.system.size
    rates = np.diff(center, axis=0) / np.diff(it.frames.times)[:, None]
    spans = 0.5 * (np.diff(it.frames.times)[1:] + np.diff(it.frames.times)[:-1])
    acceleration = np.linalg.norm(np.diff(rates, axis=0), axis=1) / spans
    assert (acceleration <= 0.05 * 9.81).all()


@every_case
def test_segments_cover_all_frames_and_share_their_ends(name: str, cases: dict[str, Case]) -> None:
    frames = cases[name].frames
    segments = frames.segments
    assert segments[0].first_frame == 0
    assert segments[-1].last_frame == len(frames.times) - 1
    for before, after in pairwise(segments):
        assert before.last_frame == after.first_frame
    assert all(segment.first_frame < segment.last_frame for segment in segments)


@every_case
def test_segments_are_the_legs(name: str, cases: dict[str, Case]) -> None:
    it = cases[name]
    assert [(s.contacts, s.stability) for s in it.frames.segments] == [
        (it.system.contact_names(leg.formation.pairs), leg.stability.value) for leg in it.legs
    ]


@every_case
def test_legs_begin_and_end_at_their_segments_frames(name: str, cases: dict[str, Case]) -> None:
    it = cases[name]
    for leg, segment in zip(it.legs, it.frames.segments, strict=True):
        ends = it.z[[segment.first_frame, segment.last_frame]]
        np.testing.assert_allclose(ends, leg.points[[0, -1]], atol=1e-9)


@every_case
def test_frames_of_a_segment_touch_its_contacts(name: str, cases: dict[str, Case]) -> None:
    it = cases[name]
    for leg, segment in zip(it.legs, it.frames.segments, strict=True):
        z = it.z[segment.first_frame : segment.last_frame + 1]
        gap = gaps(it.system, it.system.place(z), leg.formation.array).gap
        np.testing.assert_allclose(gap, 0.0, atol=1e-11)


@every_case
def test_frames_inside_a_segment_touch_nothing_else(name: str, cases: dict[str, Case]) -> None:
    it = cases[name]
    for leg, segment in zip(it.legs, it.frames.segments, strict=True):
        for z in it.z[segment.first_frame + 1 : segment.last_frame]:
            assert tuple(touching(it.system, z, 1e-7).tolist()) == leg.formation.pairs


@every_case
def test_there_are_not_many_more_frames_than_steps_of_the_largest_size(
    name: str, cases: dict[str, Case]
) -> None:
    """Paths are traced with points as near as events are: most of them are left out."""
    it = cases[name]
    needed = 0
    for leg in it.legs:
        change = np.abs(np.diff(leg.points, axis=0)).sum(axis=0).max()
        needed += math.ceil(float(change) / LARGEST)
    assert len(it.frames.times) <= 4 * needed + 2


def torque_limits(
    problem: Problem, frames: Frames, segment: Segment, index: int
) -> tuple[FloatArray, FloatArray]:
    """Limits that a segment's contacts set at a frame by linear programming, in N·m.

    From world positions, for fingers of one massless link: a contact that pushes the object with
    force c along its normal n at p asks for the torque (p - base) × c n.
    """
    joints = frames.joints[index]
    outlines = problem.hand.world_vertices(joints)
    outline = problem.object.world_vertices(frames.object_poses[index])
    pose = frames.object_poses[index]
    c, s = np.cos(pose[2]), np.sin(pose[2])
    com = pose[:2] + np.array([[c, -s], [s, c]]) @ problem.object.center_of_mass
    wrenches, levers = [], []
    for name in segment.contacts:
        contact = parse_contact(name)
        body = outlines[contact.body]
        vertices, edges = (outline, body) if contact.object_vertex else (body, outline)
        point = vertices[contact.vertex]
        along = edges[(contact.edge + 1) % len(edges)] - edges[contact.edge]
        outward = np.array([along[1], -along[0]]) / np.linalg.norm(along)
        normal = outward if contact.object_vertex else -outward
        wrenches.append([*normal, _cross(point - com, normal)])
        levers.append(
            [
                _cross(point - finger.base, normal)
                if contact.body.startswith(finger.name)
                else 0.0
                for finger in problem.hand.fingers
            ]
        )
    load = problem.object.mass * np.array([*problem.gravity, 0.0])
    limits = []
    for sign in (1.0, -1.0):
        ends = []
        for lever in np.array(levers).T:
            found = linprog(sign * lever, A_eq=np.array(wrenches).T, b_eq=-load)
            assert found.status in (0, 3)
            ends.append(-sign * np.inf if found.fun is None else sign * found.fun)
        limits.append(np.array(ends))
    return limits[0], limits[1]


def _cross(a: FloatArray, b: FloatArray) -> float:
    return float(a[0] * b[1] - a[1] * b[0])


@every_case
def test_torque_limits_are_those_of_a_linear_program(name: str, cases: dict[str, Case]) -> None:
    """Inside segments: at their ends form closure may be won or lost by rounding."""
    it = cases[name]
    for segment in it.frames.segments:
        inside = range(segment.first_frame + 1, segment.last_frame)
        for index in inside[:: max(1, len(inside) // 3)]:
            lower, upper = torque_limits(it.system.problem, it.frames, segment, index)
            np.testing.assert_allclose(it.frames.torque_lower[index], lower, atol=1e-9, rtol=1e-7)
            np.testing.assert_allclose(it.frames.torque_upper[index], upper, atol=1e-9, rtol=1e-7)


def test_form_closure_is_where_some_torque_is_unbounded(cases: dict[str, Case]) -> None:
    frames = cases['squeezed'].frames
    for segment in frames.segments:
        inside = slice(segment.first_frame + 1, segment.last_frame)
        limits = np.concatenate([frames.torque_lower[inside], frames.torque_upper[inside]])
        assert np.isinf(limits).any() == (segment.stability == 'form_closure')


def test_torque_limits_of_a_pushed_block_are_those_found_by_hand(
    cases: dict[str, Case],
) -> None:
    """Both tips press with s, at heights a and b; s |a - b| shifts the weight at most to a foot.

    The left finger's torque is clockwise, s a; the right one's is s b. None is needed.
    """
    frames = cases['pushed'].frames
    heights = np.sin(frames.joints) * [LEFT, 0.045]
    force = WEIGHT * HALF / np.abs(heights[:, 0] - heights[:, 1])
    np.testing.assert_allclose(frames.torque_upper[:, 0], 0.0, atol=1e-12)
    np.testing.assert_allclose(frames.torque_lower[:, 1], 0.0, atol=1e-12)
    np.testing.assert_allclose(frames.torque_lower[:, 0], -force * heights[:, 0], rtol=1e-9)
    np.testing.assert_allclose(frames.torque_upper[:, 1], force * heights[:, 1], rtol=1e-9)


@pytest.mark.parametrize('name', ['1991', 'random 15', 'random 22'])
def test_frame_shared_by_two_formations_has_the_limits_of_the_earlier(
    name: str, cases: dict[str, Case]
) -> None:
    it = cases[name]
    segments = it.frames.segments
    different = 0
    for before, after in pairwise(segments):
        if before.contacts != after.contacts:
            index = before.last_frame
            given = np.concatenate([limits[index] for limits in _limits(it.frames)])
            earlier, later = (
                np.concatenate(torque_limits(it.system.problem, it.frames, segment, index))
                for segment in (before, after)
            )
            np.testing.assert_allclose(given, earlier, atol=1e-9, rtol=1e-6)
            different += not np.allclose(earlier, later, rtol=1e-3)
    assert different > 0


def _limits(frames: Frames) -> tuple[FloatArray, FloatArray]:
    return frames.torque_lower, frames.torque_upper


def with_fingers(problem: Problem, *fingers: Finger) -> Problem:
    return replace(problem, hand=Hand(problem.hand.palm, fingers))


def test_slow_joint_sets_the_pace() -> None:
    left, right = pushed_block().hand.fingers
    slow = replace(right, joints=(replace(right.joints[0], velocity_limit=0.01),))
    frames = pushed(with_fingers(pushed_block(), left, slow), 0.0, 0.004).frames
    turned = abs(frames.joints[-1, 1] - frames.joints[0, 1])
    assert turned / 0.01 <= frames.times[-1] <= 1.5001 * turned / 0.01


def test_weight_of_a_link_is_added_to_both_limits() -> None:
    """Of a triangle from the joint to the tip, a third of the way to which its centroid lies."""
    left, right = pushed_block().hand.fingers
    heavy = replace(left, links=(replace(left.links[0], mass=0.2),))
    light = pushed(pushed_block(), 0.0, 0.002).frames
    frames = pushed(with_fingers(pushed_block(), heavy, right), 0.0, 0.002).frames
    needed = 0.2 * 9.81 * LEFT / 3.0 * np.cos(frames.joints[:, 0])
    for limits, without in zip(_limits(frames), _limits(light), strict=True):
        np.testing.assert_allclose(limits[:, 0] - without[:, 0], needed, rtol=1e-9)
        np.testing.assert_allclose(limits[:, 1], without[:, 1], rtol=1e-9)


@pytest.mark.parametrize(('part', 'overloaded'), [(1.001, []), (0.999, [0])])
def test_leg_is_overloaded_where_a_joint_cannot_hold_the_pull(
    part: float, overloaded: list[int]
) -> None:
    """Gravity pulls the block to the left with 0.3 N, which the left tip, at most at the height
    that it has at x = -0.002, must hold; the right one can stay at zero.
    """
    problem = replace(pushed_block(), gravity=(-3.0, -9.0))
    highest = math.sqrt(LEFT**2 - (BASE - HALF - 0.002) ** 2)
    left, right = problem.hand.fingers
    effort = part * 0.1 * 3.0 * highest
    weak = replace(left, joints=(replace(left.joints[0], effort_limit=effort),))
    weaker = replace(right, joints=(replace(right.joints[0], effort_limit=1e-9),))
    it = pushed(with_fingers(problem, weak, weaker), -0.002, 0.002)
    assert overloaded_legs(it.system, it.model, it.legs) == overloaded


def test_nothing_is_overloaded_that_stands_by_itself() -> None:
    problem = pushed_block()
    weak = [
        replace(finger, joints=(replace(finger.joints[0], effort_limit=1e-9),))
        for finger in problem.hand.fingers
    ]
    it = pushed(with_fingers(problem, *weak), -0.002, 0.002)
    assert overloaded_legs(it.system, it.model, it.legs) == []


def test_path_that_stays_is_one_segment_of_the_start() -> None:
    it = pushed(pushed_block(), 0.001, 0.001)
    (segment,) = it.frames.segments
    assert segment.contacts == (*FEET, *TIPS)
    assert segment.last_frame == len(it.frames.times) - 1
    np.testing.assert_allclose(it.z, np.tile(it.z[0], (len(it.z), 1)), atol=1e-15)
    assert (np.diff(it.frames.times) > 0.0).all()


def test_a_short_leg_along_the_border_of_its_formation_is_found() -> None:
    problem = load_problem(PROBLEMS / 'h045.yaml')
    system = ContactSystem(problem)
    model = FrictionlessModel(system.load)
    curve = Roadmap(system, model).root(examine_problem(system, model).start.z)
    pairs = curve.formation.pairs
    points = curve.points[:2]
    along = Leg(0, curve.formation, curve.stability, points)
    border = replace(along, formation=Formation(pairs[:-1]))
    # The last contact is open somewhere on the way if it is at one of the ends.
    opening = points.copy()
    opening[1, 1] += 0.01
    away = replace(border, points=opening)
    assert grazing_legs(system, [along, border, away]) == [1]
