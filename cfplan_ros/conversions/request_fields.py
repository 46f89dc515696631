"""Names of a problem's fields as the sender of a request knows them, and their error codes."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from cfplan_msgs.srv import PlanManipulation

from cfplan_core.errors import CfplanError, Finding

REQUEST = 'request'
"""Name of the request in findings."""

MOST_FINDINGS = 100
"""Findings that an answer carries."""

_OWN = "the planner's "

_CODES = {
    'hand_digest': PlanManipulation.Response.HAND_MISMATCH,
    'start.frame_id': PlanManipulation.Response.INVALID_FRAME,
    'goal.frame_id': PlanManipulation.Response.INVALID_FRAME,
    'start': PlanManipulation.Response.INVALID_START,
    'goal': PlanManipulation.Response.INVALID_GOAL,
    'object': PlanManipulation.Response.INVALID_OBJECT,
    'gravity': PlanManipulation.Response.INVALID_GRAVITY,
    'options': PlanManipulation.Response.INVALID_OPTIONS,
}


class InvalidRequestError(CfplanError):
    """A request cannot be planned as it is.

    Attributes:
        code: Of ``PlanManipulation.Response``, that of the first finding.
        findings: Everything that is wrong, in the order of the error codes.
    """

    def __init__(self, findings: Iterable[Finding]) -> None:
        """Sort the findings, of which there is at least one with a field."""
        ordered = sorted((found for found in findings if found.field), key=_code)
        self.code: int = _code(ordered[0])
        more = len(ordered) - MOST_FINDINGS
        if more > 0:
            ordered[MOST_FINDINGS:] = [Finding(REQUEST, '', f'and {more} more', '')]
        self.findings = tuple(ordered)
        super().__init__('\n'.join(str(finding) for finding in self.findings))


@dataclass(frozen=True)
class Origin:
    """Where the values of a problem come from.

    Attributes:
        joint_names: Of the request, by the field that the grasp has, ``start`` or ``goal``.
        angles: Grasps whose ``object_angle`` is given.
        own_object: True if the object is the planner's.
        own_gravity: True if gravity is the planner's.
    """

    joint_names: dict[str, Sequence[str]]
    angles: frozenset[str]
    own_object: bool
    own_gravity: bool


def as_sent(finding: Finding, origin: Origin) -> Finding:
    """Translate a finding on a problem into one on the request that it was made of.

    Args:
        finding: With a field of the format ``cfplan/problem/1``.
        origin: Where the problem's values come from.
    """
    top, _, rest = finding.field.partition('.')
    base = top.partition('[')[0]
    finding = replace(finding, file=REQUEST)
    own = ('hand', 'contact') + ('object',) * origin.own_object + ('gravity',) * origin.own_gravity
    if base in own:
        return replace(finding, field=_OWN + finding.field)
    if base == 'gravity':
        return replace(finding, field='gravity[0]' + _axes(top.removeprefix('gravity')))
    if base == 'object':
        rest = re.sub(r'^center_of_mass', 'center_of_mass[0]', rest)
        return replace(finding, field='object[0]' + (f'.{_axes(rest)}' if rest else ''))
    if rest.startswith('tolerance'):
        return _tolerance(finding, rest)
    if rest.startswith('contacts'):
        return replace(finding, field=f'{top}.contact_formation.{rest}')
    if rest.startswith('object_pose'):
        return replace(finding, field=f'{top}.{_pose(rest, top in origin.angles)}')
    if rest.startswith('position'):
        axes = _axes(rest.removeprefix('position'))
        return replace(finding, field=f'{top}.object_position[0]{axes}')
    if rest == 'orientation':
        return replace(finding, field=f'{top}.object_angle[0]')
    if rest.startswith('joints.'):
        return _joint(finding, top, rest.removeprefix('joints.'), origin.joint_names[top])
    return finding


def _code(finding: Finding) -> int:
    field = finding.field
    if field == 'object' or field.startswith(_OWN):
        return int(PlanManipulation.Response.NOT_CONFIGURED)
    for part in ('.'.join(field.split('.')[:2]), re.split(r'[.\[]', field)[0]):
        if part in _CODES:
            return int(_CODES[part])
    return int(PlanManipulation.Response.UNKNOWN)


def _axes(text: str) -> str:
    """Write the last index of a point, or of a list of points, as an axis."""
    text = re.sub(r'^(vertices\[\d+\]|center_of_mass\[0\]|)\[0\]$', r'\1.x', text)
    return re.sub(r'^(vertices\[\d+\]|center_of_mass\[0\]|)\[1\]$', r'\1.y', text)


def _pose(text: str, angle_given: bool) -> str:
    turn = 'object_angle[0]' if angle_given else 'object_pose[0].orientation'
    return {
        'object_pose': 'object_pose[0]',
        'object_pose[0]': 'object_pose[0].position.x',
        'object_pose[1]': 'object_pose[0].position.y',
        'object_pose[2]': turn,
    }.get(text, text)


def _tolerance(finding: Finding, text: str) -> Finding:
    kind = text.removeprefix('tolerance.').replace('joints', 'joint')
    return replace(
        finding,
        field=f'options.{kind}_tolerance',
        expected=f"{finding.expected}, or 0 for the planner's default",
    )


def _joint(finding: Finding, grasp: str, name: str, names: Sequence[str]) -> Finding:
    if name not in names:
        return replace(finding, field=f'{grasp}.joints.name', value=f'no {name!r}')
    array = 'name' if finding.value.endswith('unknown joint') else 'position'
    return replace(finding, field=f'{grasp}.joints.{array}[{list(names).index(name)}]')
