"""Markers of one shape each: plates cut from polygons, outlines, spheres, arrows, text.

Sizes are parts of the object's largest extent, so that a coin and a crate look alike.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from geometry_msgs.msg import Point, Vector3
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker

from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.geometry.triangulation import triangulate


@dataclass(frozen=True)
class Sizes:
    """Lengths for an object of a size, all in m.

    Attributes:
        unit: Largest extent of the object.
    """

    unit: float

    @property
    def top(self) -> float:
        """Height of the plates' upper faces; the lower ones are as far below the plane."""
        return 0.06 * self.unit

    @property
    def rim(self) -> float:
        """Height of the plates' outlines: far enough over them for a viewer to tell."""
        return 0.08 * self.unit

    @property
    def behind(self) -> float:
        """Height, negative, of what lies under the plates; its outlines lie a little higher."""
        return -0.1 * self.unit

    @property
    def behind_rim(self) -> float:
        """Height, negative, of the outlines of what lies under the plates."""
        return -0.08 * self.unit

    @property
    def above(self) -> float:
        """Height of what lies over the plates."""
        return 0.12 * self.unit

    @property
    def line(self) -> float:
        """Width of outlines."""
        return 0.012 * self.unit

    @property
    def dot(self) -> float:
        """Diameter of contacts."""
        return 0.06 * self.unit

    @property
    def letter(self) -> float:
        """Height of text."""
        return 0.11 * self.unit


def colour(code: str, opacity: float = 1.0) -> ColorRGBA:
    """Colour of a marker from ``#RRGGBB``, in the single precision of the message."""
    parts = [int(code[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
    red, green, blue, alpha = np.array([*parts, opacity], dtype=np.float32).tolist()
    return ColorRGBA(r=red, g=green, b=blue, a=alpha)


def plate(
    header: Header, ns: str, index: int, vertices: FloatArray, paint: ColorRGBA, sizes: Sizes
) -> Marker:
    """Solid polygon.

    Args:
        header: Its frame is that of the vertices.
        ns: Namespace of the marker.
        index: Number of the marker in the namespace.
        vertices: Shape (v, 2), m, counter-clockwise.
        paint: Colour.
        sizes: Give its thickness.
    """
    upper, lower = _points(vertices, sizes.top), _points(vertices, -sizes.top)
    corners = []
    for a, b, c in triangulate(vertices).tolist():
        corners += [upper[a], upper[b], upper[c], lower[c], lower[b], lower[a]]
    for a in range(len(vertices)):
        b = (a + 1) % len(vertices)
        corners += [lower[a], lower[b], upper[b], lower[a], upper[b], upper[a]]
    return _marker(header, ns, index, Marker.TRIANGLE_LIST, paint, (1.0, 1.0, 1.0), corners)


def sheet(
    header: Header,
    ns: str,
    index: int,
    vertices: FloatArray,
    paint: ColorRGBA,
    height: float,
) -> Marker:
    """Polygon without thickness at a height, m; otherwise as `plate`."""
    points = _points(vertices, height)
    corners = [points[k] for k in triangulate(vertices).ravel().tolist()]
    return _marker(header, ns, index, Marker.TRIANGLE_LIST, paint, (1.0, 1.0, 1.0), corners)


def outline(
    header: Header,
    ns: str,
    index: int,
    vertices: FloatArray,
    paint: ColorRGBA,
    height: float,
    sizes: Sizes,
) -> Marker:
    """Closed line around a polygon at a height, m; otherwise as `plate`."""
    points = _points(vertices, height)
    width = (sizes.line, 0.0, 0.0)
    return _marker(header, ns, index, Marker.LINE_STRIP, paint, width, [*points, points[0]])


def dots(
    header: Header, ns: str, points: FloatArray, paint: ColorRGBA, height: float, sizes: Sizes
) -> Marker:
    """Spheres at points of shape (k, 2), m, k at least 1, and a height; number 0 of `ns`."""
    diameter = (sizes.dot, sizes.dot, sizes.dot)
    at = _points(points, height)
    return _marker(header, ns, 0, Marker.SPHERE_LIST, paint, diameter, at)


def arrow(
    header: Header,
    ns: str,
    index: int,
    start: FloatArray,
    end: FloatArray,
    paint: ColorRGBA,
    height: float,
    sizes: Sizes,
) -> Marker:
    """Arrow between two different points of shape (2,), m, at a height."""
    head = min(0.12 * sizes.unit, 0.5 * float(np.hypot(*(end - start))))
    size = (0.03 * sizes.unit, 0.075 * sizes.unit, head)
    ends = _points(np.array([start, end]), height)
    return _marker(header, ns, index, Marker.ARROW, paint, size, ends)


def text(
    header: Header, ns: str, place: FloatArray, words: str, paint: ColorRGBA, sizes: Sizes
) -> Marker:
    """Text around a point of shape (2,), m, that faces the viewer; number 0 of a namespace."""
    marker = _marker(header, ns, 0, Marker.TEXT_VIEW_FACING, paint, (0.0, 0.0, sizes.letter), [])
    marker.pose.position = Point(x=float(place[0]), y=float(place[1]), z=2.0 * sizes.above)
    marker.text = words
    return marker


def removal(header: Header, ns: str, index: int) -> Marker:
    """Take a marker away, whether it is there or not."""
    return Marker(header=header, ns=ns, id=index, action=Marker.DELETE)


def _points(places: FloatArray, height: float) -> list[Point]:
    return [Point(x=x, y=y, z=height) for x, y in places.tolist()]


def _marker(
    header: Header,
    ns: str,
    index: int,
    kind: int,
    paint: ColorRGBA,
    size: tuple[float, float, float],
    points: Iterable[Point],
) -> Marker:
    return Marker(
        header=header,
        ns=ns,
        id=index,
        type=kind,
        action=Marker.ADD,
        scale=Vector3(x=size[0], y=size[1], z=size[2]),
        color=paint,
        frame_locked=True,
        points=list(points),
    )
