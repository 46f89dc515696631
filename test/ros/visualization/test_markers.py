from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cfplan_msgs.msg import ManipulationPlan
from numpy.typing import NDArray
from rclpy.serialization import deserialize_message, serialize_message
from ros.visualization.examples import START, Planned
from ros.visualization.viewer import Viewer
from std_msgs.msg import Header
from visualization_msgs.msg import Marker, MarkerArray

from cfplan_core.errors import CfplanError
from cfplan_core.geometry.polygon import signed_area
from cfplan_core.model import Grasp, ManipulatedObject, Problem
from cfplan_core.report.scene import contact_marks, plan_grasps
from cfplan_core.report.style import body_colours
from cfplan_ros.conversions.times import stamp_of
from cfplan_ros.visualization.frames import moving_transforms, static_transforms
from cfplan_ros.visualization.markers import scene_markers

FloatArray = NDArray[np.float64]

NOW = stamp_of(START)
NO_PLAN = ManipulationPlan(header=Header(stamp=NOW, frame_id='palm'))


def view(problem: Problem, plan: ManipulationPlan, grasp: Grasp) -> Viewer:
    viewer = Viewer('palm')
    viewer.transforms(static_transforms(problem.hand, 'palm', NOW))
    viewer.transforms(moving_transforms(problem.hand, grasp, 'palm', NOW))
    viewer.show(scene_markers(problem, plan))
    return viewer


def world_bodies(problem: Problem, grasp: Grasp) -> dict[tuple[str, int], FloatArray]:
    """Vertices of all bodies by namespace and number of their markers."""
    hand = problem.hand.world_vertices(grasp.joints)
    bodies = {('hand', k): vertices for k, vertices in enumerate(hand.values())}
    return bodies | {('object', 0): problem.object.world_vertices(grasp.object_pose)}


def areas(triangles: FloatArray) -> FloatArray:
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    return np.asarray(0.5 * np.cross(b - a, c - a))


def test_every_number_is_finite_and_every_frame_known(planned: Planned) -> None:
    viewer = view(planned.problem, planned.message, planned.problem.start)
    for (ns, number), marker in viewer.markers.items():
        if marker.type != Marker.TEXT_VIEW_FACING:
            assert np.isfinite(viewer.points(ns, number)).all()
        size = marker.scale
        assert all(np.isfinite([size.x, size.y, size.z]))


def test_outlines_are_the_bodies_of_the_core_in_every_grasp(planned: Planned) -> None:
    viewer = view(planned.problem, planned.message, planned.problem.start)
    for grasp in plan_grasps(planned.result)[::7]:
        viewer.transforms(moving_transforms(planned.problem.hand, grasp, 'palm', NOW))
        for (ns, number), vertices in world_bodies(planned.problem, grasp).items():
            line = viewer.points(f'{ns}_outline', number)[:, :2]
            np.testing.assert_allclose(line, [*vertices, vertices[0]], atol=1e-12)


def test_plates_cover_the_bodies_of_the_core(planned: Planned) -> None:
    viewer = view(planned.problem, planned.message, planned.problem.start)
    for (ns, number), vertices in world_bodies(planned.problem, planned.problem.start).items():
        triangles = viewer.points(ns, number).reshape(-1, 3, 3)
        upper = triangles[np.ptp(triangles[:, :, 2], axis=1) == 0.0]
        upper = upper[upper[:, 0, 2] > 0.0]
        assert areas(upper)[:, 2].sum() == pytest.approx(signed_area(vertices), rel=1e-9)
        corners = {tuple(np.round(point, 9)) for point in upper.reshape(-1, 3)[:, :2]}
        assert corners == {tuple(np.round(point, 9)) for point in vertices}


def test_plates_are_closed_and_face_outward_also_when_concave(rich: Problem) -> None:
    viewer = view(rich, NO_PLAN, rich.start)
    for (ns, number), vertices in world_bodies(rich, rich.start).items():
        triangles = viewer.points(ns, number).reshape(-1, 3, 3)
        thickness = np.ptp(triangles[:, :, 2])
        # The divergence theorem: a closed surface that faces outward encloses its volume.
        volume = (areas(triangles) * triangles.mean(axis=1)).sum() / 3.0
        assert volume == pytest.approx(signed_area(vertices) * thickness, rel=1e-9)
        np.testing.assert_allclose(areas(triangles).sum(axis=0), 0.0, atol=1e-12)


def test_bodies_have_the_colours_of_the_figures(rich: Problem) -> None:
    viewer = view(rich, NO_PLAN, rich.start)
    colours = body_colours(rich.hand)
    names = dict(
        zip(world_bodies(rich, rich.start), [*rich.hand.body_names, 'object'], strict=True)
    )
    for key, name in names.items():
        paint = viewer.markers[key].color
        code = '#' + ''.join(f'{round(255 * part):02X}' for part in (paint.r, paint.g, paint.b))
        assert (code, paint.a) == (colours[name], 1.0)


def test_the_goal_is_drawn_where_the_plan_ends(planned: Planned) -> None:
    viewer = view(planned.problem, planned.message, planned.problem.start)
    goal = planned.problem.object.world_vertices(planned.result.object_poses[-1])
    line = viewer.points('goal_outline', 0)[:, :2]
    np.testing.assert_allclose(line, [*goal, goal[0]], atol=1e-12)


@pytest.mark.parametrize(('ns', 'index'), [('start', 0), ('goal', -1)])
def test_dots_are_where_the_contacts_are(planned: Planned, ns: str, index: int) -> None:
    viewer = view(planned.problem, planned.message, planned.problem.start)
    grasp, segment = plan_grasps(planned.result)[index], planned.result.segments[index]
    marks = contact_marks(planned.problem, grasp, segment.contacts)
    found = viewer.points(f'{ns}_contacts', 0)[:, :2]
    np.testing.assert_allclose(found, [mark.point for mark in marks], atol=1e-9)


def test_sizes_scale_with_the_object(rich: Problem) -> None:
    thing = ManipulatedObject(3.0 * rich.object.vertices, rich.object.mass)
    grown = view(replace(rich, object=thing), NO_PLAN, rich.start)
    usual = view(rich, NO_PLAN, rich.start)
    for key, marker in usual.markers.items():
        assert grown.markers[key].scale.x == pytest.approx(
            marker.scale.x * (1.0 if marker.type == Marker.TRIANGLE_LIST else 3.0)
        )


def test_numbers_are_unique_in_their_namespace(planned: Planned) -> None:
    markers = scene_markers(planned.problem, planned.message).markers[1:]
    keys = [(marker.ns, marker.id) for marker in markers]
    assert len(keys) == len(set(keys))


def test_the_first_marker_removes_all_that_was_shown_before(planned: Planned) -> None:
    first, *others = scene_markers(planned.problem, planned.message).markers
    assert first.action == Marker.DELETEALL
    assert all(marker.action == Marker.ADD for marker in others)


def test_markers_are_locked_to_their_frames_and_carry_the_plan_s_stamp(planned: Planned) -> None:
    for marker in scene_markers(planned.problem, planned.message).markers[1:]:
        assert marker.frame_locked
        assert marker.header.stamp == NOW


def test_the_markers_survive_serialization(planned: Planned) -> None:
    message = scene_markers(planned.problem, planned.message)
    assert deserialize_message(serialize_message(message), MarkerArray) == message


def test_without_a_plan_only_the_bodies_are_shown(rich: Problem) -> None:
    namespaces = {ns for ns, _ in view(rich, NO_PLAN, rich.start).markers}
    assert namespaces == {'hand', 'hand_outline', 'object', 'object_outline'}


def test_a_plan_of_another_hand_is_refused(story: Planned, rich: Problem) -> None:
    with pytest.raises(CfplanError, match=r'must have the joints left_0.*has left_joint'):
        scene_markers(rich, story.message)
