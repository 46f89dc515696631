from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from cfplan_core.geometry.polygon import signed_area
from cfplan_core.geometry.triangulation import triangulate

FloatArray = NDArray[np.float64]


def comb(teeth: int) -> FloatArray:
    points = [(0.0, 0.0), (float(teeth), 0.0)]
    for k in range(teeth - 1, -1, -1):
        points += [(k + 1.0, 2.0), (k + 0.7, 2.0), (k + 0.7, 1.0), (float(k), 1.0)]
    return np.array(points)


def spiral(steps: int) -> FloatArray:
    t = np.linspace(0.0, 6.0 * np.pi, steps)
    inner = np.column_stack([(0.5 + t) * np.cos(t), (0.5 + t) * np.sin(t)])
    outer = np.column_stack([(1.5 + t) * np.cos(t), (1.5 + t) * np.sin(t)])
    return np.concatenate([outer, inner[::-1]])


SHAPES = {
    'triangle': np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]),
    'straight corners': np.array(
        [(0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (1.0, 0.5), (1.0, 1.0), (0.0, 1.0), (0.0, 0.3)]
    ),
    'L': np.array([(0, 0), (5, 0), (5, 2), (2, 2), (2, 4), (0, 4)], dtype=float),
    'arrowhead': np.array([(0.0, 0.0), (1.0, 2.0), (0.0, 0.5), (-1.0, 2.0)]),
    'comb': comb(6),
    'spiral': spiral(60),
    'small and far away': comb(4) * 1e-3 + 100.0,
}


def areas(vertices: FloatArray) -> FloatArray:
    a, b, c = (vertices[corner] for corner in triangulate(vertices).T)
    p, q = b - a, c - a
    return np.asarray(0.5 * (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]))


@pytest.mark.parametrize('vertices', SHAPES.values(), ids=SHAPES)
def test_triangles_have_the_polygon_s_area(vertices: FloatArray) -> None:
    assert areas(vertices).sum() == pytest.approx(signed_area(vertices), rel=1e-9)


@pytest.mark.parametrize('vertices', SHAPES.values(), ids=SHAPES)
def test_triangles_are_counter_clockwise(vertices: FloatArray) -> None:
    assert (areas(vertices) > 0.0).all()


@given(st.lists(st.floats(0.2, 1.0), min_size=3, max_size=40))
def test_triangles_together_are_the_polygon(radii: list[float]) -> None:
    angles = 2.0 * np.pi * np.arange(len(radii)) / len(radii)
    star = np.array(radii)[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    pieces = [shapely.Polygon(star[corners]) for corners in triangulate(star)]
    apart = shapely.union_all(pieces).symmetric_difference(shapely.Polygon(star))
    assert apart.area < 1e-9
    assert sum(piece.area for piece in pieces) == pytest.approx(shapely.Polygon(star).area)


def test_a_thousand_corners_are_cut_into_as_many_triangles_less_two() -> None:
    angles = 2.0 * np.pi * np.arange(1000) / 1000
    wavy = (1.0 + 0.3 * np.cos(50.0 * angles))[:, None]
    shape = wavy * np.column_stack([np.cos(angles), np.sin(angles)])
    assert len(triangulate(shape)) == 998
