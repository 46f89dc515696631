from __future__ import annotations

import numpy as np
import pytest
import shapely

from cfplan_core.geometry.convex_pieces import convex_pieces, rounded, shrunk

SQUARE = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
NOTCHED = np.array([[0.0, 0.0], [6.0, 0.0], [6.0, 4.0], [4.0, 4.0], [3.0, 2.0], [0.0, 4.0]])


def test_shrunk_square_is_a_smaller_square() -> None:
    inner = shrunk(SQUARE, 0.1)
    assert inner == pytest.approx(np.array([[0.1, 0.1], [1.9, 0.1], [1.9, 1.9], [0.1, 1.9]]))


@pytest.mark.parametrize('vertices', [SQUARE, NOTCHED])
def test_shrunk_polygon_is_shapelys_with_sharp_corners(vertices: np.ndarray) -> None:
    wanted = shapely.Polygon(vertices).buffer(-0.05, join_style='mitre', mitre_limit=100.0)
    inner = shapely.Polygon(shrunk(vertices, 0.05))
    assert inner.symmetric_difference(wanted).area < 1e-9


def test_convex_polygon_stays_whole() -> None:
    (piece,) = convex_pieces(SQUARE)
    assert np.array_equal(piece, SQUARE)


def test_pieces_of_a_polygon_with_a_notch_cover_it_once() -> None:
    pieces = [shapely.Polygon(piece) for piece in convex_pieces(NOTCHED)]
    assert len(pieces) > 1
    assert all(piece.convex_hull.area == pytest.approx(piece.area) for piece in pieces)
    assert sum(piece.area for piece in pieces) == pytest.approx(shapely.Polygon(NOTCHED).area)
    assert shapely.union_all(pieces).symmetric_difference(shapely.Polygon(NOTCHED)).area < 1e-9


@pytest.mark.parametrize('tip', [0.01, 0.1, 0.5, 2.0, 40.0])
def test_rounded_corners_touch_both_edges_and_move_no_farther_than_a_right_angle(
    tip: float,
) -> None:
    """Of a triangle whose corner at the origin is as sharp as is wanted."""
    corners = np.array([[0.0, 0.0], [1.0, -0.5 * tip], [1.0, 0.5 * tip]])
    centers, radii = rounded(corners, 1e-3)
    for k in range(3):
        edges = (
            shapely.LineString(corners[[k, (k + 1) % 3]]),
            shapely.LineString(corners[[k - 1, k]]),
        )
        for edge in edges:
            assert edge.distance(shapely.Point(centers[k])) == pytest.approx(radii[k])
        recedes = np.linalg.norm(corners[k] - centers[k]) - radii[k]
        assert recedes <= 1e-3 * (np.sqrt(2.0) - 1.0) * (1.0 + 1e-9)
    assert radii.max() <= 1e-3


def test_right_angles_are_rounded_by_the_radius() -> None:
    centers, radii = rounded(SQUARE, 0.1)
    np.testing.assert_allclose(radii, 0.1)
    np.testing.assert_allclose(centers, shrunk(SQUARE, 0.1))
