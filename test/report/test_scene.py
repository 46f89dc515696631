from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cfplan_core.contact.elements import parse_contact
from cfplan_core.errors import CfplanError
from cfplan_core.model import Grasp, Problem
from cfplan_core.report.scene import (
    View,
    check_belongs,
    contact_marks,
    elements,
    frame_contacts,
    outward_normal,
    plan_grasps,
    scale_length,
    segment_at,
    short_body_names,
    story_frames,
    view_of,
)
from cfplan_core.trajectory.plan_result import PlanResult, Segment


def segments_of(ends: list[int]) -> tuple[Segment, ...]:
    return tuple(
        Segment((str(k),), 'form_closure', first, last)
        for k, (first, last) in enumerate(itertools.pairwise(ends))
    )


def test_elements_are_named_as_in_table_1() -> None:
    assert elements(parse_contact('object.v1|palm.0.e3')) == ('vertex 1', 'edge 3')
    assert elements(parse_contact('object.e0|right.link_2.v2')) == ('edge 0', 'vertex 2')


def test_the_normal_of_a_square_points_out() -> None:
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    normals = [outward_normal(square, k) for k in range(4)]
    assert np.allclose(normals, [[0, -1], [1, 0], [0, 1], [-1, 0]])


def test_a_vertex_on_the_palm_is_marked_at_the_vertex_with_the_normal_up(problem: Problem) -> None:
    (mark,) = contact_marks(problem, problem.start, ['object.v1|palm.0.e2'])
    assert np.allclose(mark.point, problem.object.vertices[1] + problem.start.object_pose[:2])
    assert np.allclose(mark.normal, [0.0, 1.0])


def test_a_fingertip_on_an_edge_is_marked_at_the_tip_with_the_normal_into_the_object(
    problem: Problem,
) -> None:
    (mark,) = contact_marks(problem, problem.start, ['object.e0|left.link_1.v1'])
    tip = problem.hand.world_vertices(problem.start.joints)['left.link_1'][1]
    assert np.allclose(mark.point, tip)
    assert np.allclose(mark.normal, [0.0, 1.0])  # The object's edge 0 is its bottom.


def test_every_contact_of_the_plan_is_marked_on_both_bodies(
    problem: Problem, result: PlanResult
) -> None:
    for frame, grasp in enumerate(plan_grasps(result)):
        names = frame_contacts(result.segments, frame)
        for name, mark in zip(names, contact_marks(problem, grasp, names), strict=True):
            contact = parse_contact(name)
            body = (
                problem.hand.world_vertices(grasp.joints)[contact.body]
                if contact.object_vertex
                else problem.object.world_vertices(grasp.object_pose)
            )
            start, end = body[contact.edge], body[(contact.edge + 1) % len(body)]
            along = (mark.point - start) @ (end - start) / ((end - start) @ (end - start))
            assert np.linalg.norm(start + along * (end - start) - mark.point) < 1e-8
            assert -1e-6 < along < 1.0 + 1e-6


@pytest.mark.parametrize(
    ('name', 'complaint'),
    [
        ('object.v9|palm.0.e2', 'object has elements 0 to 3, got 9'),
        ('object.v0|left.link_1.e4', 'left.link_1 has elements 0 to 3, got 4'),
        ('object.e4|left.link_1.v0', 'object has elements 0 to 3, got 4'),
        ('object.v0|middle.link_1.e0', 'body must be one of'),
    ],
)
def test_a_contact_that_does_not_fit_the_problem_is_refused(
    problem: Problem, name: str, complaint: str
) -> None:
    with pytest.raises(CfplanError, match=complaint):
        contact_marks(problem, problem.start, [name])


def test_bodies_are_short_where_that_is_unique(three_joints: tuple[Problem, PlanResult]) -> None:
    assert short_body_names(three_joints[0]) == {
        'palm.0': 'palm',
        'index.proximal': 'index.proximal',
        'index.distal': 'index.distal',
        'thumb.only': 'thumb',
    }


def test_a_shared_frame_belongs_to_the_later_segment() -> None:
    segments = segments_of([0, 4, 9])
    assert [segment_at(segments, k) for k in (0, 3, 4, 9)] == [0, 0, 1, 1]


def test_a_shared_frame_has_the_contacts_of_both_segments() -> None:
    segments = segments_of([0, 4, 9])
    assert [frame_contacts(segments, k) for k in (3, 4, 5)] == [('0',), ('0', '1'), ('1',)]


@given(st.lists(st.integers(0, 400), min_size=2, max_size=40, unique=True).map(sorted))
def test_story_frames_hold_all_ends_and_few_others(ends: list[int]) -> None:
    frames = story_frames(segments_of(ends))
    assert set(ends) <= set(frames)
    assert len(frames) <= max(16, len(ends))
    assert list(frames) == sorted(set(frames))


def test_story_frames_fill_the_widest_gap_first() -> None:
    assert story_frames(segments_of([0, 10, 14]), most=4) == (0, 5, 10, 14)


def test_the_view_holds_links_and_object_in_every_frame(
    problem: Problem, result: PlanResult
) -> None:
    grasps = plan_grasps(result)
    view = view_of(problem, grasps)
    for grasp in grasps:
        placed = problem.hand.world_vertices(grasp.joints)
        placed['palm.0'] = problem.object.world_vertices(grasp.object_pose)
        points = np.concatenate(list(placed.values()))
        assert view.left < points[:, 0].min()
        assert points[:, 0].max() < view.right
        assert view.bottom < points[:, 1].min()
        assert points[:, 1].max() < view.top


def test_a_long_table_does_not_widen_the_view(problem: Problem) -> None:
    assert view_of(problem, [problem.start]).width < 0.25  # The table is 0.9 m long.


def test_a_palm_of_the_hands_size_is_in_view(three_joints: tuple[Problem, PlanResult]) -> None:
    problem = three_joints[0]
    view = view_of(problem, [problem.start])
    assert view.left < -0.1
    assert view.right > 0.1
    assert view.bottom < -0.02


@given(st.floats(1e-4, 1e4))
def test_the_scale_bar_is_round_and_at_most_a_fifth(width: float) -> None:
    length = scale_length(View(0.0, width, 0.0, 1.0))
    assert 0.4 * width / 5.0 <= length * (1 + 1e-9)
    assert length <= width / 5.0 * (1 + 1e-9)
    digits = f'{length:.3e}'.split('e')[0]
    assert float(digits) in (1.0, 2.0, 5.0)


def test_a_plan_of_another_problem_is_refused(problem: Problem, result: PlanResult) -> None:
    with pytest.raises(CfplanError, match='must be of problem trinkle_hunter_1991, is of other'):
        check_belongs(problem, replace(result, problem='other'))


def test_a_plan_with_other_joints_is_refused(problem: Problem, result: PlanResult) -> None:
    with pytest.raises(CfplanError, match='right_joint, left_joint'):
        check_belongs(problem, replace(result, joint_names=('right_joint', 'left_joint')))


def test_frames_become_grasps(result: PlanResult) -> None:
    grasps = plan_grasps(result)
    assert all(isinstance(grasp, Grasp) for grasp in grasps)
    assert np.array_equal([grasp.joints for grasp in grasps], result.joints)
