"""A request as data of the format ``cfplan/problem/1``, and what that format cannot find wrong."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from cfplan_msgs.msg import Grasp, ObjectDescription
from cfplan_msgs.srv import PlanManipulation
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3

from cfplan_core.errors import Finding
from cfplan_core.model.faults import shown
from cfplan_ros.conversions.contacts import contact_name
from cfplan_ros.conversions.poses import nearest_turn, turn_about_z, wrapped
from cfplan_ros.conversions.request_fields import REQUEST, Origin
from cfplan_ros.conversions.setup import Setup
from cfplan_ros.conversions.times import NANOSECONDS

MOST_VERTICES = 1000
"""Of an object; with more, checking the grasps alone takes seconds."""

MOST_NAMES = 1000
"""Of joints or contacts in one grasp."""

OUT_OF_PLANE = 1e-9
"""m, or m/s², that a z may differ from zero."""

ROUNDING = 1e-3
"""By which a quaternion's norm may differ from 1, and its angle, rad, from ``object_angle``."""

_TILT = 1e-6
_ELEMENT = re.compile(r'[ve][0-9]+')
_NOT_IN_A_NAME = re.compile(r'[/\\\n\r\t]')


class RequestReader:
    """One request, read.

    Attributes:
        mapping: The problem; values that are found wrong here are left out of it.
        findings: What is found wrong here, with fields of the request.
        origin: Where the values of the mapping come from.
        other_hand: True if the request is for another hand; the first finding says so.
    """

    def __init__(self, request: PlanManipulation.Request, setup: Setup) -> None:
        """Read a request.

        Args:
            request: As it came.
            setup: What the planner brings.
        """
        self.findings: list[Finding] = []
        self.other_hand = False
        self._reported: list[str] = []
        self._without_goal = False
        self._setup = setup
        self._compare_digest(request.hand_digest)
        self._at_most_one_of_each(request)
        start = self._grasp('start', request.start)
        goal = self._grasp('goal', request.goal, start.get('object_pose'))
        self._start_only(request.start)
        self._goal_only(request.goal, goal)
        goal['tolerance'] = self._tolerance(request)
        self._budget(request)
        self.mapping: dict[str, Any] = {
            'format': 'cfplan/problem/1',
            'name': request.problem_name if _is_name(request.problem_name) else 'unnamed',
            'gravity': self._gravity(request.gravity),
            'hand': setup.hand,
            'object': self._object(request.object),
            'contact': {'friction': setup.friction},
            'start': start,
            'goal': goal,
        }
        self.origin = Origin(
            joint_names={
                'start': list(request.start.joints.name),
                'goal': list(request.goal.joints.name),
            },
            angles=frozenset(
                name
                for name, grasp in (('start', request.start), ('goal', request.goal))
                if len(grasp.object_angle)
            ),
            own_object=not len(request.object),
            own_gravity=not len(request.gravity),
        )

    def reported(self, field: str) -> bool:
        """Tell whether a finding on a field of the mapping only follows from those made here."""
        return (field == 'goal' and self._without_goal) or any(
            field == part or field.startswith((f'{part}.', f'{part}[')) for part in self._reported
        )

    def _wrong(self, field: str, value: object, expected: str, *consequences: str) -> None:
        """Note a finding, and the fields of the mapping that need no other."""
        text = value if isinstance(value, _Said) else shown(value)
        self.findings.append(Finding(REQUEST, field, str(text), expected))
        self._reported += consequences

    def _compare_digest(self, digest: str) -> None:
        if self._setup.hand is None:
            self._wrong(
                "the planner's hand", _Said('none'), 'a hand: the planner is not configured'
            )
        elif digest and digest.lower() != self._setup.digest:
            self.other_hand = True
            self._wrong(
                'hand_digest',
                digest,
                f"{self._setup.digest!r}, the digest of the planner's hand; for another hand "
                'start a planner with it (cfplan node FILE) or set the parameter hand_file',
            )

    def _at_most_one_of_each(self, request: PlanManipulation.Request) -> None:
        """Refuse more values than a field may hold; not every serializer does."""
        fields = {
            'start.object_pose': request.start.object_pose,
            'start.object_angle': request.start.object_angle,
            'goal.object_pose': request.goal.object_pose,
            'goal.object_angle': request.goal.object_angle,
            'start.object_position': request.start.object_position,
            'goal.object_position': request.goal.object_position,
            'object': request.object,
            'gravity': request.gravity,
        }
        if len(request.object):
            fields['object[0].center_of_mass'] = request.object[0].center_of_mass
        for field, values in fields.items():
            if len(values) > 1:
                self._wrong(field, _Said(f'{len(values)} values'), 'one value at most')

    def _grasp(
        self, field: str, grasp: Grasp, start_pose: Sequence[float] | None = None
    ) -> dict[str, Any]:
        """Read what start and goal have in common."""
        values: dict[str, Any] = {}
        pose = self._object_pose(field, grasp, start_pose)
        if pose is not None:
            values['object_pose'] = pose
        joints = self._joints(field, grasp)
        if joints:
            values['joints'] = joints
        return values

    def _object_pose(
        self, field: str, grasp: Grasp, start_pose: Sequence[float] | None
    ) -> list[float] | None:
        before = len(self.findings)
        part = f'{field}.object_pose'
        if grasp.frame_id not in ('', self._setup.frame_id):
            self._wrong(
                f'{field}.frame_id',
                grasp.frame_id,
                f"{self._setup.frame_id!r}, the planner's frame, or nothing",
                part,
            )
        if not len(grasp.object_pose):
            if len(grasp.object_angle) and field == 'start':
                self._wrong(
                    f'{field}.object_angle',
                    _Said('an angle without a pose'),
                    'an object_pose with it',
                    part,
                )
            return None
        pose: Pose = grasp.object_pose[0]
        self._planar(f'{part}[0].position', pose.position, 'm', part)
        self._turn(f'{part}[0].orientation', pose.orientation, part)
        angle = turn_about_z(pose.orientation)
        if len(grasp.object_angle):
            angle = self._exact_angle(field, float(grasp.object_angle[0]), angle)
        if len(self.findings) > before:
            return None
        if start_pose is not None and not len(grasp.object_angle):
            angle = nearest_turn(angle, start_pose[2])
        return [float(pose.position.x), float(pose.position.y), angle]

    def _turn(self, field: str, q: Quaternion, part: str) -> None:
        parts = (float(q.x), float(q.y), float(q.z), float(q.w))
        text = _Said('(' + ', '.join(shown(value) for value in parts) + ')')
        norm = math.hypot(*parts)
        if not any(parts):
            self._wrong(
                field,
                _Said('all zeros, as if unset'),
                'a quaternion, (0, 0, 0, 1) for no turn',
                part,
            )
        elif not abs(norm - 1.0) <= ROUNDING:
            self._wrong(
                field,
                _Said(f'{text} of norm {norm:.6g}'),
                'a quaternion (x, y, z, w) of norm 1',
                part,
            )
        elif math.hypot(parts[0], parts[1]) > _TILT:
            self._wrong(field, text, 'a turn about z: x and y of the quaternion zero', part)

    def _exact_angle(self, field: str, angle: float, turn: float) -> float:
        part = f'{field}.object_pose'
        if not math.isfinite(angle):
            self._wrong(f'{field}.object_angle[0]', angle, 'a finite number of rad', part)
        elif not self.reported(part) and not abs(wrapped(angle - turn)) <= ROUNDING:
            self._wrong(
                f'{field}.object_angle[0]',
                angle,
                f'an angle that agrees with object_pose[0].orientation, {turn:.9g} rad '
                'and whole turns',
                part,
            )
        return angle

    def _joints(self, field: str, grasp: Grasp) -> dict[str, float]:
        state, part = grasp.joints, f'{field}.joints'
        for unwanted in ('velocity', 'effort'):
            count = len(getattr(state, unwanted))
            if count:
                self._wrong(f'{part}.{unwanted}', _Said(f'{count} values'), 'none')
        names, angles = list(state.name), list(state.position)
        if len(names) > MOST_NAMES:
            self._wrong(f'{part}.name', _Said(f'{len(names)} names'), 'one per joint', part)
        elif len(names) != len(angles):
            self._wrong(
                f'{part}.position',
                _Said(f'{len(angles)} angles for {len(names)} names'),
                'as many angles, rad, as names',
                part,
            )
        else:
            return self._angles(part, names, angles)
        return {}

    def _angles(self, part: str, names: list[str], angles: list[float]) -> dict[str, float]:
        joints: dict[str, float] = {}
        for k, (name, angle) in enumerate(zip(names, angles, strict=True)):
            if name in joints:
                self._wrong(f'{part}.name[{k}]', _Said(f'{shown(name)} again'), 'each joint once')
            joints.setdefault(name, float(angle))
        return joints

    def _start_only(self, start: Grasp) -> None:
        hand = self._setup.built_hand
        if hand is not None and not len(start.joints.name) and not self.reported('start.joints'):
            self._wrong(
                'start.joints.name',
                _Said('no names'),
                f'the joints of the hand: {", ".join(hand.joint_names)}',
                'start.joints',
            )
        if not len(start.object_pose) and not len(start.object_angle):
            self._wrong('start.object_pose', _Said('nothing'), 'a pose', 'start.object_pose')
        if len(start.object_position):
            self._wrong(
                'start.object_position', _Said('a position'), 'none: object_pose says where it is'
            )
        if start.exact_contacts:
            self._wrong('start.exact_contacts', True, 'false: a start names no contacts')
        count = len(start.contact_formation.contacts)
        if count:
            self._wrong(
                'start.contact_formation.contacts',
                _Said(f'{count} contacts'),
                'none: they follow from pose and joints',
            )

    def _goal_only(self, goal: Grasp, values: dict[str, Any]) -> None:
        contacts = list(goal.contact_formation.contacts)
        part = 'goal.contact_formation.contacts'
        if len(contacts) > MOST_NAMES:
            self._wrong(
                part, _Said(f'{len(contacts)} contacts'), f'at most {MOST_NAMES}', 'goal.contacts'
            )
        elif contacts:
            values['contacts'] = [contact_name(contact) for contact in contacts]
            for k, contact in enumerate(contacts):
                for element in ('object_element', 'hand_element'):
                    text = getattr(contact, element)
                    if not _ELEMENT.fullmatch(text):
                        self._wrong(
                            f'{part}[{k}].{element}',
                            text,
                            'a vertex or an edge: vK or eK',
                            f'goal.contacts[{k}]',
                        )
        self._parts_of_pose(goal, values)
        if goal.exact_contacts:
            values['exact_contacts'] = True
        self._without_goal = not values
        state = goal.joints
        poses = (goal.object_pose, goal.object_angle, goal.object_position)
        if not any(len(part) for part in (*poses, state.name, state.position, contacts)):
            self._wrong(
                'goal',
                _Said('nothing'),
                'at least one of object_pose, object_position, object_angle, joints and '
                'contact_formation.contacts',
            )

    def _parts_of_pose(self, goal: Grasp, values: dict[str, Any]) -> None:
        """Read an angle without a pose, and a position."""
        if len(goal.object_angle) and not len(goal.object_pose):
            angle = float(goal.object_angle[0])
            if math.isfinite(angle):
                values['orientation'] = angle
            else:
                self._wrong('goal.object_angle[0]', angle, 'a finite number of rad')
        if len(goal.object_position):
            field = 'goal.object_position[0]'
            position = self._planar(field, goal.object_position[0], 'm', 'goal.position')
            if position is not None:
                values['position'] = position

    def _tolerance(self, request: PlanManipulation.Request) -> dict[str, float]:
        options = request.options
        given = {
            'position': float(options.position_tolerance),
            'angle': float(options.angle_tolerance),
            'joints': float(options.joint_tolerance),
        }
        return {kind: value for kind, value in given.items() if value != 0.0}

    def _budget(self, request: PlanManipulation.Request) -> None:
        budget = request.options.time_budget
        if budget.sec < 0 or budget.nanosec >= NANOSECONDS:
            self._wrong(
                'options.time_budget',
                _Said(f'{budget.sec} s and {budget.nanosec} ns'),
                'at least 0 s, and less than 1 s in nanosec',
            )

    def _gravity(self, gravity: Sequence[Vector3]) -> list[float] | None:
        if not len(gravity):
            return [float(value) for value in self._setup.gravity]
        return self._planar('gravity[0]', gravity[0], 'm/s²', 'gravity')

    def _object(self, descriptions: Sequence[ObjectDescription]) -> Mapping[str, Any] | None:
        if not len(descriptions):
            if self._setup.object is None:
                self._wrong(
                    'object', _Said('none'), 'an object: the planner has none of its own', 'object'
                )
            return self._setup.object
        described = descriptions[0]
        values: dict[str, Any] = {'mass': float(described.mass)}
        count = len(described.vertices)
        if count > MOST_VERTICES:
            self._wrong(
                'object[0].vertices',
                _Said(f'{count} vertices'),
                f'3 to {MOST_VERTICES} vertices, m, of a simple polygon, counter-clockwise',
                'object.vertices',
            )
        else:
            values['vertices'] = [[float(p.x), float(p.y)] for p in described.vertices]
            for k, vertex in enumerate(described.vertices):
                self._in_plane(f'object[0].vertices[{k}]', vertex)
        if len(described.center_of_mass):
            center = described.center_of_mass[0]
            self._in_plane('object[0].center_of_mass[0]', center)
            values['center_of_mass'] = [float(center.x), float(center.y)]
        return values

    def _planar(
        self, field: str, point: Point | Vector3, unit: str, part: str
    ) -> list[float] | None:
        """Read x and y; None if one is not finite or z is not zero."""
        before = len(self.findings)
        values = {'x': float(point.x), 'y': float(point.y)}
        for axis, value in values.items():
            if not math.isfinite(value):
                self._wrong(f'{field}.{axis}', value, f'a finite number of {unit}', part)
        self._in_plane(field, point, part)
        return list(values.values()) if len(self.findings) == before else None

    def _in_plane(self, field: str, point: Point | Vector3, *consequences: str) -> None:
        if not abs(point.z) <= OUT_OF_PLANE:
            self._wrong(
                f'{field}.z', float(point.z), '0: bodies move in the plane z = 0', *consequences
            )


def _is_name(text: str) -> bool:
    """Tell whether the format allows a name, in a time that grows with its length only."""
    return bool(text.strip()) and not _NOT_IN_A_NAME.search(text)


class _Said(str):
    """A finding's value that is already in words."""
