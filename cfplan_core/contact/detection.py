"""Which elemental contacts touch in a configuration, and how they coincide."""

from __future__ import annotations

import numpy as np

from cfplan_core.contact.gaps import gaps, wedge_lifts
from cfplan_core.contact.system import BoolArray, ContactSystem, IntArray
from cfplan_core.geometry.polygon import FloatArray

# Sine of the angle up to which a neighbouring edge may dip into the touched edge's body.
WEDGE_TOLERANCE = 1e-6


def touching(system: ContactSystem, z: FloatArray, tolerance: float) -> IntArray:
    """Find the elemental contacts that touch.

    A vertex touches an edge if its gap is zero, it lies between the edge's ends, and both edges
    at the vertex point away from the touched edge. Where a vertex lies on a vertex every contact
    that either body's motion could continue with is listed.

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
    candidates = np.flatnonzero(near)
    behind, before = wedge_lifts(system, placed, candidates)
    return candidates[(np.minimum(behind, before) >= -WEDGE_TOLERANCE)[0]]


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
    together = (distance <= tolerance) & same_body
    np.fill_diagonal(together, False)
    return together
