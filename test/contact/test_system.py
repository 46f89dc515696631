from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from cfplan_core.contact.elements import ElementalContact, parse_contact
from cfplan_core.contact.system import ContactSystem
from cfplan_core.errors import CfplanError
from cfplan_core.geometry.polygon import centroid
from cfplan_core.model import Finger, Grasp, Hand, Joint, Link, Problem

FloatArray = NDArray[np.float64]

angles = st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6)
poses = st.tuples(st.floats(-0.2, 0.2), st.floats(-0.2, 0.2), st.floats(-4.0, 4.0))


@settings(max_examples=30)
@given(pose=poses, joints=angles)
def test_vertices_lie_where_the_model_puts_them(
    rich: ContactSystem, pose: tuple[float, float, float], joints: list[float]
) -> None:
    grasp = Grasp(pose, joints)
    placed = rich.place(rich.configuration(grasp)[None]).vertices[0] * rich.size
    expected = [
        rich.problem.object.world_vertices(grasp.object_pose),
        *rich.problem.hand.world_vertices(grasp.joints).values(),
    ]
    found = np.stack([placed.real, placed.imag], axis=1)
    np.testing.assert_allclose(found, np.concatenate(expected), atol=1e-12)


@settings(max_examples=30)
@given(pose=poses, joints=angles)
def test_axes_lie_where_the_model_puts_them(
    rich: ContactSystem, pose: tuple[float, float, float], joints: list[float]
) -> None:
    placed = rich.place(rich.configuration(Grasp(pose, joints))[None]).axes[0] * rich.size
    expected, _ = rich.problem.hand.link_frames(np.array(joints))
    np.testing.assert_allclose(np.stack([placed.real, placed.imag], 1), expected, atol=1e-12)


def test_normals_point_out_of_their_bodies(rich: ContactSystem) -> None:
    z = rich.configuration(Grasp((0.1, 0.0, 1.0), np.linspace(-1.0, 1.0, 6)))
    placed = rich.place(z[None])
    edges = placed.vertices[0, rich.next_vertex] - placed.vertices[0]
    np.testing.assert_allclose(placed.normals[0] * 1j, edges / np.abs(edges), atol=1e-12)


@settings(max_examples=30)
@given(pose=poses)
def test_pose_of_the_object_frame_comes_back(
    rich: ContactSystem, pose: tuple[float, float, float]
) -> None:
    z = rich.configuration(Grasp(pose, np.zeros(6)))
    np.testing.assert_allclose(rich.object_poses(z[None])[0], pose, atol=1e-14)


def test_configuration_is_that_of_the_centre_of_mass(rich: ContactSystem) -> None:
    # Turned by 90°, the centre of mass (0.021, 0.008) lies at (-0.008, 0.021) of the frame.
    z = rich.configuration(Grasp((1.0, 2.0, math.pi / 2), np.zeros(6)))
    np.testing.assert_allclose(z[:2] * rich.size, (0.992, 2.021))


def test_every_contact_is_found_by_its_name(rich: ContactSystem) -> None:
    names = rich.contact_names(range(rich.contact_count))
    assert [rich.pair(parse_contact(name)) for name in names] == list(range(rich.contact_count))


def test_reflex_vertices_are_in_no_contact(rich: ContactSystem) -> None:
    contacts = [rich.contact(k) for k in range(rich.contact_count)]
    assert all(contact.vertex != 3 for contact in contacts if contact.object_vertex)
    # The step's inner corner is vertex 5.
    assert {c.vertex for c in contacts if not c.object_vertex and c.body == 'palm.0'} == {
        0,
        1,
        2,
        3,
        4,
    }


def test_number_of_contacts_is_that_of_convex_vertices_and_edges(rich: ContactSystem) -> None:
    # Object: 5 convex vertices, 6 edges. Hand: 5, 3 and six times 4 vertices, 6, 3, 24 edges.
    assert rich.contact_count == 5 * (6 + 3 + 24) + 6 * (5 + 3 + 24)


@pytest.mark.parametrize(
    'contact',
    [
        ElementalContact('palm.0', True, 3, 0),
        ElementalContact('palm.0', True, 0, 6),
        ElementalContact('palm.2', True, 0, 0),
        ElementalContact('left.link_3', False, 0, 0),
    ],
)
def test_contact_that_cannot_be_is_refused_by_name(
    rich: ContactSystem, contact: ElementalContact
) -> None:
    with pytest.raises(CfplanError) as refused:
        rich.pair(contact)
    assert str(contact) in str(refused.value)
    assert 'palm.0, palm.1, left.link_0' in str(refused.value)


def test_links_meet_all_bodies_but_their_neighbours_and_the_first_the_palm(
    rich: ContactSystem,
) -> None:
    edges = rich.pair_edge[rich.contact_count :]
    vertices = rich.pair_vertex[rich.contact_count :]
    bodies = np.array(rich.body_names)
    met = {
        frozenset((bodies[rich.body_of[v]], bodies[rich.body_of[e]]))
        for v, e in zip(vertices, edges, strict=True)
    }
    fingers = {'left': 3, 'thumb': 1, 'right': 2}
    links = [(f, k) for f, count in fingers.items() for k in range(count)]
    expected = {
        frozenset((f'{f}.link_{k}', f'{g}.link_{m}'))
        for f, k in links
        for g, m in links
        if f != g or abs(k - m) > 1
    }
    expected |= {frozenset((f'{f}.link_{k}', p)) for f, k in links if k for p in bodies[1:3]}
    assert met == expected


def test_forces_are_in_units_of_the_weight(rich: ContactSystem) -> None:
    assert rich.force_unit == pytest.approx(0.15 * math.hypot(1.5, 9.6))
    np.testing.assert_allclose(rich.load, np.array([1.5, -9.6, 0.0]) / math.hypot(1.5, 9.6))


def test_without_gravity_forces_are_in_newtons(rich_problem: Problem) -> None:
    floating = ContactSystem(replace(rich_problem, gravity=np.zeros(2)))
    assert floating.force_unit == 1.0
    assert not floating.load.any()
    assert not floating.link_weight_torques(np.zeros((2, 9))).any()


def test_hand_without_joints_is_placed(rich_problem: Problem) -> None:
    grasp = Grasp((0.0, 0.0, 0.0), ())
    still = ContactSystem(
        replace(rich_problem, hand=Hand(rich_problem.hand.palm, ()), start=grasp)
    )
    assert still.place(still.configuration(grasp)[None]).vertices.shape == (1, 6 + 6 + 3)


def single_link(problem: Problem, mass: float) -> ContactSystem:
    """A 0.2 m long bar on a hinge; its centroid is half way out."""
    bar = Link('bar', 0.2, [(0.0, -0.01), (0.2, -0.01), (0.2, 0.01), (0.0, 0.01)], mass)
    joint = Joint('hinge', -3.0, 3.0, 1.0, 5.0)
    finger = Finger('arm', (0.3, 0.1), 0.5, (joint,), (bar,))
    return ContactSystem(
        replace(problem, gravity=(0.0, -10.0), hand=Hand(problem.hand.palm, (finger,)))
    )


@pytest.mark.parametrize('slope', [0.0, 0.7, math.pi / 2, 2.5])
def test_actuator_of_a_bar_carries_weight_times_lever(rich_problem: Problem, slope: float) -> None:
    """2 kg, g = 10 m/s², centroid 0.1 m out at an angle: + 2 N·m times its cosine."""
    system = single_link(rich_problem, 2.0)
    z = np.array([[0.0, 0.0, 0.0, slope - 0.5]])
    found = system.link_weight_torques(z) * system.force_unit * system.size
    np.testing.assert_allclose(found, [[2.0 * math.cos(slope)]], atol=1e-12)


@settings(max_examples=30)
@given(joints=angles)
def test_weight_torques_are_the_gradient_of_the_potential_energy(
    rich: ContactSystem, joints: list[float]
) -> None:
    hand, gravity = rich.problem.hand, rich.problem.gravity
    links = [link for finger in hand.fingers for link in finger.links]

    def energy(theta: FloatArray) -> float:
        outlines = list(hand.world_vertices(theta).values())[len(hand.palm) :]
        pairs = zip(links, outlines, strict=True)
        return -sum(link.mass * float(gravity @ centroid(outline)) for link, outline in pairs)

    theta, step = np.array(joints), 1e-5 * np.eye(6)
    expected = [(energy(theta + h) - energy(theta - h)) / 2e-5 for h in step]
    z = np.concatenate([np.zeros(3), theta])[None]
    found = rich.link_weight_torques(z)[0] * rich.force_unit * rich.size
    np.testing.assert_allclose(found, expected, atol=1e-8)
