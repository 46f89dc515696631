"""Each way in which a request can be wrong, and what its sender is told."""

from __future__ import annotations

import math
import time
from array import array
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from cfplan_msgs.msg import ContactFormation, ElementalContact
from cfplan_msgs.srv import PlanManipulation
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from hypothesis import given, settings
from hypothesis import strategies as st
from ros.conversions.example_files import STORY_FILE

from cfplan_core import Finding, Goal, PlanResult, Status, load_problem, plan
from cfplan_ros.conversions.hands import load_hand
from cfplan_ros.conversions.request_reading import MOST_VERTICES
from cfplan_ros.conversions.requests import (
    InvalidRequestError,
    Setup,
    invalid_grasps,
    problem_from_request,
    request_from_problem,
)

Request = PlanManipulation.Request
Response = PlanManipulation.Response
Edit = Callable[[Any], object]
STORY = load_problem(STORY_FILE)
SETUP = Setup(load_hand(STORY_FILE))
JOINTS, ANGLES = list(STORY.hand.joint_names), STORY.start.joints.tolist()
NAN, INF = math.nan, math.inf


def refused(request: Request, setup: Setup = SETUP) -> InvalidRequestError:
    with pytest.raises(InvalidRequestError) as caught:
        problem_from_request(request, setup)
    return caught.value


def edited(*edits: Edit) -> Request:
    request = request_from_problem(STORY)
    for edit in edits:
        edit(request)
    return request


def put(path: str, value: object) -> Edit:
    """An edit of one field, e.g. ``start.joints.name``; numbers are places in sequences."""

    def edit(request: Any) -> None:
        *steps, last = path.split('.')
        target = request
        for step in steps:
            target = target[int(step)] if step.isdigit() else getattr(target, step)
        if last.isdigit():
            target[int(last)] = value
        else:
            setattr(target, last, value)

    return edit


def corners(count: int) -> list[Point]:
    around = 2.0 * math.pi * np.arange(count) / max(count, 1)
    return [Point(x=0.03 * math.cos(a), y=0.03 * math.sin(a), z=0.0) for a in around]


CONTACT = {'object_element': 'v1', 'hand_body': 'palm.0', 'hand_element': 'e2'}


def contact(**parts: str) -> ElementalContact:
    return ElementalContact(**{**CONTACT, **parts})


WRONG: list[tuple[str, Edit, str, int, str, str]] = [
    # name, edit, field, code, said of the value, said of what was expected
    ('another hand', put('hand_digest', '12ab'), 'hand_digest', Response.HAND_MISMATCH,
     "'12ab'", SETUP.digest),
    ('foreign start frame', put('start.frame_id', 'world'), 'start.frame_id',
     Response.INVALID_FRAME, "'world'", "'palm'"),
    ('foreign goal frame', put('goal.frame_id', 'world'), 'goal.frame_id',
     Response.INVALID_FRAME, "'world'", "'palm'"),
    ('no joints', lambda r: (put('start.joints.name', [])(r), put('start.joints.position', [])(r)),
     'start.joints.name', Response.INVALID_START, 'no names', 'left_joint, right_joint'),
    ('an angle too few', put('start.joints.position', [0.6]), 'start.joints.position',
     Response.INVALID_START, '1 angles for 2 names', 'as many'),
    ('an angle too many', put('goal.joints.position', [0.6, 0.7, 0.8]), 'goal.joints.position',
     Response.INVALID_GOAL, '3 angles for 2 names', 'as many'),
    ('an unknown joint', lambda r: (put('start.joints.name', [*JOINTS, 'left_jiont'])(r),
                                    put('start.joints.position', [*ANGLES, 0.5])(r)),
     'start.joints.name[2]', Response.INVALID_START, '0.5', "'left_joint'"),
    ('an unknown goal joint', put('goal.joints.name', ['thumb', 'right_joint']),
     'goal.joints.name[0]', Response.INVALID_GOAL, '0.76', 'left_joint, right_joint'),
    ('a missing joint', lambda r: (put('start.joints.name', ['left_joint'])(r),
                                   put('start.joints.position', [0.6])(r)),
     'start.joints.name', Response.INVALID_START, "no 'right_joint'", 'rad'),
    ('a joint twice', put('goal.joints.name', ['left_joint', 'left_joint']), 'goal.joints.name[1]',
     Response.INVALID_GOAL, "'left_joint' again", 'once'),
    ('a joint beyond its limit', lambda r: (put('goal.object_pose', [])(r),
                                            put('goal.object_angle', [])(r),
                                            put('goal.joints.position', [0.7, 4.0])(r)),
     'goal.joints.position[1]', Response.INVALID_GOAL, '4.0', 'from 0.03 to 3.11'),
    ('an angle of NaN', put('start.joints.position', [0.6, NAN]), 'start.joints.position[1]',
     Response.INVALID_START, '.nan', 'rad'),
    ('a goal angle of infinity', put('goal.joints.position', [INF, 2.5]),
     'goal.joints.position[0]', Response.INVALID_GOAL, '.inf', 'rad'),
    ('joint velocities', put('start.joints.velocity', [0.0, 0.0]), 'start.joints.velocity',
     Response.INVALID_START, '2 values', 'none'),
    ('joint efforts', put('goal.joints.effort', [0.0]), 'goal.joints.effort',
     Response.INVALID_GOAL, '1 values', 'none'),
    ('no start pose', lambda r: (put('start.object_pose', [])(r),
                                 put('start.object_angle', [])(r)),
     'start.object_pose', Response.INVALID_START, 'nothing', 'a pose'),
    ('a start angle without a pose', put('start.object_pose', []), 'start.object_angle',
     Response.INVALID_START, 'without a pose', 'object_pose'),
    ('an angle of NaN alone', lambda r: (put('goal.object_pose', [])(r),
                                         put('goal.object_angle', [NAN])(r)),
     'goal.object_angle[0]', Response.INVALID_GOAL, '.nan', 'rad'),
    ('a position beside a pose', put('goal.object_position', [Point()]),
     'goal.object_position[0]', Response.INVALID_GOAL, 'beside object_pose', 'one of them'),
    ('a position out of the plane', lambda r: (put('goal.object_pose', [])(r),
                                               put('goal.object_position', [Point(z=0.1)])(r)),
     'goal.object_position[0].z', Response.INVALID_GOAL, '0.1', '0'),
    ('a position of the start', put('start.object_position', [Point()]),
     'start.object_position', Response.INVALID_START, 'a position', 'none'),
    ('exact contacts of the start', put('start.exact_contacts', True),
     'start.exact_contacts', Response.INVALID_START, 'true', 'false'),
    ('exact contacts without any', put('goal.exact_contacts', True),
     'goal.exact_contacts', Response.INVALID_GOAL, 'without contacts', 'contacts'),
    ('an unknown preference', put('options.prefer', 'best'),
     'options.prefer', Response.INVALID_OPTIONS, "'best'", 'shortest'),
    ('a resolution of NaN', put('options.resolution', NAN),
     'options.resolution', Response.INVALID_OPTIONS, 'nan', '0.001 to 1 rad'),
    ('a coarse resolution', put('options.resolution', 2.0),
     'options.resolution', Response.INVALID_OPTIONS, '2.0', '0.001 to 1 rad'),
    ('a negative force', put('options.max_needed_force', -1.0),
     'options.max_needed_force', Response.INVALID_OPTIONS, '-1.0', 'weights above zero'),
    ('a formation of nothing', put('options.required', [ContactFormation()]),
     'options.required', Response.INVALID_OPTIONS, '()', 'at least one name'),
    ('a region of a line', put('options.stay_within', [Point(x=x) for x in (0.0, 1.0, 2.0)]),
     'options.stay_within', Response.INVALID_OPTIONS, '2.0', 'convex polygon'),
    ('a region out of the plane',
     put('options.stay_within', [Point(), Point(x=1.0, z=0.5), Point(x=1.0, y=1.0)]),
     'options.stay_within[1].z', Response.INVALID_OPTIONS, '0.5', '0'),
    ('x of NaN', put('start.object_pose.0.position.x', NAN), 'start.object_pose[0].position.x',
     Response.INVALID_START, '.nan', 'm'),
    ('y of infinity', put('goal.object_pose.0.position.y', -INF), 'goal.object_pose[0].position.y',
     Response.INVALID_GOAL, '-.inf', 'm'),
    ('a pose out of the plane', put('start.object_pose.0.position.z', 1e-6),
     'start.object_pose[0].position.z', Response.INVALID_START, '1e-06', '0'),
    ('an unset quaternion', put('goal.object_pose.0.orientation',
                                Quaternion(x=0.0, y=0.0, z=0.0, w=0.0)),
     'goal.object_pose[0].orientation', Response.INVALID_GOAL, 'all zeros, as if unset', '0, 1'),
    ('a long quaternion', put('start.object_pose.0.orientation.w', 1.002),
     'start.object_pose[0].orientation', Response.INVALID_START, 'norm 1.002', 'norm 1'),
    ('a quaternion of NaN', put('start.object_pose.0.orientation.x', NAN),
     'start.object_pose[0].orientation', Response.INVALID_START, '.nan', 'norm 1'),
    ('a turn about x', put('start.object_pose.0.orientation',
                           Quaternion(x=math.sin(0.1), y=0.0, z=0.0, w=math.cos(0.1))),
     'start.object_pose[0].orientation', Response.INVALID_START, '0.0998', 'about z'),
    ('an angle beside its quaternion', put('start.object_angle', [0.01]), 'start.object_angle[0]',
     Response.INVALID_START, '0.01', 'agrees'),
    ('an angle of NaN beside a quaternion', put('goal.object_angle', [NAN]),
     'goal.object_angle[0]', Response.INVALID_GOAL, '.nan', 'finite'),
    ('start contacts', put('start.contact_formation.contacts', [contact()]),
     'start.contact_formation.contacts', Response.INVALID_START, '1 contacts', 'none'),
    ('an empty contact', put('goal.contact_formation.contacts', [contact(object_element='')]),
     'goal.contact_formation.contacts[0].object_element', Response.INVALID_GOAL, "''", 'vK or eK'),
    ('a part of a contact in the wrong field',
     put('goal.contact_formation.contacts', [contact(hand_body='palm', hand_element='0.e2')]),
     'goal.contact_formation.contacts[0].hand_element', Response.INVALID_GOAL, "'0.e2'", 'eK'),
    ('a vertex on a vertex',
     put('goal.contact_formation.contacts', [contact(), contact(hand_element='v2')]),
     'goal.contact_formation.contacts[1]', Response.INVALID_GOAL, 'palm.0.v2', 'object.vK'),
    ('a contact with an unknown body',
     put('goal.contact_formation.contacts', [contact(hand_body='left.link_9')]),
     'goal.contact_formation.contacts[0]', Response.INVALID_GOAL, 'left.link_9', 'left.link_1'),
    ('a contact with an unknown vertex',
     put('goal.contact_formation.contacts', [contact(object_element='v4')]),
     'goal.contact_formation.contacts[0]', Response.INVALID_GOAL, 'v4', 'v0 to v3'),
    ('a contact twice', put('goal.contact_formation.contacts', [contact(), contact()]),
     'goal.contact_formation.contacts[1]', Response.INVALID_GOAL, 'again', 'once'),
    ('no vertices', put('object.0.vertices', []), 'object[0].vertices', Response.INVALID_OBJECT,
     '0: []', '3 to'),
    ('one vertex', put('object.0.vertices', corners(1)), 'object[0].vertices',
     Response.INVALID_OBJECT, '1: [[0.03', '3 to'),
    ('two vertices', put('object.0.vertices', corners(2)), 'object[0].vertices',
     Response.INVALID_OBJECT, '2: [[', '3 to'),
    ('too many vertices', put('object.0.vertices', corners(MOST_VERTICES + 1)),
     'object[0].vertices', Response.INVALID_OBJECT, f'{MOST_VERTICES + 1} vertices',
     f'3 to {MOST_VERTICES}'),
    ('a vertex of NaN', put('object.0.vertices.2.y', NAN), 'object[0].vertices[2].y',
     Response.INVALID_OBJECT, '.nan', 'm'),
    ('a vertex out of the plane', put('object.0.vertices.1.z', 0.1), 'object[0].vertices[1].z',
     Response.INVALID_OBJECT, '0.1', '0'),
    ('a clockwise polygon', put('object.0.vertices', corners(5)[::-1]), 'object[0].vertices',
     Response.INVALID_OBJECT, 'clockwise', 'counter-clockwise'),
    ('a center of mass of infinity',
     put('object.0.center_of_mass', [Point(x=INF, y=0.0, z=0.0)]),
     'object[0].center_of_mass[0].x', Response.INVALID_OBJECT, '.inf', 'm'),
    ('a center of mass out of the plane', put('object.0.center_of_mass.0.z', NAN),
     'object[0].center_of_mass[0].z', Response.INVALID_OBJECT, '.nan', '0'),
    ('no mass', put('object.0.mass', 0.0), 'object[0].mass', Response.INVALID_OBJECT, '0.0',
     'greater than 0'),
    ('a negative mass', put('object.0.mass', -1.0), 'object[0].mass', Response.INVALID_OBJECT,
     '-1.0', 'greater than 0'),
    ('a mass of NaN', put('object.0.mass', NAN), 'object[0].mass', Response.INVALID_OBJECT,
     '.nan', 'kg'),
    ('gravity of NaN', put('gravity.0.y', NAN), 'gravity[0].y', Response.INVALID_GRAVITY, '.nan',
     'm/s²'),
    ('gravity out of the plane', put('gravity', [Vector3(x=0.0, y=0.0, z=-9.81)]), 'gravity[0].z',
     Response.INVALID_GRAVITY, '-9.81', '0'),
    ('a negative budget', put('options.time_budget.sec', -1), 'options.time_budget',
     Response.INVALID_OPTIONS, '-1 s', 'at least 0'),
    ('too many nanoseconds', put('options.time_budget.nanosec', 10**9), 'options.time_budget',
     Response.INVALID_OPTIONS, '1000000000 ns', 'less than 1 s'),
    ('a negative tolerance', put('options.position_tolerance', -1e-4),
     'options.position_tolerance', Response.INVALID_OPTIONS, '-0.0001', 'or 0 for'),
    ('a tolerance of NaN', put('options.angle_tolerance', NAN), 'options.angle_tolerance',
     Response.INVALID_OPTIONS, '.nan', 'rad'),
    ('a tolerance of infinity', put('options.joint_tolerance', INF), 'options.joint_tolerance',
     Response.INVALID_OPTIONS, '.inf', 'rad'),
]  # fmt: skip


@pytest.mark.parametrize(
    ('edit', 'field', 'code', 'value', 'expected'),
    [row[1:] for row in WRONG],
    ids=[row[0] for row in WRONG],
)
def test_what_is_wrong_is_the_one_finding_with_its_code(
    edit: Edit, field: str, code: int, value: str, expected: str
) -> None:
    error = refused(edited(edit))
    assert [finding.field for finding in error.findings] == [field]
    assert error.code == code
    assert value in error.findings[0].value
    assert expected in error.findings[0].expected


def test_an_empty_goal_is_refused() -> None:
    request = edited(
        put('goal.joints.name', []),
        put('goal.joints.position', []),
        put('goal.object_pose', []),
        put('goal.object_angle', []),
    )
    error = refused(request)
    assert error.code == Response.INVALID_GOAL
    assert error.findings == (
        Finding(
            'request',
            'goal',
            'nothing',
            'at least one of object_pose, object_position, object_angle, joints and '
            'contact_formation.contacts',
        ),
    )


def test_a_foreign_frame_does_not_hide_what_is_missing() -> None:
    request = edited(put('goal', Request().goal), put('start', Request().start))
    request.start.frame_id = request.goal.frame_id = 'world'
    fields = [finding.field for finding in refused(request).findings]
    assert fields == [
        'start.joints.name',
        'start.object_pose',
        'goal',
        'start.frame_id',
        'goal.frame_id',
    ]


def test_an_empty_goal_does_not_hide_a_wrong_tolerance() -> None:
    request = edited(put('goal', Request().goal), put('options.angle_tolerance', -1.0))
    fields = [finding.field for finding in refused(request).findings]
    assert fields == ['goal', 'options.angle_tolerance']


def test_a_misspelt_joint_is_unknown_and_missing() -> None:
    request = edited(put('start.joints.name', ['left_joint', 'rihgt_joint']))
    assert [(found.field, found.value) for found in refused(request).findings] == [
        ('start.joints.name[1]', '2.310677032 for an unknown joint'),
        ('start.joints.name', "no 'right_joint'"),
    ]


def test_everything_that_is_wrong_is_found_at_once_in_the_order_of_the_codes() -> None:
    request = edited(
        put('options.time_budget.sec', -1),
        put('gravity.0.x', NAN),
        put('object.0.mass', 0.0),
        put('goal.frame_id', 'world'),
        put('goal.joints.position', [NAN, NAN]),
        put('start.joints.velocity', [0.0]),
    )
    error = refused(request)
    assert [finding.field for finding in error.findings] == [
        'start.joints.velocity',
        'goal.joints.position[0]',
        'goal.joints.position[1]',
        'object[0].mass',
        'gravity[0].x',
        'options.time_budget',
        'goal.frame_id',
    ]
    assert error.code == Response.INVALID_START


def test_of_a_request_for_another_hand_nothing_else_is_said() -> None:
    error = refused(edited(put('hand_digest', 'another'), put('object.0.mass', 0.0)))
    assert [finding.field for finding in error.findings] == ['hand_digest']
    assert error.code == Response.HAND_MISMATCH


@pytest.mark.parametrize('part', ['start.object_pose', 'goal.object_angle', 'object', 'gravity'])
def test_two_values_where_one_may_be_are_refused(part: str) -> None:
    request = edited()
    owner: Any = request
    *path, field = part.split('.')
    for name in path:
        owner = getattr(owner, name)
    values = list(getattr(owner, field))
    setattr(owner, field, [*values, *values])
    (finding,) = refused(request).findings
    assert (finding.field, finding.value) == (part, '2 values')


def test_the_message_has_a_line_for_each_finding() -> None:
    error = refused(edited(put('object.0.mass', 0.0), put('start.joints.velocity', [0.0])))
    lines = str(error).splitlines()
    assert lines[0] == 'request: start.joints.velocity: got 1 values, expected none'
    assert lines[1].startswith('request: object[0].mass: got 0.0, expected a finite number')


def test_the_grasps_are_judged_also_if_something_else_is_wrong() -> None:
    request = edited(
        put('object.0.mass', -1.0), put('start.object_pose.0.position.y', 0.013043472)
    )
    found = {finding.field: finding.value for finding in refused(request).findings}
    assert 'object[0].mass' in found
    assert found['start.object_pose[0]'] == 'the object 0.01 m deep in palm.0'


def test_no_object_anywhere_is_not_configured() -> None:
    error = refused(edited(put('object', [])))
    assert error.code == Response.NOT_CONFIGURED
    assert [finding.field for finding in error.findings] == ['object']


def test_no_hand_is_not_configured() -> None:
    error = refused(edited(), replace(SETUP, hand=None))
    assert error.code == Response.NOT_CONFIGURED
    assert [finding.field for finding in error.findings] == ["the planner's hand"]


def test_a_hand_mismatch_says_both_digests() -> None:
    error = refused(edited(put('hand_digest', 'f' * 64)))
    assert 'f' * 64 in str(error)
    assert SETUP.digest in str(error)


def test_a_default_request_is_told_what_it_lacks() -> None:
    fields = [finding.field for finding in refused(Request()).findings]
    assert fields == ['object', 'start.joints.name', 'start.object_pose', 'goal']


def test_a_default_pose_is_no_turn_at_the_origin() -> None:
    # The interface sets w to 1, so only senders of other languages can leave zeros.
    request = edited(put('start.object_pose', [Pose()]), put('start.object_angle', []))
    problem, _ = problem_from_request(request, SETUP)
    assert problem.start.object_pose.tolist() == [0.0, 0.0, 0.0]


NUMBERS = (NAN, INF, -INF, 0.0, -1.0, 1e-300, 1e300, 0.5)
TEXTS = ('', ' ', 'x' * 10_000, 'left_joint', 'object', 'v0', 'e1', 'palm.0', '\n', 'é|.')
FIELDS = [
    *(f'{g}.object_pose.0.position.{a}' for g in ('start', 'goal') for a in 'xyz'),
    *(f'{g}.object_pose.0.orientation.{a}' for g in ('start', 'goal') for a in 'xyzw'),
    *(f'{g}.joints.position.{k}' for g in ('start', 'goal') for k in (0, 1)),
    *(f'object.0.vertices.{k}.{a}' for k in (0, 3) for a in 'xyz'),
    *(f'object.0.center_of_mass.0.{a}' for a in 'xyz'),
    *(f'gravity.0.{a}' for a in 'xyz'),
    'object.0.mass',
    *(f'options.{kind}_tolerance' for kind in ('position', 'angle', 'joint')),
]
NAMES = [
    'problem_name',
    'hand_digest',
    *(f'{g}.{field}' for g in ('start', 'goal') for field in ('frame_id', 'joints.name.0')),
    *(f'goal.contact_formation.contacts.0.{part}' for part in CONTACT),
]
SEQUENCES = [
    *(f'{g}.{field}' for g in ('start', 'goal') for field in ('object_angle', 'joints.velocity')),
]
EDITS = st.one_of(
    st.builds(put, st.sampled_from(FIELDS), st.sampled_from(NUMBERS)),
    st.builds(put, st.sampled_from(NAMES), st.sampled_from(TEXTS)),
    st.builds(
        put,
        st.sampled_from(SEQUENCES),
        st.lists(st.sampled_from(NUMBERS), max_size=1).map(lambda v: array('d', v)),
    ),
)


@given(st.lists(EDITS, min_size=1, max_size=6))
@settings(max_examples=100)
def test_any_request_is_a_problem_or_refused_with_a_code(edits: list[Edit]) -> None:
    request = request_from_problem(STORY)
    request.goal.contact_formation.contacts = [contact()]
    for edit in edits:
        edit(request)
    with suppress(InvalidRequestError):
        problem, _ = problem_from_request(request, SETUP)
        assert np.isfinite(problem.start.object_pose).all()
        return
    error = refused(request)
    assert Response.HAND_MISMATCH <= error.code <= Response.INVALID_FRAME
    assert all(finding.field and finding.value for finding in error.findings)


def test_a_quaternion_of_nan_beside_no_angle_is_refused() -> None:
    request = edited(put('goal.object_angle', []), put('goal.object_pose.0.orientation.z', NAN))
    fields = [finding.field for finding in refused(request).findings]
    assert fields == ['goal.object_pose[0].orientation']


def test_an_object_of_10000_vertices_is_refused_within_2_seconds() -> None:
    request = edited(put('object.0.vertices', corners(10_000)))
    began = time.process_time()
    error = refused(request)
    assert time.process_time() - began < 2.0
    assert error.code == Response.INVALID_OBJECT
    assert '10000 vertices' in str(error)


def test_an_object_of_the_most_vertices_is_judged_within_2_seconds() -> None:
    request = edited(put('object.0.vertices', corners(MOST_VERTICES)))
    began = time.process_time()
    problem, _ = problem_from_request(request, SETUP)
    result = plan(problem)
    assert time.process_time() - began < 2.0
    assert result.status is Status.INVALID


@pytest.mark.parametrize('part', ['joints', 'contacts', 'vertices'])
def test_a_flood_of_entries_is_refused_within_a_second(part: str) -> None:
    request = request_from_problem(STORY)
    count = 20_000
    if part == 'joints':
        request.start.joints.name = [f'joint_{k}' for k in range(count)]
        request.start.joints.position = [0.0] * count
    elif part == 'contacts':
        request.goal.contact_formation.contacts = [contact() for _ in range(count)]
    else:
        request.object[0].vertices = [Point(x=NAN, y=NAN, z=NAN)] * count
    began = time.process_time()
    error = refused(request)
    assert time.process_time() - began < 1.0
    assert str(count) in str(error)


def test_an_answer_holds_a_hundred_findings_and_counts_the_others() -> None:
    request = edited(put('object.0.vertices', [Point(x=NAN, y=0.0, z=1.0)] * 300))
    error = refused(request)
    assert error.code == Response.INVALID_OBJECT
    assert len(error.findings) == 101
    assert str(error).endswith('request: and 500 more')


def test_a_start_that_overlaps_is_told_in_the_words_of_the_request() -> None:
    request = edited(put('start.object_pose.0.position.y', 0.013043472))
    problem, options = problem_from_request(request, SETUP)
    result = plan(problem, options)
    error = invalid_grasps(result, problem, request, SETUP)
    assert error.code == Response.INVALID_START
    assert error.findings[0].field == 'start.object_pose[0]'


def test_a_goal_contact_that_does_not_touch_is_told_in_the_words_of_the_request() -> None:
    touching = Goal(STORY.goal.object_pose, STORY.goal.joints, ('object.v3|palm.0.e2',))
    request = request_from_problem(replace(STORY, goal=touching))
    problem, options = problem_from_request(request, SETUP)
    error = invalid_grasps(plan(problem, options), problem, request, SETUP)
    assert error.code == Response.INVALID_GOAL
    assert [finding.field for finding in error.findings] == ['goal.contact_formation.contacts']


def test_a_goal_that_only_the_planner_refuses_is_told_in_its_words() -> None:
    request = request_from_problem(STORY)
    problem, _ = problem_from_request(request, SETUP)
    wrong = (Finding('<problem>', 'goal', 'cannot be', ''),)
    names = STORY.hand.joint_names
    result = PlanResult('any', Status.INVALID, names, 'goal: cannot be', findings=wrong)
    error = invalid_grasps(result, problem, request, SETUP)
    assert (error.code, str(error)) == (Response.INVALID_GOAL, 'request: goal: cannot be')
