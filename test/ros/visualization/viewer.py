"""What a viewer makes of transforms and markers: everything in the world frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

FloatArray = NDArray[np.float64]


class Viewer:
    """Keeps the last transform of each frame and the markers that are shown."""

    def __init__(self, fixed_frame: str) -> None:
        self.fixed_frame = fixed_frame
        self.markers: dict[tuple[str, int], Marker] = {}
        self._parents: dict[str, tuple[str, FloatArray]] = {}

    def transforms(self, message: TFMessage) -> None:
        """Take transforms, static or not."""
        for each in message.transforms:
            at, turn = each.transform.translation, each.transform.rotation
            matrix = homogeneous((at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w))
            self._parents[each.child_frame_id] = (each.header.frame_id, matrix)

    def show(self, message: MarkerArray) -> None:
        """Add, replace and remove markers, in the order of the message."""
        for marker in message.markers:
            if marker.action == Marker.DELETEALL:
                self.markers.clear()
            elif marker.action == Marker.DELETE:
                self.markers.pop((marker.ns, marker.id), None)
            else:
                assert marker.action == Marker.ADD
                self.markers[marker.ns, marker.id] = marker

    def to_world(self, frame: str) -> FloatArray:
        """Matrix, shape (4, 4), from a frame to the fixed frame; KeyError if there is no way."""
        matrix = np.eye(4)
        while frame != self.fixed_frame:
            frame, step = self._parents[frame]
            matrix = step @ matrix
        return matrix

    def points(self, ns: str, number: int) -> FloatArray:
        """Points of a marker in the fixed frame, shape (k, 3), m."""
        marker = self.markers[ns, number]
        p, q = marker.pose.position, marker.pose.orientation
        pose = homogeneous((p.x, p.y, p.z), (q.x, q.y, q.z, q.w))
        local = np.array([(each.x, each.y, each.z, 1.0) for each in marker.points])
        return (local @ (self.to_world(marker.header.frame_id) @ pose).T)[:, :3]


def homogeneous(
    at: tuple[float, float, float], q: tuple[float, float, float, float]
) -> FloatArray:
    """Matrix, shape (4, 4), of a translation and a unit quaternion (x, y, z, w)."""
    x, y, z, w = q
    assert abs(np.linalg.norm(q) - 1.0) < 1e-12
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, 3] = at
    return matrix
