"""Which elemental contacts touch in a configuration, and how they coincide."""

from __future__ import annotations

import numpy as np

from cfplan_core.contact.gaps import gaps, wedge_lifts
from cfplan_core.contact.system import BoolArray, ContactSystem, IntArray
from cfplan_core.geometry.polygon import FloatArray

# Sine of the angle up to which a neighbouring edge may dip into the touched edge's body.
WEDGE_TOLERANCE = 1e-6
# Where edges run along each other for less than this, in sizes, rounding hides more than a dip.
_SHORTEST_OVERLAP = 0.02


def touching(system: ContactSystem, z: FloatArray, tolerance: float) -> IntArray:
    """Find the elemental contacts that touch.

    A vertex touches an edge if its gap is zero, it lies between the edge's ends, and both edges
    at the vertex point away from the touched edge; where they run along it, both ends of the
    common stretch may be off by the tolerance. Where a vertex lies on a vertex every contact that
    either body's motion could continue with is listed.

    Args:
        system: Compiled problem.
        z: Configuration, shape (3 + n,).
        tolerance: In units of the object's size.

    Returns:
        Pair indices in ascending order.
    """
    placed = system.place(z[None])
    everything = slice(0, system.contact_count)
    gap, offset = (values[0] for values in gaps(system, placed, everything))
    length = system.pair_length[everything]
    near = (np.abs(gap) <= tolerance) & (offset >= -tolerance) & (offset <= length + tolerance)
    candidates: IntArray = np.flatnonzero(near)
    vertex, along = system.pair_vertex[candidates], offset[candidates]
    behind, before = wedge_lifts(system, placed, candidates)
    # Bodies face each other: the edge behind the vertex runs back along the touched edge.
    behind_overlap = np.minimum(system.edge_length[vertex], along)
    before_overlap = np.minimum(
        system.edge_length[system.previous_vertex[vertex]], length[candidates] - along
    )
    free = _points_away(behind[0], behind_overlap, tolerance)
    free &= _points_away(before[0], before_overlap, tolerance)
    return np.asarray(candidates[free])


def _points_away(lift: FloatArray, overlap: FloatArray, tolerance: float) -> BoolArray:
    """Tell which edges do not dip into the touched edge along which they run for a length."""
    dip = 2.0 * tolerance / np.maximum(overlap, _SHORTEST_OVERLAP)
    return np.asarray(lift >= -np.maximum(dip, WEDGE_TOLERANCE))


def coincident(
    system: ContactSystem, z: FloatArray, pairs: IntArray, tolerance: float
) -> BoolArray:
    """Tell which contacts between the same two bodies lie at the same place.

    Args:
        system: Compiled problem.
        z: Configuration, shape (3 + n,).
        pairs: Shape (k,).
        tolerance: In units of the object's size.

    Returns:
        Shape (k, k), boolean; false on the diagonal.
    """
    points = system.place(z[None]).vertices[0, system.pair_vertex[pairs]]
    distance = np.abs(points[:, None] - points[None])
    same_body = system.pair_body[pairs][:, None] == system.pair_body[pairs][None]
    together: BoolArray = (distance <= tolerance) & same_body
    np.fill_diagonal(together, False)
    return together
