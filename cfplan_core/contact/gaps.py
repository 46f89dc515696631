"""Gaps of vertex-edge pairs and their exact derivatives.

For a vertex p of one body and an edge from a with outward unit normal n of another, the gap is
g = n·(p − a) and the offset along the edge o = u·(p − a) with u = n turned by 90°. As n, u and a
are fixed in the edge's body, the rates are exact also away from contact:

    ġ = n·(v_vertex(p) − v_edge(p)),     ȯ = u·(v_vertex(p) − v_edge(p)),

where v_b(p) is the velocity of body b's material point at p. For a contact between object and
hand this is ġ = wᵀ q̇ + jᵀ θ̇ with w = (n_x, n_y, r × n), n from hand into object.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cfplan_core.contact.system import ComplexArray, ContactSystem, IntArray, Placement
from cfplan_core.geometry.polygon import FloatArray


class Gaps(NamedTuple):
    """Gap and offset along the edge of m pairs in s configurations, each of shape (s, m)."""

    gap: FloatArray
    offset: FloatArray


def gaps(system: ContactSystem, placed: Placement, pairs: IntArray | slice) -> Gaps:
    """Evaluate gaps and offsets, in units of the object's size.

    Args:
        system: Compiled problem.
        placed: From `ContactSystem.place`.
        pairs: Which pairs: indices of shape (m,), or a slice.
    """
    vertices, edge = placed.vertices, system.pair_edge[pairs]
    apart = vertices.take(system.pair_vertex[pairs], axis=1) - vertices.take(edge, axis=1)
    local = placed.normals.take(edge, axis=1).conj() * apart
    return Gaps(local.real, local.imag)


def gap_gradients(system: ContactSystem, placed: Placement, pairs: IntArray) -> FloatArray:
    """Differentiate gaps by the configuration.

    Returns:
        Shape (s, m, 3 + n); for contacts the first three columns are wᵀ, the others jᵀ.
    """
    return _rates(system, placed, pairs, placed.normals.take(system.pair_edge[pairs], axis=1))


def offset_gradients(system: ContactSystem, placed: Placement, pairs: IntArray) -> FloatArray:
    """Differentiate offsets along the edges by the configuration; shape (s, m, 3 + n)."""
    return _rates(system, placed, pairs, 1j * placed.normals[:, system.pair_edge[pairs]])


def wedge_lifts(
    system: ContactSystem, placed: Placement, pairs: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Sines of the angles between a touched edge and the edges at the vertex that touches it.

    Returns:
        For the edge behind and the edge before the vertex, each of shape (s, m): positive where
        that edge leaves the touched one on its outside, zero where it lies flush.
    """
    vertex, edge = system.pair_vertex[pairs], system.pair_edge[pairs]
    # An edge with outward normal m runs along i m; its component along a normal n is n · i m.
    outward = placed.normals[:, edge].conj() * 1j
    behind = outward * placed.normals[:, vertex]
    before = outward * placed.normals[:, system.previous_vertex[vertex]]
    return behind.real, -before.real


def wedge_lift_gradients(
    system: ContactSystem, placed: Placement, pairs: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Differentiate `wedge_lifts` by the configuration; each of shape (s, m, 3 + n)."""
    vertex, edge = system.pair_vertex[pairs], system.pair_edge[pairs]
    turn = np.zeros((len(pairs), system.dof))
    turn[:, 2] = system.pair_object_sign[pairs]
    turn[:, 3:] = system.pair_moves[pairs]
    normal = placed.normals[:, edge].conj()
    behind = (normal * placed.normals[:, vertex]).real
    before = (normal * placed.normals[:, system.previous_vertex[vertex]]).real
    return -behind[..., None] * turn, before[..., None] * turn


def _rates(
    system: ContactSystem, placed: Placement, pairs: IntArray, direction: ComplexArray
) -> FloatArray:
    """Gradient of the relative displacement at each pair's vertex along given unit vectors."""
    point = placed.vertices.take(system.pair_vertex[pairs], axis=1)
    rows = np.empty((*direction.shape, system.dof))
    sign = system.pair_object_sign[pairs]
    rows[..., 0] = sign * direction.real
    rows[..., 1] = sign * direction.imag
    arm = point - placed.center[:, None]
    rows[..., 2] = sign * (arm.conj() * direction).imag
    reach = point[:, :, None] - placed.axes[:, None, :]
    rows[..., 3:] = system.pair_moves[pairs] * (reach.conj() * direction[..., None]).imag
    return rows
