from __future__ import annotations

import numpy as np
import pytest
from planning.scenes import FEET, TIPS, at, formation, pushed_angles, pushed_block

from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import Stability
from cfplan_core.planning.pieces import SAME, Piece, Region

SYSTEM = ContactSystem(pushed_block())
KEPT = formation(SYSTEM, *FEET, *TIPS)
PLACES = np.linspace(-0.002, 0.006, 9)


def on_curve(x: float) -> FloatArray:
    return at(SYSTEM, x, pushed_angles(x))


CURVE = Piece(
    0, KEPT, Stability.FORCE_CLOSURE, 1, np.array([on_curve(x) for x in PLACES]), (None, None)
)
POINT = Piece(1, KEPT, Stability.FORCE_CLOSURE, 0, on_curve(0.0)[None], ())


def region(*ways: FloatArray) -> Region:
    """A region with its anchor in the start, from which ways lead, shape (s, 5) each."""
    anchor = ways[0][:1]
    links = [(way[-1], way) for way in ways]
    return Region(2, KEPT, Stability.FORCE_CLOSURE, 2, anchor, (), links)


@pytest.mark.parametrize('index', range(9))
def test_place_of_a_point_is_its_index(index: int) -> None:
    assert CURVE.place(CURVE.points[index]) == pytest.approx(index, abs=1e-9)


@pytest.mark.parametrize('x', [-0.0015, 0.0009, 0.0024, 0.0049])
def test_place_between_points_is_a_fraction(x: float) -> None:
    """As far as the curve is straight between points."""
    assert CURVE.place(on_curve(x)) == pytest.approx((x - PLACES[0]) / 0.001, abs=0.02)


@pytest.mark.parametrize(('end', 'place'), [(0, 0.0), (-1, 8.0)])
def test_place_near_an_end_is_the_end(end: int, place: float) -> None:
    assert CURVE.place(CURVE.points[end] + 0.5 * SAME) == place


@pytest.mark.parametrize(
    ('start', 'end', 'between'),
    [
        (-0.0015, 0.0045, range(1, 7)),
        (0.0045, -0.0015, range(6, 0, -1)),
        (-0.0015, -0.0012, ()),
        (-0.0012, -0.0015, ()),
        (-0.002, 0.006, range(1, 8)),
        (0.0026, 0.0014, (4,)),
    ],
)
def test_path_on_a_curve_takes_the_points_between(
    start: float, end: float, between: range | tuple[int, ...]
) -> None:
    first, last = on_curve(start), on_curve(end)
    expected = np.array([first, *(CURVE.points[k] for k in between), last])
    np.testing.assert_allclose(CURVE.path(first, last), expected, atol=1e-15)


def test_path_from_a_configuration_to_itself_stays() -> None:
    z = on_curve(0.0005)
    path = CURVE.path(z, z)
    np.testing.assert_array_equal(path, np.tile(z, (len(path), 1)))


def test_path_on_a_point_is_the_point() -> None:
    z = on_curve(0.0)
    np.testing.assert_array_equal(POINT.path(z, z), z[None])


def test_path_in_a_region_leads_over_its_anchor() -> None:
    right = np.array([on_curve(x) for x in (0.0, 0.001, 0.002)])
    left = np.array([on_curve(x) for x in (0.0, -0.001)])
    path = region(right, left).path(right[-1], left[-1])
    np.testing.assert_array_equal(path, [*right[::-1], left[1]])


def test_path_in_a_region_takes_the_link_that_ends_where_it_shall() -> None:
    ways = [np.array([on_curve(0.0), on_curve(x)]) for x in (0.001, 0.002, 0.003)]
    path = region(*ways).path(ways[2][-1], ways[1][-1])
    np.testing.assert_array_equal(path, [ways[2][-1], on_curve(0.0), ways[1][-1]])


def test_anchor_of_a_region_is_its_only_point() -> None:
    way = np.array([on_curve(0.0), on_curve(0.001)])
    np.testing.assert_array_equal(region(way).anchor, way[0])
