from __future__ import annotations

import math
import time
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from cfplan_msgs.msg import PlanOptions as OptionsMessage
from cfplan_msgs.srv import PlanManipulation
from hypothesis import given
from hypothesis import strategies as st
from ros.conversions.example_files import STORY_FILE

from cfplan_core import (
    CfplanError,
    Goal,
    Grasp,
    ManipulatedObject,
    PlanOptions,
    PlanResult,
    Preference,
    Problem,
    Tolerance,
    TrajectoryOptions,
    load_problem,
    plan,
)
from cfplan_core.model.loading import problem_from_mapping
from cfplan_ros.conversions.hands import load_hand, load_object
from cfplan_ros.conversions.poses import pose_message
from cfplan_ros.conversions.requests import (
    Setup,
    invalid_grasps,
    problem_from_request,
    problem_mapping,
    request_from_problem,
    time_budget,
)
from cfplan_ros.conversions.times import duration_message

STORY = load_problem(STORY_FILE)
SETUP = Setup(load_hand(STORY_FILE))
CONTACTS = ['object.v0|palm.0.e2', 'object.v1|palm.0.e2', 'object.e3|left.link_1.v2']


def assert_identical(one: Problem, other: Problem) -> None:
    assert one.name == other.name
    assert one.friction == other.friction
    assert one.goal.contacts == other.goal.contacts
    assert one.goal.joints == other.goal.joints
    assert one.goal.tolerance == other.goal.tolerance
    assert one.goal.orientation == other.goal.orientation
    assert one.goal.exact_contacts == other.goal.exact_contacts
    np.testing.assert_array_equal(one.goal.position, other.goal.position)
    assert one.object.mass == other.object.mass
    assert one.hand.joint_names == other.hand.joint_names
    assert (one.goal.object_pose is None) == (other.goal.object_pose is None)
    pairs = [
        (one.gravity, other.gravity),
        (one.object.vertices, other.object.vertices),
        (one.object.center_of_mass, other.object.center_of_mass),
        (one.start.object_pose, other.start.object_pose),
        (one.start.joints, other.start.joints),
        *zip(
            one.hand.world_vertices(one.start.joints).values(),
            other.hand.world_vertices(other.start.joints).values(),
            strict=True,
        ),
    ]
    if one.goal.object_pose is not None and other.goal.object_pose is not None:
        pairs.append((one.goal.object_pose, other.goal.object_pose))
    for ours, theirs in pairs:
        assert ours.tobytes() == theirs.tobytes()


numbers = st.floats(-1e3, 1e3)
poses = st.tuples(numbers, numbers, st.floats(-30.0, 30.0)).map(np.array)
angles = st.floats(0.04, 3.1)
tolerances = st.floats(1e-9, 1.0)


@st.composite
def problems(draw: st.DrawFn) -> Problem:
    """Any problem for the hand of 1991; its grasps need not hold anything."""
    count = draw(st.integers(3, 12))
    around = 2.0 * math.pi * (np.arange(count) + draw(st.floats(0.0, 0.5))) / count
    radii = np.array(draw(st.lists(st.floats(0.02, 0.04), min_size=count, max_size=count)))
    parts = draw(st.sets(st.sampled_from(['pose', 'joints', 'contacts']), min_size=1))
    joints = draw(st.dictionaries(st.sampled_from(STORY.hand.joint_names), angles, min_size=1))
    return Problem(
        name=draw(st.text(st.characters(codec='utf-8'))),
        gravity=np.array(draw(st.tuples(numbers, numbers))),
        hand=STORY.hand,
        object=ManipulatedObject(
            radii[:, None] * np.stack([np.cos(around), np.sin(around)], axis=1),
            draw(st.floats(1e-6, 1e3)),
            np.array(draw(st.tuples(numbers, numbers))),
        ),
        friction=0.0,
        start=Grasp(draw(poses), np.array(draw(st.tuples(angles, angles)))),
        goal=Goal(
            object_pose=draw(poses) if 'pose' in parts else None,
            joints=joints if 'joints' in parts else None,
            contacts=tuple(
                draw(st.permutations(['object.v0|palm.0.e2', 'object.e1|left.link_1.v2']))
            )
            if 'contacts' in parts
            else None,
            tolerance=Tolerance(draw(tolerances), draw(tolerances), draw(tolerances)),
        ),
    )


@given(problems())
def test_a_problem_survives_a_request(problem: Problem) -> None:
    assert_identical(problem_from_request(request_from_problem(problem), SETUP)[0], problem)


@given(st.floats(1e-9, 1e6), st.integers(1, 2**32 - 1))
def test_the_limits_of_a_search_survive_a_request(budget: float, max_nodes: int) -> None:
    given_options = PlanOptions(budget, max_nodes)
    options = problem_from_request(request_from_problem(STORY, given_options), SETUP)[1]
    assert options.max_nodes == max_nodes
    assert options.time_budget == pytest.approx(budget, abs=0.51e-9, rel=1e-15)


def test_an_example_survives_a_request_and_has_the_same_plan(
    example: tuple[Path, Problem, PlanResult],
) -> None:
    file, problem, planned = example
    sent, options = problem_from_request(request_from_problem(problem), Setup(load_hand(file)))
    assert_identical(sent, problem)
    assert options == PlanOptions()
    result = plan(sent, options)
    for part in ('times', 'joints', 'object_poses', 'torque_lower', 'torque_upper'):
        assert getattr(result, part).tobytes() == getattr(planned, part).tobytes()
    assert result.segments == planned.segments


def test_an_example_is_the_same_problem_as_data_of_a_file(
    example: tuple[Path, Problem, PlanResult],
) -> None:
    file, problem, _ = example
    mapping = problem_mapping(request_from_problem(problem), Setup(load_hand(file)))
    reading = problem_from_mapping(mapping)
    assert not reading.findings
    assert reading.problem is not None
    assert_identical(reading.problem, problem)


@pytest.mark.parametrize('name', ['', ' ', 'a/b', 'line\nbreak'])
def test_a_name_that_no_file_has_reaches_the_plan_and_not_the_data(name: str) -> None:
    request = request_from_problem(replace(STORY, name=name))
    assert problem_from_request(request, SETUP)[0].name == name
    assert problem_mapping(request, SETUP)['name'] == 'unnamed'


def test_a_very_long_name_is_judged_at_once() -> None:
    request = request_from_problem(replace(STORY, name='a' * 100_000 + '/'))
    began = time.perf_counter()
    assert problem_mapping(request, SETUP)['name'] == 'unnamed'
    assert time.perf_counter() - began < 2.0


def test_object_and_gravity_are_the_planners_where_the_request_has_none() -> None:
    setup = replace(SETUP, object=load_object(STORY_FILE), gravity=(1.5, -2.5))
    request = request_from_problem(STORY)
    request.object, request.gravity = [], []
    problem, _ = problem_from_request(request, setup)
    assert problem.object.vertices.tobytes() == STORY.object.vertices.tobytes()
    assert problem.gravity.tolist() == [1.5, -2.5]


def test_the_centroid_is_the_center_of_mass_where_the_request_has_none() -> None:
    request = request_from_problem(STORY)
    request.object[0].center_of_mass = []
    problem, _ = problem_from_request(request, SETUP)
    centroid = ManipulatedObject(STORY.object.vertices, 1.0).center_of_mass
    assert problem.object.center_of_mass.tobytes() == centroid.tobytes()


def test_tolerances_are_the_planners_where_the_request_has_zero() -> None:
    request = request_from_problem(STORY)
    options = request.options
    options.position_tolerance = options.angle_tolerance = options.joint_tolerance = 0.0
    assert problem_from_request(request, SETUP)[0].goal.tolerance == Tolerance()


def test_joints_are_told_by_name_and_not_by_place() -> None:
    request = request_from_problem(STORY)
    for grasp in (request.start, request.goal):
        grasp.joints.name = list(reversed(grasp.joints.name))
        grasp.joints.position = list(reversed(grasp.joints.position))
    assert_identical(problem_from_request(request, SETUP)[0], STORY)


@given(st.floats(-40.0, 40.0))
def test_the_start_without_an_exact_angle_is_within_half_a_turn_of_zero(angle: float) -> None:
    request = request_from_problem(STORY)
    request.start.object_pose = [pose_message(np.array([0.0, 0.0, angle]))]
    request.start.object_angle = []
    problem, _ = problem_from_request(request, SETUP)
    found = float(problem.start.object_pose[2])
    assert -math.pi < found <= math.pi
    assert abs(math.remainder(found - angle, 2.0 * math.pi)) < 1e-12


@given(st.floats(-40.0, 40.0), st.floats(-40.0, 40.0))
def test_the_goal_without_an_exact_angle_is_within_half_a_turn_of_the_start(
    start: float, goal: float
) -> None:
    poses = np.array([[0.0, 0.0, start], [0.0, 0.0, goal]])
    request = request_from_problem(
        replace(
            STORY,
            start=replace(STORY.start, object_pose=poses[0]),
            goal=Goal(object_pose=poses[1]),
        )
    )
    request.goal.object_angle = []
    problem, _ = problem_from_request(request, SETUP)
    assert problem.goal.object_pose is not None
    found = float(problem.goal.object_pose[2])
    assert abs(found - start) <= math.pi + 1e-12
    assert abs(math.remainder(found - goal, 2.0 * math.pi)) < 1e-12


@pytest.mark.parametrize('turns', [-2, 1])
def test_whole_turns_of_the_exact_angle_count(turns: int) -> None:
    request = request_from_problem(STORY)
    request.goal.object_angle = [request.goal.object_angle[0] + turns * 2.0 * math.pi]
    problem, _ = problem_from_request(request, SETUP)
    assert problem.goal.object_pose is not None
    assert problem.goal.object_pose[2] == request.goal.object_angle[0]


@pytest.mark.parametrize(
    ('wanted', 'default', 'most', 'expected'),
    [
        (0.0, None, None, (None, False)),
        (0.0, 5.0, None, (5.0, False)),
        (0.0, 5.0, 60.0, (5.0, False)),
        (0.0, None, 60.0, (60.0, False)),
        (2.5, 5.0, 60.0, (2.5, False)),
        (60.0, 5.0, 60.0, (60.0, False)),
        (61.0, 5.0, 60.0, (60.0, True)),
        (61.0, 5.0, None, (61.0, False)),
    ],
)
def test_a_budget_is_the_requests_or_the_default_and_never_above_the_most(
    wanted: float,
    default: float | None,
    most: float | None,
    expected: tuple[float | None, bool],
) -> None:
    setup = replace(SETUP, default_time_budget=default, maximal_time_budget=most)
    request = request_from_problem(STORY)
    request.options.time_budget = duration_message(wanted)
    assert time_budget(request, setup) == expected
    assert problem_from_request(request, setup)[1].time_budget == expected[0]


def test_the_planners_frame_may_be_named() -> None:
    request = request_from_problem(STORY, frame_id='hand_plane')
    setup = replace(SETUP, frame_id='hand_plane')
    assert_identical(problem_from_request(request, setup)[0], STORY)


def test_the_digest_may_be_left_out_or_written_in_capitals() -> None:
    request = request_from_problem(STORY)
    for digest in ('', request.hand_digest.upper()):
        request.hand_digest = digest
        assert_identical(problem_from_request(request, SETUP)[0], STORY)


def test_friction_is_not_silently_dropped() -> None:
    with pytest.raises(CfplanError, match=r'contact\.friction: got 0\.3, expected 0'):
        request_from_problem(replace(STORY, friction=0.3))


@pytest.mark.parametrize(
    'goal',
    [
        Goal(orientation=-7.5, tolerance=Tolerance(angle=0.3)),
        Goal(position=(0.001, 0.02)),
        Goal(position=(0.001, 0.02), orientation=4.0),
        Goal(contacts=tuple(CONTACTS), exact_contacts=True),
        Goal(orientation=0.25, joints={'left_joint': 0.7}, contacts=tuple(CONTACTS[:1])),
    ],
    ids=['orientation', 'position', 'both', 'formation', 'mix'],
)
def test_goal_in_part_is_the_same_after_its_way(goal: Goal) -> None:
    problem = replace(STORY, goal=goal)
    received, _ = problem_from_request(request_from_problem(problem), SETUP)
    assert_identical(problem, received)


EVERYTHING = PlanOptions(
    time_budget=3.5,
    max_nodes=77,
    resolution=0.02,
    max_needed_force=2.5,
    max_contacts=4,
    forbidden=(tuple(CONTACTS[:2]), (CONTACTS[2],)),
    required=(tuple(CONTACTS[1:]),),
    held_joints=('left_joint',),
    stay_within=((-0.1, 0.0), (0.1, 0.0), (0.0, 0.1)),
    second_order=False,
    prefer=Preference.ROBUST,
    alternatives=3,
    trajectory=TrajectoryOptions(2.0, 0.1, 0.02, 0.5),
    seed=5,
)


@pytest.mark.parametrize('options', [PlanOptions(), EVERYTHING], ids=['none', 'all'])
def test_options_are_the_same_after_their_way(options: PlanOptions) -> None:
    _, received = problem_from_request(request_from_problem(STORY, options), SETUP)
    assert received == options


def test_every_option_is_asked_for_in_the_test_above() -> None:
    default = PlanOptions()
    same = [
        f.name for f in fields(default) if getattr(EVERYTHING, f.name) == getattr(default, f.name)
    ]
    assert same == []


def test_what_is_not_asked_is_left_to_the_planner() -> None:
    request = request_from_problem(STORY)
    request.options = OptionsMessage()
    setup = replace(SETUP, default_preference='shortest', default_resolution=0.1)
    _, options = problem_from_request(request, setup)
    assert options == PlanOptions(prefer=Preference.SHORTEST, resolution=0.1)


def test_options_that_only_the_problem_shows_to_be_wrong_are_named() -> None:
    options = PlanOptions(held_joints=('thumb',))
    request = request_from_problem(STORY, options)
    problem, received = problem_from_request(request, SETUP)
    error = invalid_grasps(plan(problem, received), problem, request, SETUP)
    assert error.code == PlanManipulation.Response.INVALID_OPTIONS
    assert [finding.field for finding in error.findings] == ['options.held_joints']
    assert "'thumb'" in str(error)
