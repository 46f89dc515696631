"""The service ~/plan: requests that are wrong, one planner for all of them."""

from __future__ import annotations

import math
import time
from array import array
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from builtin_interfaces.msg import Duration
from cfplan_msgs.msg import ElementalContact, ObjectDescription
from cfplan_msgs.srv import PlanManipulation
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from ros.node.harness import STORY_FILE, Client, Code, Planner, story_request


def changed(path: str, value: Any) -> Callable[[Any], None]:
    """Make the function that sets a field of a request, given as ``goal.object_pose[0]``."""

    def change(request: Any) -> None:
        *parents, last = path.replace('[', '.').replace(']', '').split('.')
        target = request
        for name in parents:
            target = target[int(name)] if name.isdigit() else getattr(target, name)
        if last.isdigit():
            target[int(last)] = value
        else:
            setattr(target, last, value)

    return change


def polygon(vertices: int, radius: float = 0.02) -> ObjectDescription:
    angles = [2.0 * math.pi * k / max(vertices, 1) for k in range(vertices)]
    return ObjectDescription(
        vertices=[Point(x=radius * math.cos(a), y=radius * math.sin(a)) for a in angles], mass=0.1
    )


NOT_A_CONTACT = ElementalContact(
    object_element='v0', hand_body='palm.0', hand_element='the left one'
)
NOT_OF_THE_HAND = ElementalContact(object_element='v0', hand_body='foot', hand_element='e0')
ANGLES = array('d', [0.643034809, 2.310677032])

WRONG = {
    'another hand': ('hand_digest', 'ab' * 32, Code.HAND_MISMATCH, 'hand_digest'),
    'joint unknown': (
        'start.joints.name',
        ['left_joint', 'thumb'],
        Code.INVALID_START,
        'start.joints.name',
    ),
    'joint missing': (
        'start.joints.name',
        ['left_joint'],
        Code.INVALID_START,
        'start.joints.position',
    ),
    'joint twice': (
        'start.joints.name',
        ['left_joint', 'left_joint'],
        Code.INVALID_START,
        'start.joints.name[1]',
    ),
    'too few angles': (
        'start.joints.position',
        array('d', [0.6]),
        Code.INVALID_START,
        'start.joints.position',
    ),
    'angle not a number': (
        'start.joints.position',
        array('d', [math.nan, 2.3]),
        Code.INVALID_START,
        'start.joints.position[0]',
    ),
    'angle infinite': (
        'goal.joints.position',
        array('d', [0.7, math.inf]),
        Code.INVALID_GOAL,
        'goal.joints.position[1]',
    ),
    'joint beyond its limit': (
        'start.joints.position',
        array('d', [-1.0, 2.3]),
        Code.INVALID_START,
        'start.joints.position[0]',
    ),
    'joint velocities': ('start.joints.velocity', ANGLES, Code.INVALID_START, 'velocity'),
    'joint efforts': ('goal.joints.effort', ANGLES, Code.INVALID_GOAL, 'effort'),
    'start without pose': ('start.object_pose', [], Code.INVALID_START, 'without a pose'),
    'start that floats': (
        'start.object_pose[0].position.y',
        0.1,
        Code.INVALID_START,
        'start',
    ),
    'pose out of the plane': (
        'start.object_pose[0].position.z',
        0.1,
        Code.INVALID_START,
        'position.z',
    ),
    'pose not a number': (
        'start.object_pose[0].position.x',
        math.nan,
        Code.INVALID_START,
        'start.object_pose[0].position.x',
    ),
    'no orientation': (
        'start.object_pose[0].orientation',
        Quaternion(w=0.0),
        Code.INVALID_START,
        'all zeros',
    ),
    'orientation not of norm 1': (
        'goal.object_pose[0].orientation',
        Quaternion(w=2.0),
        Code.INVALID_GOAL,
        'norm 2',
    ),
    'orientation that tilts': (
        'goal.object_pose[0].orientation',
        Quaternion(x=1.0, w=0.0),
        Code.INVALID_GOAL,
        'turn about z',
    ),
    'angle that disagrees': (
        'start.object_angle',
        array('d', [1.0]),
        Code.INVALID_START,
        'start.object_angle[0]',
    ),
    'start with contacts': (
        'start.contact_formation.contacts',
        [NOT_OF_THE_HAND],
        Code.INVALID_START,
        'start.contact_formation.contacts',
    ),
    'contact misspelt': (
        'goal.contact_formation.contacts',
        [NOT_A_CONTACT],
        Code.INVALID_GOAL,
        'contacts[0].hand_element',
    ),
    'contact with another hand': (
        'goal.contact_formation.contacts',
        [NOT_OF_THE_HAND],
        Code.INVALID_GOAL,
        'goal.contact_formation.contacts[0]',
    ),
    'frame of the start': ('start.frame_id', 'world', Code.INVALID_FRAME, 'start.frame_id'),
    'frame of the goal': ('goal.frame_id', 'world', Code.INVALID_FRAME, 'goal.frame_id'),
    'no vertices': ('object', [polygon(0)], Code.INVALID_OBJECT, 'object[0].vertices'),
    'two vertices': ('object', [polygon(2)], Code.INVALID_OBJECT, 'object[0].vertices'),
    'vertex not a number': (
        'object[0].vertices[1].x',
        math.nan,
        Code.INVALID_OBJECT,
        'object[0].vertices[1].x',
    ),
    'vertex out of the plane': (
        'object[0].vertices[1].z',
        0.01,
        Code.INVALID_OBJECT,
        'object[0].vertices[1].z',
    ),
    'mass of nothing': ('object[0].mass', 0.0, Code.INVALID_OBJECT, 'object[0].mass'),
    'mass not a number': ('object[0].mass', math.nan, Code.INVALID_OBJECT, 'object[0].mass'),
    'gravity not a number': (
        'gravity',
        [Vector3(x=math.nan)],
        Code.INVALID_GRAVITY,
        'gravity[0].x',
    ),
    'gravity out of the plane': ('gravity', [Vector3(z=-9.81)], Code.INVALID_GRAVITY, 'gravity'),
    'time that runs back': (
        'options.time_budget',
        Duration(sec=-1),
        Code.INVALID_OPTIONS,
        'options.time_budget',
    ),
    'tolerance below zero': (
        'options.position_tolerance',
        -1.0,
        Code.INVALID_OPTIONS,
        'options.position_tolerance',
    ),
    'tolerance not a number': (
        'options.angle_tolerance',
        math.nan,
        Code.INVALID_OPTIONS,
        'options.angle_tolerance',
    ),
}


@pytest.fixture(scope='module')
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    """A client of a planner that is there for many requests."""
    planner = Planner(
        hand_file=str(STORY_FILE),
        object_file=str(STORY_FILE),
        record_directory=str(tmp_path_factory.mktemp('runs')),
    )
    client = Client()
    yield client
    client.close()
    planner.close()


@pytest.mark.parametrize(('path', 'value', 'code', 'field'), WRONG.values(), ids=WRONG)
def test_wrong_request_is_answered_with_code_and_field(
    served: Client, path: str, value: Any, code: int, field: str
) -> None:
    request = story_request()
    changed(path, value)(request)
    response = served.plan(request)
    assert response.error_code == code, response.error_msg
    assert field in response.error_msg
    assert not response.plan.joint_trajectory.points


def test_everything_that_is_wrong_is_said_at_once(served: Client) -> None:
    request = story_request()
    request.start.joints.velocity = [0.0]
    request.object[0].mass = -1.0
    request.goal.object_pose = [Pose(position=Point(z=1.0))]
    response = served.plan(request)
    assert response.error_code == Code.INVALID_START
    for field in ('start.joints.velocity', 'goal.object_pose[0].position.z', 'object[0].mass'):
        assert field in response.error_msg


def test_empty_request_is_answered(served: Client) -> None:
    response = served.plan(PlanManipulation.Request())
    assert response.error_code == Code.INVALID_START


def test_object_of_ten_thousand_vertices_is_answered_soon(served: Client) -> None:
    request = story_request()
    request.object = [polygon(10_000)]
    began = time.monotonic()
    response = served.plan(request)
    assert response.error_code in (Code.INVALID_OBJECT, Code.INVALID_START)
    assert time.monotonic() - began < 5.0


def test_planner_plans_after_a_wrong_request(served: Client) -> None:
    request = story_request()
    request.object[0].mass = math.nan
    served.plan(request)
    assert served.plan(story_request()).error_code == Code.NONE
