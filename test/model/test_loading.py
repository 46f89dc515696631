import copy
import json
import math
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from cfplan_core.errors import InvalidProblemError
from cfplan_core.model.loading import load_problem, problem_from_mapping, read_problem
from cfplan_core.model.schema import problem_schema

PROBLEMS = sorted((Path(__file__).parents[2] / 'config' / 'problems').glob('*.yaml'))

SOUND = {
    'format': 'cfplan/problem/1',
    'name': 'two_fingers',
    'gravity': [0.0, -9.81],
    'hand': {
        'palm': [{'vertices': [[-0.4, -0.1], [0.4, -0.1], [0.4, 0.0], [-0.4, 0.0]]}],
        'fingers': [
            {
                'name': side,
                'base': [x, 0.0],
                'base_angle': 0.0,
                'joints': [
                    {
                        'name': f'{side}_{k}',
                        'limits': [-1.0, 2.0],
                        'velocity_limit': 1.0,
                        'effort_limit': 5.0,
                    }
                    for k in (1, 2)
                ],
                'links': [
                    {
                        'name': f'link_{k}',
                        'length': 0.1,
                        'vertices': [[0.0, 0.0], [0.1, 0.0], [0.1, 0.01], [0.0, 0.01]],
                    }
                    for k in (1, 2)
                ],
            }
            for side, x in (('left', -0.2), ('right', 0.2))
        ],
    },
    'object': {'vertices': [[0.0, 0.0], [0.03, 0.0], [0.03, 0.03], [0.0, 0.03]], 'mass': 0.1},
    'contact': {'friction': 0.0},
    'start': {
        'object_pose': [0.0, 0.0, 0.0],
        'joints': {'left_1': 0.1, 'left_2': 0.2, 'right_1': 0.3, 'right_2': 0.4},
    },
    'goal': {'object_pose': [0.1, 0.0, 0.0]},
}
JOINT = ('hand', 'fingers', 1, 'joints', 0)
LINK = ('hand', 'fingers', 1, 'links', 0)
GONE = object()


def changed(*changes):
    """The sound problem with the value at each path replaced, or taken out if GONE."""
    data = copy.deepcopy(SOUND)
    for path, value in changes:
        owner = data
        for step in path[:-1]:
            owner = owner[step]
        if value is GONE:
            del owner[path[-1]]
        else:
            owner[path[-1]] = value
    return data


def findings(*changes):
    return problem_from_mapping(changed(*changes)).findings


def only_finding(*changes):
    found = findings(*changes)
    assert len(found) == 1, found
    return found[0]


def fields(found):
    return [finding.field for finding in found]


def read_text(tmp_path, text):
    path = tmp_path / 'problem.yaml'
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_problem(path)


def all_paths(data, path=()):
    yield path
    steps = data.items() if isinstance(data, dict) else enumerate(data)
    for step, value in steps:
        if isinstance(value, dict | list):
            yield from all_paths(value, (*path, step))
        else:
            yield (*path, step)


# What is sound


@pytest.mark.parametrize('path', PROBLEMS, ids=lambda path: path.stem)
def test_shipped_problem_has_no_findings(path):
    reading = read_problem(path)
    assert reading.findings == ()
    assert reading.problem.name == path.stem


def test_there_are_ten_shipped_problems():
    assert len(PROBLEMS) == 10


def test_values_arrive_where_they_belong():
    problem = problem_from_mapping(
        changed(
            (('gravity',), [1, -2]),
            ((*JOINT, 'acceleration_limit'), 7),
            ((*LINK, 'mass'), 0.5),
            (('object', 'center_of_mass'), [0.01, 0.02]),
            (('contact', 'friction'), 0.3),
            (('goal', 'joints'), {'right_2': 1}),
            (('goal', 'contacts'), ['object.v0|palm.0.e2', 'object.e3|left.link_2.v1']),
            (('goal', 'tolerance'), {'angle': 0.5}),
        )
    ).problem
    assert problem.gravity.tolist() == [1.0, -2.0]
    joint = problem.hand.joints[2]
    assert (joint.name, joint.lower, joint.upper) == ('right_1', -1.0, 2.0)
    assert (joint.velocity_limit, joint.effort_limit, joint.acceleration_limit) == (1.0, 5.0, 7.0)
    assert problem.hand.body_names[-1] == 'right.link_2'
    assert problem.hand.fingers[1].links[0].mass == 0.5
    assert problem.hand.fingers[1].base.tolist() == [0.2, 0.0]
    assert problem.object.center_of_mass.tolist() == [0.01, 0.02]
    assert problem.friction == 0.3
    assert problem.start.joints.tolist() == [0.1, 0.2, 0.3, 0.4]
    assert problem.goal.joints == {'right_2': 1.0}
    assert problem.goal.contacts == ('object.v0|palm.0.e2', 'object.e3|left.link_2.v1')
    assert (problem.goal.tolerance.position, problem.goal.tolerance.angle) == (1e-4, 0.5)


def test_parts_of_a_goal_arrive_where_they_belong():
    goal = {
        'position': [0.1, 0.2],
        'orientation': 7,
        'contacts': ['object.v0|palm.0.e2'],
        'exact_contacts': True,
    }
    read = problem_from_mapping(changed((('goal',), goal))).problem.goal
    assert read.object_pose is None
    assert read.position.tolist() == [0.1, 0.2]
    assert (read.orientation, read.exact_contacts) == (7.0, True)
    assert (read.object_position.tolist(), read.object_angle) == ([0.1, 0.2], 7.0)


def test_shipped_goals_in_part_have_no_findings():
    paths = sorted(PROBLEMS[0].parent.glob('goals/*.yaml'))
    assert paths
    assert [read_problem(path).findings for path in paths] == [()] * len(paths)


def test_joints_are_ordered_as_in_the_hand_whatever_their_order_in_the_file():
    joints = dict(reversed(SOUND['start']['joints'].items()))
    problem = problem_from_mapping(changed((('start', 'joints'), joints))).problem
    assert problem.start.joints.tolist() == [0.1, 0.2, 0.3, 0.4]


def test_centre_of_mass_is_the_centroid_if_not_given():
    assert problem_from_mapping(SOUND).problem.object.center_of_mass == pytest.approx(
        [0.015, 0.015]
    )


def test_non_convex_polygon_is_sound():
    notched = [[0.0, 0.0], [0.2, 0.0], [0.2, 0.1], [0.1, 0.1], [0.1, 0.2], [0.0, 0.2]]
    assert findings((('object', 'vertices'), notched)) == ()


def test_hand_without_a_palm_is_sound():
    assert findings((('hand', 'palm'), [])) == ()


def test_arrays_and_tuples_in_memory_are_sound():
    vertices = np.array(SOUND['object']['vertices'])
    reading = problem_from_mapping(
        changed((('object', 'vertices'), vertices), (('gravity',), (np.float64(0.0), -9)))
    )
    assert reading.findings == ()
    assert reading.problem.object.vertices.tolist() == vertices.tolist()


def test_reading_does_not_change_the_data():
    data = changed()
    problem_from_mapping(data)
    assert data == SOUND


def test_angle_within_rounding_of_its_limit_is_sound():
    assert findings((('start', 'joints', 'left_1'), 2.0 + 9e-10)) == ()


# What is wrong with single values


@pytest.mark.parametrize(
    'path',
    [
        ('object', 'mass'),
        ('gravity', 1),
        ('contact', 'friction'),
        ('start', 'object_pose', 2),
        ('start', 'joints', 'left_1'),
        ('object', 'vertices', 2, 0),
        (*JOINT, 'limits', 0),
        (*JOINT, 'velocity_limit'),
        (*LINK, 'length'),
        ('hand', 'fingers', 0, 'base_angle'),
    ],
)
@pytest.mark.parametrize('value', [math.nan, math.inf, -math.inf, True, '0.1', None, [], 10**400])
def test_value_that_is_no_finite_number_is_found(path, value):
    finding = only_finding((path, value))
    text = ''.join(f'[{step}]' if isinstance(step, int) else f'.{step}' for step in path)
    assert finding.field == text[1:]
    assert 'a finite number' in finding.expected


@pytest.mark.parametrize(
    ('path', 'value', 'expected'),
    [
        (('object', 'mass'), 0, 'greater than 0 and at most 1000000 (mass in kg)'),
        (('object', 'mass'), -0.1, 'greater than 0 and at most 1000000 (mass in kg)'),
        ((*LINK, 'mass'), -0.1, 'at least 0 and at most 1000000 (mass in kg)'),
        ((*LINK, 'length'), 0, 'greater than 0 and at most 1000000 (length in m)'),
        ((*LINK, 'length'), -0.1, 'greater than 0 and at most 1000000 (length in m)'),
        ((*JOINT, 'velocity_limit'), 0, 'greater than 0 (largest speed in rad/s)'),
        ((*JOINT, 'effort_limit'), -1, 'greater than 0 (largest torque in N·m)'),
        ((*JOINT, 'acceleration_limit'), 0, 'greater than 0 (largest acceleration in rad/s²)'),
        (('contact', 'friction'), -0.5, 'at least 0 (Coulomb friction coefficient, no unit)'),
        (('goal', 'tolerance'), {'position': -1}, 'greater than 0 (tolerance in m)'),
        (('object', 'vertices', 1, 0), 1e200, 'at most 1000000 (coordinate in m)'),
    ],
)
def test_number_out_of_range_is_found_with_range_and_unit(path, value, expected):
    assert only_finding((path, value)).expected.endswith(expected)


@pytest.mark.parametrize(
    ('path', 'value', 'expected'),
    [
        (('format',), 'cfplan/problem/2', "'cfplan/problem/1'"),
        (('name',), 3, 'a text'),
        (('name',), '../../etc', 'without slashes'),
        (('gravity',), [0.0, 0.0, -9.81], 'a list of 2 numbers'),
        (('object', 'center_of_mass'), [0.0], 'a list of 2 numbers (centre of mass'),
        (('start', 'object_pose'), [0.0, 0.0], 'a list of 3 numbers (pose [x, y, phi]'),
        (('start', 'object_pose'), {'x': 0}, 'a list of 3 numbers'),
        (('start',), [], 'a mapping (the first grasp'),
        (('object',), 3, 'a mapping (the object: vertices and mass)'),
        (('hand', 'fingers'), [], 'a list of at least 1'),
        ((*LINK, 'name'), 'a.b', 'name without dots'),
        (('hand', 'fingers', 0, 'name'), 'palm', 'not palm or object'),
        (('object', 'vertices'), [[0.0, 0.0], [1.0, 0.0]], 'a list of 3 to 10000'),
        (('goal', 'contacts'), [], 'a list of at least 1'),
        (('goal', 'joints'), {}, 'a mapping, not empty'),
    ],
)
def test_value_of_wrong_form_is_found(path, value, expected):
    assert expected in only_finding((path, value)).expected


def test_number_written_as_text_is_shown_as_yaml_wants_it():
    assert 'written as a number: 1.0e-05' in only_finding((('object', 'mass'), '1e-5')).value


def test_unknown_key_is_found_with_the_nearest_valid_one():
    finding = only_finding((('goal', 'tolerence'), {'angle': 0.1}))
    assert finding.field == 'goal.tolerence'
    assert finding.expected == "'tolerance' as the key"


def test_unknown_key_like_no_other_is_found_with_all_valid_ones():
    assert 'one of vertices, center_of_mass, mass' in only_finding((('object', 'ψ'), 0)).expected


@pytest.mark.parametrize(
    'path',
    [
        path
        for path in all_paths(SOUND)
        if path and isinstance(path[-1], str) and path[0] != 'goal'
    ],
    ids=lambda path: '.'.join(map(str, path)),
)
def test_missing_value_is_found_at_its_own_path(path):
    finding = only_finding((path, GONE))
    assert finding.field.endswith(str(path[-1]))
    assert finding.value == 'nothing'


def test_key_that_is_no_text_is_found():
    assert only_finding((('object', 3), 0.1)).expected == 'a text as the key'


# Polygons


@pytest.mark.parametrize(
    ('vertices', 'value'),
    [
        ([[0, 0], [0, 1], [1, 1], [1, 0]], 'clockwise vertices (area -1 m²)'),
        ([[0, 0], [1, 0], [0, 1], [1, 1]], 'edges 1 and 3 that meet'),
        ([[0, 0], [4, 0], [2, 0], [2, 3]], 'edges 0 and 1 that meet'),
        ([[0, 0], [1, 1], [2, 2]], 'vertices on one straight line'),
        ([[1, 1], [1, 1], [1, 1]], 'a polygon of width 0 m'),
        ([[0, 0], [1e-9, 0], [0, 1e-9]], 'a polygon of width 1e-09 m'),
    ],
)
@pytest.mark.parametrize(
    'body', [('hand', 'palm', 0), LINK, ('object',)], ids=['palm', 'link', 'object']
)
def test_polygon_without_an_inside_to_its_left_is_found(body, vertices, value):
    finding = only_finding(((*body, 'vertices'), vertices))
    assert finding.field.endswith('vertices')
    assert finding.value.startswith(value)


def test_repeated_vertex_is_found_at_its_index():
    finding = only_finding((('object', 'vertices'), [[0, 0], [1, 0], [1, 0], [0, 1]]))
    assert finding.field == 'object.vertices[2]'


def test_polygon_closed_by_hand_is_found_at_its_last_vertex():
    finding = only_finding((('object', 'vertices'), [[0, 0], [1, 0], [0, 1], [0, 0]]))
    assert finding.field == 'object.vertices[3]'
    assert 'a polygon closes itself' in finding.expected


def test_large_polygon_is_sound():
    angles = np.linspace(0.0, 2.0 * np.pi, 3000, endpoint=False)
    circle = 0.03 * np.column_stack([np.cos(angles), np.sin(angles)])
    assert findings((('object', 'vertices'), circle)) == ()


def test_polygon_of_too_many_vertices_is_found():
    finding = only_finding((('object', 'vertices'), [[0.0, 0.0]] * 10001))
    assert 'a list of 3 to 10000 items' in finding.expected


def test_plan_is_told_from_a_problem_without_more_ado():
    finding = only_finding((('format',), 'cfplan/plan/1'))
    assert finding.value == 'a plan (cfplan/plan/1)'


# Names, joints and contacts


def test_finger_name_used_twice_is_found():
    assert only_finding((('hand', 'fingers', 1, 'name'), 'left')).field == 'hand.fingers[1].name'


def test_joint_name_used_in_two_fingers_is_found():
    finding = only_finding(((*JOINT, 'name'), 'left_2'))
    assert finding.field == 'hand.fingers[1].joints[0].name'
    assert 'hand.fingers[0].joints[1]' in finding.expected


def test_link_name_used_twice_in_a_finger_is_found():
    assert only_finding(((*LINK, 'name'), 'link_2')).field == 'hand.fingers[1].links[1].name'


def test_finger_with_fewer_links_than_joints_is_found():
    finding = only_finding(((*LINK[:-1],), SOUND['hand']['fingers'][1]['links'][:1]))
    assert finding.field == 'hand.fingers[1].links'
    assert finding.expected == '2: as many links as joints'


@pytest.mark.parametrize('limits', [[2.0, -1.0], [0.3, 0.3]])
def test_limits_that_leave_no_range_are_found(limits):
    finding = only_finding(((*JOINT, 'limits'), limits))
    assert finding.field == 'hand.fingers[1].joints[0].limits'
    assert 'rad, lower below upper' in finding.expected


@pytest.mark.parametrize('angle', [2.0 + 2e-9, -1.0 - 2e-9])
@pytest.mark.parametrize('grasp', ['start', 'goal'])
def test_angle_outside_its_limits_is_found(grasp, angle):
    joints = {**SOUND['start']['joints'], 'right_1': angle}
    finding = only_finding(((grasp, 'joints'), joints))
    assert finding.field == f'{grasp}.joints.right_1'
    assert finding.expected == "from -1.0 to 2.0 rad, the joint's limits"


@pytest.mark.parametrize('grasp', ['start', 'goal'])
def test_unknown_joint_is_found_with_the_nearest_one(grasp):
    joints = {**SOUND['start']['joints'], 'rigth_1': 0.0}
    finding = only_finding(((grasp, 'joints'), joints))
    assert finding.field == f'{grasp}.joints.rigth_1'
    assert "'right_1'" in finding.expected


@pytest.mark.parametrize(
    ('goal', 'field', 'value'),
    [
        ({'object_pose': [0, 0, 0], 'orientation': 0}, 'goal.orientation', '0 beside object_pose'),
        (
            {'object_pose': [0, 0, 0], 'position': [0, 0]},
            'goal.position',
            '[0, 0] beside object_pose',
        ),
        (
            {'orientation': 0, 'exact_contacts': True},
            'goal.exact_contacts',
            'true without contacts',
        ),
        ({'orientation': '0'}, 'goal.orientation', "the text '0'"),
        ({'position': [0, 0, 0]}, 'goal.position', '3: [0, 0, 0]'),
        (
            {'contacts': ['object.v0|palm.0.e2'], 'exact_contacts': 1},
            'goal.exact_contacts',
            '1',
        ),
    ],
)
def test_goal_that_says_something_twice_or_wrongly_is_found(goal, field, value):
    finding = only_finding((('goal',), goal))
    assert finding.field == field
    assert finding.value.startswith(value)


def test_joint_goal_beyond_its_limits_may_be_within_its_tolerance():
    goal = {'joints': {'right_1': 2.05}, 'tolerance': {'joints': 0.06}}
    assert problem_from_mapping(changed((('goal',), goal))).findings == ()
    goal['tolerance']['joints'] = 0.04
    assert only_finding((('goal',), goal)).field == 'goal.joints.right_1'


def test_goal_of_nothing_but_a_tolerance_is_found():
    finding = only_finding((('goal',), {'tolerance': {'angle': 0.1}}))
    assert finding.field == 'goal'
    assert finding.expected == (
        'at least one of object_pose, position, orientation, joints, contacts'
    )


@pytest.mark.parametrize(
    'name',
    [
        'palm.0.e2|object.v1',
        'object.v1|palm.0.v2',
        'object.e1|palm.0.e2',
        'object.1|palm.0.e2',
        'object.v1|palm.e2',
        'object.v1 | palm.0.e2',
        'object.v1|palm.0.e2\n',
        '',
    ],
)
def test_malformed_contact_is_found(name):
    finding = only_finding((('goal', 'contacts'), ['object.v0|palm.0.e2', name]))
    assert finding.field == 'goal.contacts[1]'
    assert 'object.vK|BODY.eK' in finding.expected


@pytest.mark.parametrize(
    ('name', 'expected'),
    [
        ('object.v4|palm.0.e2', 'an element of object from v0 to v3, not v4'),
        ('object.v01|palm.0.e2', 'an element of object from v0 to v3, not v01'),
        ('object.e1|left.link_2.v4', 'an element of left.link_2 from v0 to v3, not v4'),
        ('object.v1|palm.1.e2', "'palm.0' as the body"),
        ('object.v1|left.link_3.e2', "'left.link_2' as the body"),
        (f'object.v1|palm.0.e{"9" * 5000}', 'an element of palm.0 from e0 to e3'),
    ],
)
def test_contact_of_what_does_not_exist_is_found(name, expected):
    assert only_finding((('goal', 'contacts'), [name])).expected.startswith(expected)


def test_contact_is_not_held_against_a_finger_whose_name_is_unsound():
    finding = only_finding(
        (('hand', 'fingers', 1, 'name'), 'a.b'),
        (('goal', 'contacts'), ['object.v1|right.link_1.e2']),
    )
    assert finding.field == 'hand.fingers[1].name'


def test_contact_named_twice_is_found():
    name = 'object.v0|palm.0.e2'
    assert only_finding((('goal', 'contacts'), [name, name])).field == 'goal.contacts[1]'


# All at once


def test_findings_come_all_at_once_in_the_order_of_the_file():
    found = findings(
        (('goal', 'contacts'), ['x']),
        (('object', 'mass'), -1),
        ((*JOINT, 'limits'), [1, 0]),
        (('start', 'joints', 'left_1'), 9.0),
        (('contact',), GONE),
        (('gravity', 1), math.nan),
    )
    assert fields(found) == [
        'gravity[1]',
        'hand.fingers[1].joints[0].limits',
        'object.mass',
        'start.joints.left_1',
        'goal.contacts[0]',
        'contact',
    ]


def test_flood_of_findings_is_cut_and_says_so():
    found = findings((('object', 'vertices'), [['a', 'b']] * 2000))
    assert len(found) == 1001
    assert any(finding.value == 'more than 1000 faults' for finding in found)


@pytest.mark.parametrize(
    ('path', 'value'),
    [
        (('object', 'mass'), -1.0),
        (('name',), GONE),
        (('contact', 'friction'), 'none'),
        ((*JOINT, 'velocity_limit'), GONE),
        ((*JOINT, 'limits'), [1.0, 0.0]),
        ((*LINK, 'mass'), math.nan),
        (('start', 'joints', 'left_1'), 9.0),
        (('goal',), {}),
        (('goal', 'contacts'), ['x']),
        (('colour',), 'red'),
    ],
)
def test_problem_is_built_in_spite_of_a_fault_beside_its_geometry(path, value):
    reading = problem_from_mapping(changed((path, value)))
    assert reading.findings
    assert reading.problem.object.vertices.tolist() == SOUND['object']['vertices']


@pytest.mark.parametrize(
    ('path', 'value'),
    [
        (('gravity',), GONE),
        (('object', 'vertices', 0, 0), 'a'),
        (('object', 'center_of_mass'), [0.0]),
        (('hand', 'palm', 0, 'vertices'), [[0, 0], [0, 1], [1, 0]]),
        (('hand', 'palm'), GONE),
        ((*LINK, 'length'), -1.0),
        (('start', 'joints', 'left_1'), GONE),
    ],
)
def test_no_problem_is_built_of_unsound_geometry(path, value):
    assert problem_from_mapping(changed((path, value))).problem is None


junk = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=5)
    | st.binary(max_size=3)
    | st.dates(),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=3), inner, max_size=3)
    ),
    max_leaves=6,
)


@given(st.lists(st.tuples(st.sampled_from([p for p in all_paths(SOUND) if p]), junk), max_size=3))
def test_junk_anywhere_gives_findings_or_a_problem_and_never_raises(changes):
    data = changed(*sorted(changes, key=lambda change: -len(change[0])))
    reading = problem_from_mapping(data)
    assert reading.findings or reading.problem is not None


# Files


def test_loading_raises_with_all_findings(tmp_path):
    path = tmp_path / 'problem.yaml'
    path.write_text(yaml.safe_dump(changed((('object', 'mass'), 0), (('name',), 0))))
    with pytest.raises(InvalidProblemError) as caught:
        load_problem(path)
    assert caught.value.findings == read_problem(path).findings
    assert sorted(fields(caught.value.findings)) == ['name', 'object.mass']
    assert str(path) in str(caught.value)


def test_json_is_read_too(tmp_path):
    assert read_text(tmp_path, json.dumps(SOUND)).findings == ()


@pytest.mark.parametrize(
    ('name', 'reason'), [('nowhere.yaml', 'no such file or directory'), ('', 'is a directory')]
)
def test_file_that_cannot_be_read_is_found(tmp_path, name, reason):
    reading = read_problem(tmp_path / name)
    assert reading.problem is None
    assert reading.findings[0].file == str(tmp_path / name)
    assert str(reading.findings[0]) == f'{tmp_path / name}: {reason}'


@pytest.mark.parametrize(
    ('text', 'field', 'value'),
    [
        ('name: a\nhand: [1,\n', 'line 3, column 1', 'parsing a flow'),
        ('name: a: b\n', 'line 1, column 8', 'mapping values are not allowed'),
        ('a: 1\n---\nb: 2\n', 'line 2, column 1', 'but found another document'),
        ('a: *b\n', 'line 1, column 4', 'found undefined alias'),
        ('a: 1\nb: &b [*b]\n', 'line 2, column 4', 'an alias inside its own anchor'),
        ('[' * 200000, 'line 1, column 101', 'deeper nesting'),
        ('', '', 'nothing'),
        ('- 1\n', '', '[1]'),
        ('only words\n', '', "'only words'"),
        (b'name: \xff\n', '', 'invalid'),
        ('name: a\0b\n', '', 'control characters are not allowed'),
    ],
)
def test_file_that_is_no_yaml_mapping_is_found_with_its_place(tmp_path, text, field, value):
    reading = read_text(tmp_path, text)
    assert reading.problem is None
    assert [finding.field for finding in reading.findings] == [field]
    assert value in reading.findings[0].value


def test_aliases_that_multiply_are_refused(tmp_path):
    lines = ['a0: &a0 [1, 2]'] + [f'a{k}: &a{k} [*a{k - 1}, *a{k - 1}]' for k in range(1, 40)]
    reading = read_text(tmp_path, '\n'.join(lines))
    assert 'at most 1000000 values' in reading.findings[0].expected


def test_merge_keys_that_multiply_are_refused(tmp_path):
    lines = ['a0: &a0 {x: 1}'] + [
        f'a{k}: &a{k} {{<<: [*a{k - 1}, *a{k - 1}]}}' for k in range(1, 40)
    ]
    reading = read_text(tmp_path, '\n'.join(lines))
    assert 'at most 1000000 values' in reading.findings[0].expected


def test_file_of_unbounded_size_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr('cfplan_core.model.yaml_file.LARGEST_FILE', 100)
    assert 'at most 100 bytes' in read_text(tmp_path, 'x' * 101).findings[0].expected


def test_slow_yaml_loader_reads_the_same(monkeypatch):
    fast = read_problem(PROBLEMS[0])
    monkeypatch.delattr(yaml, 'CSafeLoader')
    slow = read_problem(PROBLEMS[0])
    assert slow.findings == fast.findings == ()
    assert slow.problem.object.vertices.tolist() == fast.problem.object.vertices.tolist()


def test_key_given_twice_is_found_with_its_lines(tmp_path):
    text = yaml.safe_dump(SOUND, sort_keys=False).replace('  mass: 0.1', '  mass: 0.1\n  mass: 9')
    lines = text.splitlines()
    first = lines.index('  mass: 0.1') + 1
    finding = read_text(tmp_path, text).findings[0]
    assert finding.field == 'object.mass'
    assert finding.value == f'two values, in lines {first} and {first + 1}'


def test_number_in_yaml_1_2_style_is_found_with_advice(tmp_path):
    text = yaml.safe_dump(SOUND).replace('mass: 0.1', 'mass: 1e-4')
    finding = read_text(tmp_path, text).findings[0]
    assert (finding.field, finding.value) == (
        'object.mass',
        "the text '1e-4' (written as a number: 0.0001)",
    )


@pytest.mark.parametrize('number', ['010', '1:30'])
def test_number_that_yaml_1_1_reads_surprisingly_is_found(tmp_path, number):
    text = yaml.safe_dump(SOUND).replace('mass: 0.1', f'mass: {number}')
    assert fields(read_text(tmp_path, text).findings) == ['object.mass']


@pytest.mark.parametrize('value', ['.nan', '.inf', '-.inf'])
def test_value_that_is_not_finite_is_shown_as_in_the_file(tmp_path, value):
    text = yaml.safe_dump(SOUND).replace('mass: 0.1', f'mass: {value}')
    assert read_text(tmp_path, text).findings[0].value == value


@pytest.mark.parametrize('value', ['!!python/object:os.system {}', '!x 1', '!!int a', '9' * 5000])
def test_tags_and_what_does_not_fit_them_are_found(tmp_path, value):
    text = yaml.safe_dump(SOUND).replace('mass: 0.1', f'mass: {value}')
    assert fields(read_text(tmp_path, text).findings) == ['object.mass']


def test_joint_may_be_called_as_a_truth_value_is_written(tmp_path):
    text = yaml.safe_dump(SOUND).replace('left_1:', 'on:').replace('left_1', '"on"')
    assert read_text(tmp_path, text).findings == ()


def test_anchors_and_merge_keys_share_values(tmp_path):
    text = yaml.safe_dump(SOUND, sort_keys=False).replace('start:\n', 'start: &grasp\n')
    text = text[: text.index('goal:')] + 'goal:\n  <<: *grasp\n  object_pose: [0.5, 0.0, 0.0]\n'
    reading = read_text(tmp_path, text)
    assert reading.findings == ()
    assert reading.problem.goal.object_pose.tolist() == [0.5, 0.0, 0.0]
    assert reading.problem.goal.joints == SOUND['start']['joints']


@given(st.binary(max_size=40) | st.text('{}[]:,-&*a1 \n!?|>\'"#<%@', max_size=40))
def test_no_contents_make_reading_raise(tmp_path_factory, text):
    reading = read_text(tmp_path_factory.getbasetemp(), text)
    assert reading.findings
    assert reading.problem is None


# Hand and object in files of their own


def write_parts(tmp_path, hand=SOUND['hand'], body=SOUND['object']):
    (tmp_path / 'parts').mkdir()
    (tmp_path / 'parts' / 'hand.yaml').write_text(yaml.safe_dump(hand))
    (tmp_path / 'parts' / 'object.yaml').write_text(yaml.safe_dump(body))
    return changed((('hand',), 'parts/hand.yaml'), (('object',), 'parts/object.yaml'))


def test_hand_and_object_are_read_from_files_beside_the_problem(tmp_path):
    reading = read_text(tmp_path, yaml.safe_dump(write_parts(tmp_path)))
    assert reading.findings == ()
    assert reading.problem.hand.joint_names == ('left_1', 'left_2', 'right_1', 'right_2')
    assert reading.problem.object.mass == 0.1


def test_fault_in_a_hand_file_is_found_in_that_file(tmp_path):
    hand = copy.deepcopy(SOUND['hand'])
    hand['fingers'][1]['joints'][0]['limits'] = [1.0, 0.0]
    data = write_parts(tmp_path, hand=hand)
    (finding,) = problem_from_mapping(data, directory=tmp_path).findings
    assert finding.file == str(tmp_path / 'parts' / 'hand.yaml')
    assert finding.field == 'fingers[1].joints[0].limits'


def test_missing_object_file_is_found_with_who_names_it(tmp_path):
    data = write_parts(tmp_path)
    (tmp_path / 'parts' / 'object.yaml').unlink()
    (finding,) = problem_from_mapping(data, 'grasp.yaml', tmp_path).findings
    assert finding.file == str(tmp_path / 'parts' / 'object.yaml')
    assert finding.value == 'no such file or directory, named in grasp.yaml'


@pytest.mark.parametrize(
    ('text', 'field'), [('a: [', 'line 2, column 1'), ('3', ''), ('', ''), ('other.yaml', '')]
)
def test_hand_file_that_holds_no_hand_is_found(tmp_path, text, field):
    data = write_parts(tmp_path)
    path = tmp_path / 'parts' / 'hand.yaml'
    path.write_text(text)
    (finding,) = problem_from_mapping(data, directory=tmp_path).findings
    assert (finding.file, finding.field) == (str(path), field)


def test_path_in_memory_without_a_directory_is_refused():
    finding = only_finding((('hand',), 'hand.yaml'))
    assert finding.field == 'hand'
    assert 'inline' in finding.expected


# The schema


def schemas(schema):
    yield schema
    for key in ('properties', '$defs'):
        for part in schema.get(key, {}).values():
            yield from schemas(part)
    for key in ('items', 'additionalProperties'):
        if isinstance(schema.get(key), dict):
            yield from schemas(schema[key])


def test_schema_is_a_sound_draft_2020_12_schema():
    from jsonschema import Draft202012Validator

    assert problem_schema()['$schema'] == Draft202012Validator.META_SCHEMA['$id']
    Draft202012Validator.check_schema(problem_schema())


def test_schema_closes_every_mapping():
    mappings = [part for part in schemas(problem_schema()) if part.get('type') == 'object']
    assert len(mappings) > 8
    assert all('additionalProperties' in part for part in mappings)


def test_schema_gives_every_number_a_title_with_its_unit():
    numbers = [part for part in schemas(problem_schema()) if part.get('type') == 'number']
    units = ('in m', 'in rad', 'in kg', 'in N·m', 'in m/s²', 'in rad/s', 'no unit')
    assert len(numbers) > 10
    assert all(any(unit in part['title'] for unit in units) for part in numbers)
