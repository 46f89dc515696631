import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from shapely.geometry import LinearRing, Polygon

from cfplan_core.geometry.polygon import (
    centroid,
    convex_vertices,
    diameter,
    first_self_intersection,
    is_flat,
    repeated_vertices,
    second_moment,
    signed_area,
)

SQUARE = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
L_SHAPE = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]])


@st.composite
def star_shaped(draw):
    """A simple polygon, counter-clockwise: each vertex in its own sector about the origin."""
    n = draw(st.integers(3, 12))
    share = st.floats(0.1, 0.9)
    angles = (np.arange(n) + [draw(share) for _ in range(n)]) * 2.0 * np.pi / n
    assume(max(np.diff([*angles, angles[0] + 2.0 * np.pi])) < 3.0)
    radii = np.array([draw(st.floats(0.2, 1.0)) for _ in range(n)])
    return np.column_stack([radii * np.cos(angles), radii * np.sin(angles)])


def grid_polygons(size=5, most=8):
    coordinate = st.integers(0, size)
    return st.lists(st.tuples(coordinate, coordinate), min_size=3, max_size=most).map(
        lambda corners: np.array(corners, dtype=float)
    )


def placed(vertices, scale, angle, shift):
    c, s = np.cos(angle), np.sin(angle)
    return scale * vertices @ np.array([[c, s], [-s, c]]) + shift


placements = st.tuples(
    st.floats(1e-3, 1e3),
    st.floats(-np.pi, np.pi),
    st.tuples(st.floats(-10, 10), st.floats(-10, 10)),
)


def test_area_of_a_counter_clockwise_square_is_positive():
    assert signed_area(SQUARE) == 4.0


def test_area_of_a_clockwise_square_is_negative():
    assert signed_area(SQUARE[::-1]) == -4.0


def test_second_moment_of_a_rectangle_about_its_centre_and_a_corner():
    box = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [0.0, 1.0]])
    assert second_moment(box, np.array([1.5, 0.5])) == pytest.approx((9.0 + 1.0) / 12.0)
    assert second_moment(box, np.zeros(2)) == pytest.approx((9.0 + 1.0) / 3.0)


def test_second_moment_of_an_l_shape_is_that_of_its_three_squares():
    about = np.array([0.3, 0.2])
    middles = np.array([[0.5, 0.5], [1.5, 0.5], [0.5, 1.5]]) - about
    expected = 1.0 / 6.0 + (middles**2).sum() / 3.0
    assert second_moment(L_SHAPE, about) == pytest.approx(expected)


def test_area_of_a_small_polygon_far_away_is_exact():
    far = 0.0078125 * SQUARE + 2.0**20
    assert signed_area(far) == 4.0 * 0.0078125**2


@given(star_shaped())
def test_area_is_that_of_shapely(vertices):
    assert signed_area(vertices) == pytest.approx(Polygon(vertices).area, rel=1e-9)


def test_centroid_of_an_l_is_that_of_its_three_squares():
    assert centroid(L_SHAPE) == pytest.approx([5.0 / 6.0, 5.0 / 6.0])


@given(star_shaped(), placements)
def test_centroid_is_that_of_shapely(vertices, placement):
    moved = placed(vertices, *placement)
    expected = Polygon(moved).centroid
    assert centroid(moved) == pytest.approx([expected.x, expected.y], abs=1e-8 * placement[0])


@given(grid_polygons(size=50, most=30))
def test_diameter_is_the_largest_of_all_distances(vertices):
    distances = [np.hypot(*(p - q)) for p in vertices for q in vertices]
    assert diameter(vertices) == pytest.approx(max(distances))


def test_diameter_of_many_vertices_is_found_across_blocks():
    angles = np.linspace(0.0, np.pi, 2001)
    half_circle = np.column_stack([np.cos(angles), np.sin(angles)])
    assert diameter(half_circle) == pytest.approx(2.0)


def test_reflex_vertex_of_an_l_is_not_convex():
    assert convex_vertices(L_SHAPE).tolist() == [True, True, True, False, True, True]


def test_vertex_in_the_middle_of_an_edge_is_not_convex():
    assert convex_vertices(np.insert(SQUARE, 1, [1.0, 0.0], axis=0)).tolist() == [
        True,
        False,
        True,
        True,
        True,
    ]


@given(star_shaped())
def test_all_vertices_of_a_convex_hull_are_convex(vertices):
    hull = Polygon(vertices).convex_hull.exterior
    corners = np.array(hull.coords)[:-1]
    corners = corners if hull.is_ccw else corners[::-1]
    assert convex_vertices(corners, tolerance=-1e-9).all()


def test_repeated_vertex_is_found():
    assert repeated_vertices(np.insert(SQUARE, 2, SQUARE[1], axis=0)).tolist() == [2]


def test_first_vertex_repeated_at_the_end_is_found_at_the_first():
    assert repeated_vertices(np.append(SQUARE, SQUARE[:1], axis=0)).tolist() == [0]


def test_square_has_no_repeated_vertex():
    assert repeated_vertices(SQUARE).size == 0


@given(st.lists(st.integers(-20, 20), min_size=3, max_size=8), placements)
def test_vertices_on_a_line_are_flat(along, placement):
    line = np.column_stack([np.array(along, dtype=float), np.zeros(len(along))])
    scale, angle, shift = placement
    assume(scale > 0.1)
    assert is_flat(placed(line, scale, angle, np.array(shift) * 1e-3))


def test_thin_triangle_is_not_flat():
    assert not is_flat(np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 1e-6]]))


def test_bow_tie_crosses_itself():
    assert first_self_intersection(SQUARE[[0, 1, 3, 2]]) == (1, 3)


def test_vertex_on_a_distant_edge_touches_it():
    touching = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [2.0, 0.0], [0.0, 3.0]])
    assert first_self_intersection(touching) == (0, 2)


def test_two_vertices_at_one_place_touch():
    hourglass = np.array([[0, 0], [2, 0], [1, 1], [2, 2], [0, 2], [1, 1]], dtype=float)
    assert first_self_intersection(hourglass) is not None


def test_edge_that_folds_back_onto_its_neighbour_is_found():
    spike = np.array([[0.0, 0.0], [4.0, 0.0], [2.0, 0.0], [2.0, 3.0]])
    assert first_self_intersection(spike) == (0, 1)


def test_edge_that_its_neighbour_folds_back_over_is_found():
    spike = np.array([[2.0, 0.0], [4.0, 0.0], [0.0, 0.0], [0.0, 3.0]])
    assert first_self_intersection(spike) == (0, 1)


def test_last_edge_that_folds_back_onto_the_first_is_found():
    spike = np.array([[8.0, 0.0], [7.0, 0.0], [2.0, 3.0], [4.0, 0.0]])
    assert first_self_intersection(spike) == (0, 3)


def test_edges_on_one_line_apart_from_each_other_do_not_meet():
    comb = np.array(
        [[0, 0], [9, 0], [9, 3], [8, 1], [6, 1], [5, 3], [4, 1], [2, 1], [0, 3]], dtype=float
    )
    for angle in np.linspace(0.0, 3.0, 50):
        assert first_self_intersection(placed(comb, 0.01, angle, np.array([1.0, 2.0]))) is None


def test_edges_on_one_line_do_not_cross_by_rounding():
    notched = np.array(
        [
            [-3.379, 1.421],
            [-0.449, -0.489],
            [0.511, 0.491],
            [0.604, 0.88],
            [0.991, 0.981],
            [1.951, 1.961],
        ]
    )
    assert first_self_intersection(notched) is None


def test_very_short_edges_do_not_count_as_meeting():
    chamfered = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1e-7, 1.0], [0.0, 1.0 - 1e-7]])
    assert first_self_intersection(chamfered) is None


@given(star_shaped(), placements)
def test_star_shaped_polygon_is_simple_wherever_it_is_placed(vertices, placement):
    assert first_self_intersection(placed(vertices, *placement)) is None


@given(grid_polygons())
def test_simple_as_shapely_says_on_a_grid(vertices):
    assume(not repeated_vertices(vertices).size and not is_flat(vertices))
    expected = LinearRing(vertices).is_simple and Polygon(vertices).is_valid
    assert (first_self_intersection(vertices) is None) == expected


@given(grid_polygons(), st.integers(0, 7))
def test_verdict_does_not_depend_on_the_first_vertex_and_the_direction(vertices, shift):
    assume(not repeated_vertices(vertices).size)
    simple = first_self_intersection(vertices) is None
    turned = np.roll(vertices, shift, axis=0)
    assert (first_self_intersection(turned) is None) == simple
    assert (first_self_intersection(turned[::-1]) is None) == simple


def test_crossing_between_distant_blocks_of_edges_is_found():
    angles = np.linspace(0.0, 2.0 * np.pi, 2000, endpoint=False)
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    circle[1500] = [1.5, 0.5]
    found = first_self_intersection(circle)
    assert found is not None
    assert found[1] in (1499, 1500)
    assert found[0] < 500


def test_circle_of_many_vertices_is_simple():
    angles = np.linspace(0.0, 2.0 * np.pi, 3000, endpoint=False)
    assert first_self_intersection(np.column_stack([np.cos(angles), np.sin(angles)])) is None
