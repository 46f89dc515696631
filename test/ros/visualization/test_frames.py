from __future__ import annotations

import numpy as np
import pytest
from ros.visualization.viewer import Viewer

from cfplan_core.model import Grasp, Problem
from cfplan_core.model.hand import transformed
from cfplan_ros.conversions.times import stamp_of
from cfplan_ros.visualization.frames import link_frame, moving_transforms, static_transforms

NOW = stamp_of(12_000_000_034)


def viewer_of(problem: Problem, world: str = 'palm') -> Viewer:
    viewer = Viewer(world)
    viewer.transforms(static_transforms(problem.hand, world, NOW))
    viewer.transforms(moving_transforms(problem.hand, problem.start, world, NOW))
    return viewer


def placed(viewer: Viewer, frame: str, vertices: np.ndarray) -> np.ndarray:
    flat = np.column_stack([vertices, np.zeros(len(vertices)), np.ones(len(vertices))])
    return (flat @ viewer.to_world(frame).T)[:, :3]


def test_links_are_where_the_core_places_them(rich: Problem) -> None:
    viewer = viewer_of(rich)
    world = rich.hand.world_vertices(rich.start.joints)
    for finger in rich.hand.fingers:
        for link in finger.links:
            found = placed(viewer, link_frame(finger.name, link.name), link.vertices)
            np.testing.assert_allclose(
                found[:, :2], world[f'{finger.name}.{link.name}'], atol=1e-12
            )
            np.testing.assert_allclose(found[:, 2], 0.0, atol=0.0)


def test_the_object_is_where_its_pose_says(rich: Problem) -> None:
    x, y, phi = rich.start.object_pose
    found = placed(viewer_of(rich), 'object', rich.object.vertices)
    expected = transformed(rich.object.vertices, np.array([x, y]), phi)
    np.testing.assert_allclose(found[:, :2], expected, atol=1e-12)


def test_the_world_frame_has_the_name_it_is_given(rich: Problem) -> None:
    viewer = viewer_of(rich, 'hand_base_link')
    assert viewer.to_world('left/link_2').shape == (4, 4)
    assert viewer.to_world('object').shape == (4, 4)


def test_every_frame_has_one_parent_and_a_name_of_its_own(rich: Problem) -> None:
    children = [
        each.child_frame_id
        for message in (
            static_transforms(rich.hand, 'palm', NOW),
            moving_transforms(rich.hand, rich.start, 'palm', NOW),
        )
        for each in message.transforms
    ]
    assert len(children) == len(set(children)) == 3 + 6 + 1


def test_transforms_carry_the_stamp(rich: Problem) -> None:
    for message in (
        static_transforms(rich.hand, 'palm', NOW),
        moving_transforms(rich.hand, rich.start, 'palm', NOW),
    ):
        assert all(each.header.stamp == NOW for each in message.transforms)


@pytest.mark.parametrize('turns', [-3.0, 0.0, 2.0])
def test_a_steady_turn_never_makes_the_quaternion_jump(rich: Problem, turns: float) -> None:
    angles = 2.0 * np.pi * turns + np.linspace(-np.pi - 0.5, np.pi + 0.5, 100)
    rotations = []
    for angle in angles:
        grasp = Grasp((0.0, 0.0, angle), rich.start.joints)
        turn = moving_transforms(rich.hand, grasp, 'palm', NOW).transforms[-1].transform.rotation
        rotations.append((turn.x, turn.y, turn.z, turn.w))
    q = np.array(rotations)
    assert (np.einsum('si,si->s', q[1:], q[:-1]) > 0.99).all()
