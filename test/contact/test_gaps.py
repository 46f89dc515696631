from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from cfplan_core.contact.gaps import (
    gap_gradients,
    gaps,
    offset_gradients,
    wedge_lift_gradients,
    wedge_lifts,
)
from cfplan_core.contact.system import ContactSystem
from cfplan_core.model import Hand

FloatArray = NDArray[np.float64]

STEP = 1e-6
configurations = st.tuples(
    st.lists(st.floats(-3.0, 3.0), min_size=3, max_size=3),
    st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6),
).map(lambda parts: np.concatenate(parts))


def by_differences(
    system: ContactSystem, z: FloatArray, function: Callable[[FloatArray], FloatArray]
) -> FloatArray:
    """Central differences of a function of configurations (s, 3 + n) to (s, m); (m, 3 + n)."""
    steps = STEP * np.eye(system.dof)
    values = function(np.concatenate([z + steps, z - steps]))
    return ((values[: system.dof] - values[system.dof :]) / (2.0 * STEP)).T


def all_pairs(system: ContactSystem) -> NDArray[np.intp]:
    return np.arange(len(system.pair_vertex))


def ends(polygon: FloatArray, edge: int) -> tuple[FloatArray, FloatArray]:
    return polygon[edge], polygon[(edge + 1) % len(polygon)]


def outward(start: FloatArray, end: FloatArray) -> FloatArray:
    along = (end - start) / np.linalg.norm(end - start)
    return np.array([along[1], -along[0]])


def bodies(system: ContactSystem, z: FloatArray) -> dict[str, FloatArray]:
    """World vertices in units of the object's size, from the model."""
    pose = system.object_poses(z[None])[0]
    placed = {'object': system.problem.object.world_vertices(pose)}
    placed |= system.problem.hand.world_vertices(z[3:])
    return {name: vertices / system.size for name, vertices in placed.items()}


@settings(max_examples=20)
@given(z=configurations)
def test_gaps_are_distances_along_normals(rich: ContactSystem, z: FloatArray) -> None:
    polygons = bodies(rich, z)
    gap, offset = gaps(rich, rich.place(z[None]), slice(0, rich.contact_count))
    for k in range(0, rich.contact_count, 7):
        contact = rich.contact(k)
        owners = ['object', contact.body]
        vertex_body, edge_body = owners if contact.object_vertex else owners[::-1]
        start, end = ends(polygons[edge_body], contact.edge)
        apart = polygons[vertex_body][contact.vertex] - start
        assert gap[0, k] == pytest.approx(apart @ outward(start, end), abs=1e-12)
        along = (end - start) / np.linalg.norm(end - start)
        assert offset[0, k] == pytest.approx(apart @ along, abs=1e-12)


@settings(max_examples=20)
@given(z=configurations)
def test_gap_gradients_are_those_of_finite_differences(rich: ContactSystem, z: FloatArray) -> None:
    """Contacts of both kinds and pairs of links, near and far."""
    pairs = all_pairs(rich)
    expected = by_differences(rich, z, lambda at: gaps(rich, rich.place(at), pairs).gap)
    found = gap_gradients(rich, rich.place(z[None]), pairs)[0]
    np.testing.assert_allclose(found, expected, atol=1e-8)


@settings(max_examples=20)
@given(z=configurations)
def test_offset_gradients_are_those_of_finite_differences(
    rich: ContactSystem, z: FloatArray
) -> None:
    pairs = all_pairs(rich)
    expected = by_differences(rich, z, lambda at: gaps(rich, rich.place(at), pairs).offset)
    found = offset_gradients(rich, rich.place(z[None]), pairs)[0]
    np.testing.assert_allclose(found, expected, atol=1e-8)


@pytest.mark.parametrize('side', [0, 1])
@settings(max_examples=20)
@given(z=configurations)
def test_wedge_lift_gradients_are_those_of_finite_differences(
    rich: ContactSystem, side: int, z: FloatArray
) -> None:
    pairs = all_pairs(rich)
    expected = by_differences(rich, z, lambda at: wedge_lifts(rich, rich.place(at), pairs)[side])
    found = wedge_lift_gradients(rich, rich.place(z[None]), pairs)[side][0]
    np.testing.assert_allclose(found, expected, atol=1e-8)


@settings(max_examples=20)
@given(z=configurations)
def test_wedge_lifts_are_heights_of_the_neighbouring_vertices(
    rich: ContactSystem, z: FloatArray
) -> None:
    """An edge leaves the touched edge by the rise from one of its ends to the other."""
    polygons = bodies(rich, z)
    pairs = np.arange(0, rich.contact_count, 7)
    behind, before = wedge_lifts(rich, rich.place(z[None]), pairs)
    for i, k in enumerate(pairs):
        contact = rich.contact(int(k))
        owners = ['object', contact.body]
        vertex_body, edge_body = owners if contact.object_vertex else owners[::-1]
        normal = outward(*ends(polygons[edge_body], contact.edge))
        polygon = polygons[vertex_body]
        at = polygon[contact.vertex]
        for lift, neighbour in ((behind, contact.vertex + 1), (before, contact.vertex - 1)):
            away = polygon[neighbour % len(polygon)] - at
            assert lift[0, i] == pytest.approx(normal @ away / np.linalg.norm(away), abs=1e-12)


def material_velocity(
    hand: Hand, theta: FloatArray, link: int, joint: int, point: FloatArray
) -> FloatArray:
    """∂p/∂θ of the point fixed in a link that lies at p now, by moving the joint to and fro."""
    origins, headings = hand.link_frames(theta)
    c, s = np.cos(headings[link]), np.sin(headings[link])
    local = np.array([[c, s], [-s, c]]) @ (point - origins[link])
    moved = []
    for step in (STEP, -STEP):
        changed = theta.copy()
        changed[joint] += step
        origins, headings = hand.link_frames(changed)
        c, s = np.cos(headings[link]), np.sin(headings[link])
        moved.append(origins[link] + np.array([[c, -s], [s, c]]) @ local)
    return (moved[0] - moved[1]) / (2.0 * STEP)


@settings(max_examples=10)
@given(z=configurations, first=st.integers(0, 22))
def test_wrench_and_joint_columns_are_those_of_the_definition(
    rich: ContactSystem, z: FloatArray, first: int
) -> None:
    """w = (n_x, n_y, r_x n_y - r_y n_x), j_k = -n · ∂p/∂θ_k, n from the hand into the object."""
    polygons = bodies(rich, z)
    hand, palms = rich.problem.hand, len(rich.problem.hand.palm)
    pairs = np.arange(first, rich.contact_count, 23)
    rows = gap_gradients(rich, rich.place(z[None]), pairs)[0]
    for row, k in zip(rows, pairs, strict=True):
        contact = rich.contact(int(k))
        owners = ['object', contact.body]
        vertex_body, edge_body = owners if contact.object_vertex else owners[::-1]
        p = polygons[vertex_body][contact.vertex]
        n = outward(*ends(polygons[edge_body], contact.edge))
        n = n if contact.object_vertex else -n
        r = p - z[:2]
        expected = [n[0], n[1], r[0] * n[1] - r[1] * n[0]]
        link = hand.body_names.index(contact.body) - palms
        for joint in range(len(hand.joints)):
            speed = (
                np.zeros(2)
                if link < 0
                else material_velocity(hand, z[3:], link, joint, p * rich.size) / rich.size
            )
            expected.append(-n @ speed)
        np.testing.assert_allclose(row, expected, atol=1e-8)


def test_joints_beyond_a_link_and_of_other_fingers_do_not_move_its_contacts(
    rich: ContactSystem,
) -> None:
    z = np.linspace(-0.5, 0.7, rich.dof)
    rows = gap_gradients(rich, rich.place(z[None]), np.arange(rich.contact_count))[0, :, 3:]
    moved = {
        rich.contact(k).body: np.flatnonzero(np.abs(rows[k]) > 1e-12).tolist()
        for k in range(rich.contact_count)
    }
    assert moved == {
        'palm.0': [],
        'palm.1': [],
        'left.link_0': [0],
        'left.link_1': [0, 1],
        'left.link_2': [0, 1, 2],
        'thumb.link_0': [3],
        'right.link_0': [4],
        'right.link_1': [4, 5],
    }


def test_batch_of_configurations_is_evaluated_one_by_one(rich: ContactSystem) -> None:
    z = np.random.default_rng(3).uniform(-1.0, 1.0, (4, rich.dof))
    pairs = np.array([0, 17, rich.contact_count + 2])
    together = gap_gradients(rich, rich.place(z), pairs)
    apart = [gap_gradients(rich, rich.place(one[None]), pairs)[0] for one in z]
    np.testing.assert_array_equal(together, apart)
