"""Second derivatives of gaps by the configuration, in closed form.

Let d_a be the velocity of the vertex p relative to the touched edge's body when coordinate a of
the configuration grows, so that ∂g/∂z_a = Re(conj(n) d_a). The normal n turns with the edge, and
d_a = i s_a (p − c_a) for a coordinate that turns the two bodies by s_a relative to each other about
c_a, the object's centre or a joint's axis; of x and y it is constant:

    ∂²g/∂z_a ∂z_b = Re(conj(∂n/∂z_b) d_a + conj(n) i s_a (∂p/∂z_b − ∂c_a/∂z_b)).

The rows of the object's pose are those of `cfplan_core.contact.curvature`.
"""

from __future__ import annotations

import numpy as np

from cfplan_core.contact.system import ComplexArray, ContactSystem, IntArray, Placement
from cfplan_core.geometry.polygon import FloatArray


def gap_hessians(system: ContactSystem, placed: Placement, pairs: IntArray) -> FloatArray:
    """Differentiate gaps twice by the configuration.

    Args:
        system: Compiled problem.
        placed: From `ContactSystem.place`.
        pairs: Contacts, shape (k,).

    Returns:
        Shape (s, k, 3 + n, 3 + n), symmetric.
    """
    turns = np.zeros((len(system.body_names), system.dof))
    turns[0, 2] = 1.0
    turns[:, 3:] = system.moves
    shifts = np.zeros(turns.shape, dtype=complex)
    shifts[0, :2] = 1.0, 1j
    centers = np.zeros((len(placed.center), system.dof), dtype=complex)
    centers[:, 2] = placed.center
    centers[:, 3:] = placed.axes
    of_vertex = system.body_of[system.pair_vertex[pairs]]
    of_edge = system.body_of[system.pair_edge[pairs]]
    normal = placed.normals[:, system.pair_edge[pairs]]
    arms = 1j * (placed.vertices[:, system.pair_vertex[pairs], None] - centers[:, None])
    apart = turns[of_vertex] - turns[of_edge]
    slip = apart * arms + shifts[of_vertex] - shifts[of_edge]
    moved = turns[of_vertex] * arms + shifts[of_vertex]
    bend = moved[:, :, None] - _center_rates(system, centers)[:, None]
    bend = 1j * apart[:, :, None] * bend
    turned = slip[..., None] * (1j * turns[of_edge])[:, None].conj()
    return np.asarray((normal.conj()[..., None, None] * (turned + bend)).real)


def _center_rates(system: ContactSystem, centers: ComplexArray) -> ComplexArray:
    """How the centre that a coordinate turns about moves with another; shape (s, 3 + n, 3 + n)."""
    rates = np.zeros((*centers.shape, system.dof), dtype=complex)
    rates[:, 2, :2] = 1.0, 1j
    moves = system.moves
    carried = (moves[:, None] >= moves[:, :, None]).all(axis=0)
    axes = centers[:, 3:]
    rates[:, 3:, 3:] = 1j * carried * (axes[:, :, None] - axes[:, None])
    return rates
