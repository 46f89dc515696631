from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from shapely import LinearRing, Polygon, points

from cfplan_core.geometry.separation import penetration_depth

FloatArray = NDArray[np.float64]

SQUARE = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
CUP = np.array(
    [
        (0.0, 0.0),
        (3.0, 0.0),
        (3.0, 2.0),
        (2.0, 2.0),
        (2.0, 1.0),
        (1.0, 1.0),
        (1.0, 2.0),
        (0.0, 2.0),
    ]
)


def turned(vertices: FloatArray, angle: float) -> FloatArray:
    c, s = math.cos(angle), math.sin(angle)
    return np.asarray(vertices @ np.array([[c, s], [-s, c]]))


def shifted(vertices: FloatArray, x: float, y: float) -> FloatArray:
    return vertices + np.array([x, y])


def upright(width: float, height: float) -> FloatArray:
    return SQUARE * [width, height] - [0.5 * width, 0.5 * height]


@st.composite
def star_shaped(draw: st.DrawFn) -> FloatArray:
    """A simple polygon, convex or not, somewhere near the origin."""
    n = draw(st.integers(4, 9))
    share = np.array([draw(st.integers(10, 90)) for _ in range(n)]) / 100
    angles = (np.arange(n) + share) * 2.0 * np.pi / n
    radii = np.array([draw(st.integers(20, 100)) for _ in range(n)]) / 100
    shift = np.array([draw(st.integers(-100, 100)), draw(st.integers(-100, 100))]) / 100
    return np.column_stack([radii * np.cos(angles), radii * np.sin(angles)]) + shift


convex = star_shaped().map(
    lambda vertices: np.array(Polygon(vertices).convex_hull.exterior.coords)[:0:-1]
)


def deepest(of: FloatArray, inside: FloatArray) -> float:
    """Depth of a polygon's boundary in another polygon, from 2000 points of every edge."""
    fractions = np.linspace(0.0, 1.0, 2000)[:, None]
    ends = np.roll(of, -1, axis=0)
    samples = points(
        np.concatenate([a + fractions * (b - a) for a, b in zip(of, ends, strict=True)])
    )
    polygon = Polygon(inside)
    within = samples[polygon.contains(samples)]
    return float(LinearRing(inside).distance(within).max(initial=0.0))


@settings(max_examples=200)
@given(a=star_shaped(), b=star_shaped())
def test_polygons_overlap_where_shapely_finds_an_area(a: FloatArray, b: FloatArray) -> None:
    area = Polygon(a).intersection(Polygon(b)).area
    assume(area == 0.0 or area > 1e-12)
    assert (penetration_depth(a, b) > 0.0) == (area > 0.0)


@settings(max_examples=60)
@given(a=star_shaped(), b=star_shaped())
def test_some_point_is_as_deep_as_the_depth(a: FloatArray, b: FloatArray) -> None:
    """One of the polygons, all but shrunk by the depth, still has a point in the other."""
    depth = penetration_depth(a, b)
    assume(depth > 1e-6)
    shrunk = [
        Polygon(one).buffer(-0.999 * depth, quad_segs=64).intersects(Polygon(other))
        for one, other in ((a, b), (b, a))
    ]
    assert any(shrunk)


@settings(max_examples=60)
@given(a=convex, b=convex)
def test_depth_of_convex_polygons_is_at_least_half_that_of_their_boundaries(
    a: FloatArray, b: FloatArray
) -> None:
    boundary = max(deepest(a, b), deepest(b, a))
    assert penetration_depth(a, b) >= 0.5 * boundary - 1e-12


@given(a=star_shaped(), b=star_shaped())
def test_order_does_not_matter(a: FloatArray, b: FloatArray) -> None:
    assert penetration_depth(a, b) == penetration_depth(b, a)


@settings(max_examples=60)
@given(a=star_shaped(), b=star_shaped(), turn=st.floats(-3.0, 3.0))
def test_overlap_does_not_depend_on_the_frame(a: FloatArray, b: FloatArray, turn: float) -> None:
    """The inner point that stands for polygons that coincide is another, so depths may differ."""
    depths = penetration_depth(a, b), penetration_depth(turned(a, turn), turned(b, turn))
    assume(max(depths) == 0.0 or max(depths) > 1e-6)
    assert (depths[0] > 0.0) == (depths[1] > 0.0)


@settings(max_examples=50)
@given(depth=st.floats(1e-9, 1e-2), turn=st.floats(-3.0, 3.0))
def test_corner_is_as_deep_as_its_vertex(depth: float, turn: float) -> None:
    diamond = shifted(turned(SQUARE, math.pi / 4), 0.5, 1.0 - depth)
    found = penetration_depth(turned(SQUARE, turn), turned(diamond, turn))
    assert found == pytest.approx(depth, abs=1e-12)


@pytest.mark.parametrize('depth', [1e-7, 1e-4, 1e-2])
def test_sliver_between_flush_edges_is_as_deep_as_thick(depth: float) -> None:
    assert penetration_depth(SQUARE, shifted(SQUARE, 0.3, 1.0 - depth)) == pytest.approx(
        depth, rel=1e-6
    )


@pytest.mark.parametrize(
    'shift', [(0.3, 1.0), (1.0, 0.0), (1.0, 1.0), (1.0, -1.0), (3.0, 0.0), (0.0, -1.0)]
)
def test_polygons_that_touch_or_are_apart_do_not_overlap(shift: tuple[float, float]) -> None:
    assert penetration_depth(SQUARE, shifted(SQUARE, *shift)) == 0.0


@settings(max_examples=50)
@given(
    turn=st.floats(-3.0, 3.0),
    slide=st.floats(-0.9, 0.9),
    scale=st.sampled_from([1e-3, 1.0, 1e3]),
)
def test_flush_edges_in_any_direction_overlap_by_rounding_alone(
    turn: float, slide: float, scale: float
) -> None:
    above = shifted(SQUARE, slide, 1.0)
    depth = penetration_depth(scale * turned(SQUARE, turn), scale * turned(above, turn))
    assert depth <= 1e-15 * scale


def test_crossing_bars_overlap_though_no_vertex_is_inside() -> None:
    assert penetration_depth(upright(3.0, 0.2), upright(0.2, 3.0)) == pytest.approx(0.1)


def test_small_body_deep_inside_a_large_one_is_found() -> None:
    assert penetration_depth(upright(10.0, 10.0), upright(0.1, 0.1)) == pytest.approx(5.0)


def test_polygons_that_coincide_overlap() -> None:
    assert penetration_depth(SQUARE, SQUARE) == pytest.approx(0.5)


def test_polygons_that_coincide_up_to_rounding_overlap() -> None:
    assert penetration_depth(CUP, CUP + 1e-13) > 0.4


def test_polygons_with_shared_edges_overlap() -> None:
    """All of one polygon's vertices on the boundary of the other: a square and its half."""
    assert penetration_depth(SQUARE, SQUARE * [0.5, 1.0]) == pytest.approx(0.5)


def test_plug_in_a_cup_of_its_width_does_not_overlap() -> None:
    assert penetration_depth(CUP, shifted(SQUARE, 1.0, 1.0)) == 0.0


def test_plug_in_the_wall_of_a_cup_is_as_deep_as_the_middle_of_its_end() -> None:
    """0.1 m into the left wall: its end runs along in 0.9 m, with a corner 0.1 m deep."""
    assert penetration_depth(CUP, shifted(SQUARE, 0.9, 1.0)) == pytest.approx(0.1)


def test_bar_through_the_notch_of_a_cup_overlaps_in_both_walls() -> None:
    """Its middle is in the open: the pieces of its edges in the walls count."""
    bar = np.array([(-1.0, 1.4), (4.0, 1.4), (4.0, 1.6), (-1.0, 1.6)])
    assert penetration_depth(CUP, bar) == pytest.approx(0.5)


def test_edge_along_the_rim_of_a_notch_and_into_the_wall_overlaps() -> None:
    """The lower edge runs flush on the notch's floor, then below it, into the wall."""
    slab = np.array([(1.2, 1.0), (2.6, 1.0), (2.6, 1.5), (1.2, 1.5)])
    assert penetration_depth(CUP, slab) == pytest.approx(0.5, abs=0.11)


@pytest.mark.filterwarnings('error')
@pytest.mark.parametrize('turn', [1e-310, 1e-200, 1e-17])
def test_edges_that_are_all_but_parallel_overlap_without_a_warning(turn: float) -> None:
    assert penetration_depth(SQUARE, turned(shifted(SQUARE, 0.5, 0.0), turn)) == pytest.approx(0.5)


def test_edge_that_enters_and_leaves_through_vertices_counts_by_its_piece_inside() -> None:
    """A bar's upper edge along a diamond's diagonal: deepest in the diamond's middle."""
    diamond = np.array([(0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)])
    bar = np.array([(-3.0, -0.1), (2.0, -0.1), (2.0, 0.0), (-3.0, 0.0)])
    assert penetration_depth(diamond, bar) == pytest.approx(math.sqrt(0.5))
