from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from cfplan_core.contact.detection import coincident, touching
from cfplan_core.contact.gaps import gaps
from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import convex_vertices
from cfplan_core.model import Finger, Goal, Grasp, Hand, Joint, Link, ManipulatedObject, Problem

FloatArray = NDArray[np.float64]
Polygon = Sequence[tuple[float, float]]

TOLERANCE = 1e-6
"""In m."""

BOX = [(-0.02, 0.0), (0.02, 0.0), (0.02, 0.03), (-0.02, 0.03)]
"""On y = 0: edge 0 is its bottom, edge 1 its right side."""

DIAMOND = [(0.0, -0.02), (0.02, 0.0), (0.0, 0.02), (-0.02, 0.0)]


def plate(left: float, right: float, top: float = 0.0, thickness: float = 0.01) -> Polygon:
    """Edge 2 is its top, from the right vertex 2 to the left vertex 3."""
    below = top - thickness
    return [(left, below), (right, below), (right, top), (left, top)]


def placed(
    outline: Polygon | FloatArray,
    palms: Sequence[Polygon],
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
    fingers: Sequence[Finger] = (),
    joints: Sequence[float] = (),
) -> tuple[ContactSystem, FloatArray]:
    grasp = Grasp(pose, joints)
    thing = ManipulatedObject(outline, 0.1)
    hand = Hand(tuple(palms), tuple(fingers))
    problem = Problem('placed', (0.0, -9.81), hand, thing, 0.0, grasp, Goal(pose))
    system = ContactSystem(problem)
    return system, system.configuration(grasp)


def contacts(
    outline: Polygon | FloatArray,
    palms: Sequence[Polygon],
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
    fingers: Sequence[Finger] = (),
    joints: Sequence[float] = (),
) -> set[str]:
    system, z = placed(outline, palms, pose, fingers, joints)
    pairs = touching(system, z, TOLERANCE / system.size)
    return set(system.contact_names(pairs.tolist()))


def test_object_edge_inside_a_hand_edge_touches_with_both_its_vertices() -> None:
    assert contacts(BOX, [plate(-0.1, 0.1)]) == {'object.v0|palm.0.e2', 'object.v1|palm.0.e2'}


def test_hand_edge_inside_an_object_edge_touches_with_both_its_vertices() -> None:
    assert contacts(BOX, [plate(-0.01, 0.015)]) == {
        'object.e0|palm.0.v2',
        'object.e0|palm.0.v3',
    }


def test_edges_that_overlap_in_part_touch_with_one_vertex_each() -> None:
    assert contacts(BOX, [plate(-0.01, 0.1)]) == {'object.v1|palm.0.e2', 'object.e0|palm.0.v3'}


def test_edges_with_one_end_in_common_touch_with_three_vertices() -> None:
    assert contacts(BOX, [plate(-0.02, 0.1)]) == {
        'object.v0|palm.0.e2',
        'object.v1|palm.0.e2',
        'object.e0|palm.0.v3',
    }


def test_edges_with_both_ends_in_common_touch_with_four_vertices() -> None:
    assert contacts(BOX, [plate(-0.02, 0.02)]) == {
        'object.v0|palm.0.e2',
        'object.v1|palm.0.e2',
        'object.e0|palm.0.v2',
        'object.e0|palm.0.v3',
    }


@settings(max_examples=50)
@given(
    left=st.floats(-0.05, 0.019),
    width=st.floats(0.001, 0.05),
    turn=st.floats(-3.0, 3.0),
)
def test_edge_on_edge_is_two_contacts_wherever_they_overlap(
    left: float, width: float, turn: float
) -> None:
    """The ends of the overlap, by comparing intervals; both bodies are turned together."""
    right = left + width
    apart = [abs(a - b) for a in (left, right) for b in (-0.02, 0.02)]
    if min(apart) < 1e-5 or right < -0.02:
        return
    rotation = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    palm = np.array(plate(left, right)) @ rotation
    expected = {
        'object.v0|palm.0.e2' if left < -0.02 else 'object.e0|palm.0.v3',
        'object.v1|palm.0.e2' if right > 0.02 else 'object.e0|palm.0.v2',
    }
    assert contacts(BOX, [palm.tolist()], (0.0, 0.0, turn)) == expected


def test_corner_on_corner_touches_all_edges_that_it_may_slide_along() -> None:
    """The box's lower left corner on the plate's upper right one, edges flush beside both."""
    assert contacts(BOX, [plate(-0.1, -0.02)]) == {
        'object.v0|palm.0.e2',
        'object.v0|palm.0.e1',
        'object.e0|palm.0.v2',
        'object.e3|palm.0.v2',
    }


def test_point_on_point_touches_both_edges_of_both() -> None:
    below = [(x, y - 0.04) for x, y in DIAMOND]
    assert contacts(DIAMOND, [below]) == {
        'object.v0|palm.0.e1',
        'object.v0|palm.0.e2',
        'object.e0|palm.0.v2',
        'object.e3|palm.0.v2',
    }


def test_tilted_corner_on_corner_touches_only_what_it_does_not_dip_into() -> None:
    """Turned left: the box stands on the plate's top, its left side leans over the corner."""
    tilt = 0.1
    shift = (-0.02 * math.cos(tilt), -0.02 * math.sin(tilt))
    pose = (-0.02 - shift[0], -shift[1], tilt)
    assert contacts(BOX, [plate(-0.1, -0.02)], pose) == {
        'object.v0|palm.0.e2',
        'object.e3|palm.0.v2',
    }


def test_vertex_on_a_vertex_coincides_with_itself() -> None:
    system, z = placed(BOX, [plate(-0.02, 0.1)])
    pairs = touching(system, z, TOLERANCE / system.size)
    names = system.contact_names(pairs.tolist())
    together = coincident(system, z, pairs, TOLERANCE / system.size)
    assert {frozenset((names[i], names[j])) for i, j in np.argwhere(together)} == {
        frozenset(('object.v0|palm.0.e2', 'object.e0|palm.0.v3'))
    }


def test_edge_on_edge_does_not_coincide() -> None:
    system, z = placed(BOX, [plate(-0.01, 0.1)])
    pairs = touching(system, z, TOLERANCE / system.size)
    assert not coincident(system, z, pairs, TOLERANCE / system.size).any()


def test_seam_of_two_palms_does_not_coincide() -> None:
    """The box's vertex on the seam touches each palm once: these are different bodies."""
    system, z = placed(BOX, [plate(-0.1, -0.02), plate(-0.02, 0.1)])
    pairs = touching(system, z, TOLERANCE / system.size)
    rows = coincident(system, z, pairs, TOLERANCE / system.size)
    bodies = system.pair_body[pairs]
    assert rows.any()
    assert all(bodies[i] == bodies[j] for i, j in np.argwhere(rows))


def test_reflex_vertex_touches_nothing() -> None:
    """A notch over the middle of the plate: only the feet beside it stand."""
    arch = [
        (-0.02, 0.0),
        (-0.01, 0.0),
        (0.0, 0.01),
        (0.01, 0.0),
        (0.02, 0.0),
        (0.02, 0.03),
        (-0.02, 0.03),
    ]
    assert contacts(arch, [plate(-0.1, 0.1)]) == {f'object.v{k}|palm.0.e2' for k in (0, 1, 3, 4)}


def test_pin_in_a_notch_touches_both_sides_of_it_at_one_place() -> None:
    notched = [(-0.02, 0.0), (0.0, 0.02), (0.02, 0.0), (0.02, 0.04), (-0.02, 0.04)]
    pin = [(-0.001, -0.01), (0.001, -0.01), (0.0, 0.02)]
    system, z = placed(notched, [pin])
    pairs = touching(system, z, TOLERANCE / system.size)
    assert set(system.contact_names(pairs.tolist())) == {
        'object.e0|palm.0.v2',
        'object.e1|palm.0.v2',
    }
    assert coincident(system, z, pairs, TOLERANCE / system.size)[0, 1]


def test_vertex_that_dips_into_the_edge_beside_a_reflex_vertex_does_not_touch_it() -> None:
    """In a step of the palm the box's corner stands on the floor, its side off the riser."""
    step = [(-0.1, -0.01), (0.1, -0.01), (0.1, 0.0), (-0.03, 0.0), (-0.03, 0.02), (-0.1, 0.02)]
    assert contacts(BOX, [step]) == {'object.v0|palm.0.e2', 'object.v1|palm.0.e2'}
    assert contacts(BOX, [step], (-0.01, 0.0, 0.0)) == {
        'object.v0|palm.0.e2',
        'object.v1|palm.0.e2',
        'object.v0|palm.0.e3',
        'object.e3|palm.0.v4',
    }


@pytest.mark.parametrize('thickness', [1e-2, 1e-3, 1e-4, 1e-5])
def test_far_side_of_a_thin_link_is_not_touched(thickness: float) -> None:
    """A bar under the box: its lower edge 0 and its tip's other corner 1 are not touched."""
    bar = [(0.0, -thickness), (0.06, -thickness), (0.06, 0.0), (0.0, 0.0)]
    finger = Finger(
        'f', (-0.05, 0.0), 0.0, (Joint('j', -1.0, 1.0, 1.0, 1.0),), (Link('l', 0.06, bar),)
    )
    assert contacts(BOX, [], (0.0, 0.0, 0.0), [finger], [0.0]) == {
        'object.v0|f.l.e2',
        'object.e0|f.l.v2',
    }


def test_edge_that_is_touched_from_inside_is_not_touched() -> None:
    """A plate standing in the box: vertices on edges from the wrong side."""
    assert contacts(BOX, [plate(-0.01, 0.01, top=0.01, thickness=0.01)]) == set()


def test_vertex_beyond_the_end_of_an_edge_does_not_touch_it() -> None:
    assert contacts(BOX, [plate(0.021, 0.1)]) == set()


@pytest.mark.parametrize('height', [-0.9e-6, 0.0, 0.9e-6])
def test_gap_within_the_tolerance_touches(height: float) -> None:
    assert len(contacts(BOX, [plate(-0.1, 0.1)], (0.0, height, 0.0))) == 2


@pytest.mark.parametrize('height', [-1.1e-6, 1.1e-6])
def test_gap_beyond_the_tolerance_does_not_touch(height: float) -> None:
    assert contacts(BOX, [plate(-0.1, 0.1)], (0.0, height, 0.0)) == set()


@pytest.mark.parametrize('beyond', [0.9e-6, 1.1e-6])
def test_end_of_an_edge_is_wider_by_the_tolerance(beyond: float) -> None:
    """The plate's end may fall short of the box's corner by so much: a vertex on a vertex."""
    found = contacts(BOX, [plate(-0.02 + beyond, 0.1)])
    assert ('object.v0|palm.0.e2' in found) == (beyond < 1e-6)


@pytest.mark.parametrize('tilt', [-4e-5, -1e-5, -1e-6, 1e-6, 1e-5, 4e-5])
@pytest.mark.parametrize(
    'palm', [plate(-0.1, 0.1), plate(-0.01, 0.015), plate(-0.1, 0.01), plate(0.018, 0.1)]
)
def test_edge_tilted_within_the_tolerance_is_flush(palm: Polygon, tilt: float) -> None:
    """Half the box's 40 mm times 4e-5 rad is 0.8e-6 m: both ends touch, though one end dips."""
    flush = contacts(BOX, [palm])
    assert len(flush) == 2
    assert contacts(BOX, [palm], (0.0, 0.0, tilt)) == flush


@pytest.mark.parametrize('tilt', [-5e-4, 5e-4])
@pytest.mark.parametrize('side', [-1.0, 1.0])
def test_short_overlap_tilted_within_the_tolerance_is_flush(side: float, tilt: float) -> None:
    """The box's outer 2 mm on the plate, turned about their middle: 1 mm times 5e-4 is 0.5 µm."""
    ends = sorted((0.018 * side, 0.1 * side))
    pivot = 0.019 * side
    pose = (pivot - pivot * math.cos(tilt), -pivot * math.sin(tilt), tilt)
    assert len(contacts(BOX, [plate(*ends)], pose)) == 2


def test_edge_tilted_beyond_the_tolerance_stands_on_one_vertex() -> None:
    tilt = 1e-4
    pose = (0.0, 0.02 * math.sin(tilt), tilt)
    assert contacts(BOX, [plate(-0.1, 0.1)], pose) == {'object.v0|palm.0.e2'}


@st.composite
def star_shaped(draw: st.DrawFn) -> FloatArray:
    """A simple polygon, convex or not: each vertex in its own sector about the origin."""
    n = draw(st.integers(4, 9))
    turns = np.array([draw(st.floats(0.1, 0.9)) for _ in range(n)])
    angles = (np.arange(n) + turns) * 2.0 * np.pi / n
    radii = np.array([draw(st.floats(0.01, 0.04)) for _ in range(n)])
    return np.column_stack([radii * np.cos(angles), radii * np.sin(angles)])


@settings(max_examples=60)
@given(outline=star_shaped(), turn=st.floats(-3.0, 3.0))
def test_dropped_polygon_stands_on_its_lowest_vertices(outline: FloatArray, turn: float) -> None:
    c, s = math.cos(turn), math.sin(turn)
    height = outline @ [s, c]
    above = height - height.min()
    if ((above > 1e-8) & (above < 1e-4)).any():
        return
    lowest = np.flatnonzero(convex_vertices(outline) & (above <= 1e-8))
    found = contacts(outline, [plate(-0.2, 0.2)], (0.0, -float(height.min()), turn))
    assert found == {f'object.v{k}|palm.0.e2' for k in lowest}


@settings(max_examples=60)
@given(
    outline=star_shaped(),
    turn=st.floats(-3.0, 3.0),
    pin=st.tuples(st.integers(0, 8), st.floats(0.02, 0.98)),
)
def test_pin_on_an_edge_touches_that_edge_alone(
    outline: FloatArray, turn: float, pin: tuple[int, float]
) -> None:
    """A needle along the edge's normal: hand vertex on object edge, in any direction."""
    edge = pin[0] % len(outline)
    start, end = outline[edge], outline[(edge + 1) % len(outline)]
    along = (end - start) / np.linalg.norm(end - start)
    normal = np.array([along[1], -along[0]])
    tip = start + pin[1] * (end - start)
    needle = np.array(
        [tip, tip + 1e-3 * normal - 1e-5 * along, tip + 1e-3 * normal + 1e-5 * along]
    )
    c, s = math.cos(turn), math.sin(turn)
    world = needle @ np.array([[c, s], [-s, c]])
    system, z = placed(outline, [world.tolist()], (0.0, 0.0, turn))
    pairs = touching(system, z, 1e-9 / system.size)
    assert system.contact_names(pairs.tolist()) == (f'object.e{edge}|palm.0.v0',)
    assert abs(gaps(system, system.place(z[None]), pairs).gap[0, 0]) < 1e-12
