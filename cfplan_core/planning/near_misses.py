"""Near misses: features of bodies that come near each other and part without having touched.

A contact that a plan makes or breaks comes near, too; it is none. Nor are features that are near
at the start or at the goal and part from there, or come nearest there: no plan can change that.
"""

from __future__ import annotations

import numpy as np

from cfplan_core.contact.gaps import gaps
from cfplan_core.contact.system import BoolArray, ComplexArray, ContactSystem
from cfplan_core.geometry.polygon import FloatArray

FAR = 10.0
"""Distance, in object sizes, that is given where nothing is near."""
# Behind an edge, between its ends, a vertex is on the other side of the body.
_BEHIND = 1e-6
# Contacts are closed to 1e-11, in frames read from a file nearly so.
TOUCHING = 1e-7
# A path of steps of at most 0.04 is that far from the straight one between its points.
_SAG = 1e-3


def near_misses(system: ContactSystem, z: FloatArray, near: float) -> FloatArray:
    """Measure how near features come that do not touch before they part.

    Between two points the distances are those of the straight path between them in the edge's
    frame: they are smallest where a vertex passes the end of an edge, mostly between points.

    Args:
        system: Compiled problem.
        z: Shape (s, 3 + n), in order.
        near: Features part when they are farther than this, in object sizes.

    Returns:
        Smallest distance at each point of features that are missed there, shape (s,); `FAR` where
        there are none.
    """
    distance, passing = distances(system, z)
    along = np.empty((2 * len(z) - 1, distance.shape[1]))
    along[::2], along[1::2] = distance, passing
    found = np.full(len(along), FAR)
    inside = along < near
    for pair in np.flatnonzero(inside.any(axis=0)):
        apart = along[:, pair]
        for first, end in _runs(inside[:, pair]):
            stretch = apart[first:end]
            if not _excused(stretch, first == 0, end == len(along)):
                found[first:end] = np.minimum(found[first:end], stretch)
    nearest = found[::2].copy()
    nearest[1:] = np.minimum(nearest[1:], found[1::2])
    return nearest


def distances(system: ContactSystem, z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distances of vertices from edges on the side where they could touch.

    Args:
        system: Compiled problem.
        z: Shape (s, 3 + n).

    Returns:
        At each of s points, shape (s, p), and smallest between successive ones, (s - 1, p).
    """
    gap, offset = gaps(system, system.place(z), slice(None))
    length = system.pair_length
    beyond = np.maximum(np.maximum(-offset, offset - length), 0.0)
    distance = np.hypot(gap, beyond)
    hidden = (gap < -_BEHIND) & (offset > _BEHIND) & (offset < length - _BEHIND)
    distance[hidden] = FAR
    place = offset + 1j * gap
    ends = np.minimum(_passing(place), _passing(place - length))
    ends[hidden[1:] | hidden[:-1]] = FAR
    return distance, np.minimum.reduce([ends, distance[1:], distance[:-1]])


def _runs(holds: BoolArray) -> list[tuple[int, int]]:
    """Beginnings and ends of the runs of true values."""
    bounds = np.flatnonzero(np.diff(np.concatenate([[0], holds.astype(int), [0]])))
    return [(int(first), int(end)) for first, end in bounds.reshape(-1, 2)]


def _excused(stretch: FloatArray, from_start: bool, to_end: bool) -> bool:
    """Tell whether features that are near along a stretch touch, or are nearest at its end."""
    least = float(stretch.min())
    ends = ([stretch[0]] if from_start else []) + ([stretch[-1]] if to_end else [])
    return least < TOUCHING or any(end <= least + _SAG for end in ends)


def _passing(place: ComplexArray) -> FloatArray:
    """Distances of straight paths between successive points from zero; shape (s - 1, m).

    Args:
        place: Shape (s, m).
    """
    step = np.diff(place, axis=0)
    along = -(place[:-1] * step.conj()).real / np.maximum(np.abs(step) ** 2, 1e-30)
    return np.asarray(np.abs(place[:-1] + np.clip(along, 0.0, 1.0) * step))
