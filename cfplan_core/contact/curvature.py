"""How the gradients of gaps change with the configuration, in closed form.

The wrench direction w = (n_x, n_y, r × n) of a contact is the gradient of its gap by the object's
pose, so that its derivatives are the gap's second ones. With the normal n of the edge that is
touched, turning with the edge's body, and r = p − (x, y) from the centre of mass to the vertex:

    dn = ω_edge i n,    dw = (Re dn, Im dn, Im(conj(dr) n + conj(r) dn)).

For a vertex of the object on an edge of the hand that is ∂²g/∂φ² = −n·r and nothing else in the
pose; for a vertex of the hand on an edge of the object the angle also couples with x and y. The
derivatives by two joints follow alike, from the axes of the joints that lie between.
"""

from __future__ import annotations

import numpy as np

from cfplan_core.contact.system import ContactSystem, IntArray, Placement
from cfplan_core.geometry.polygon import FloatArray


def wrench_rates(system: ContactSystem, placed: Placement, pairs: IntArray) -> FloatArray:
    """Differentiate the wrench directions of contacts by the configuration.

    Args:
        system: Compiled problem.
        placed: From `ContactSystem.place`.
        pairs: Contacts, shape (k,).

    Returns:
        Shape (s, k, 3, 3 + n): row a is the gradient of component a of w.
    """
    sign = system.pair_object_sign[pairs]
    of_object = sign > 0.0
    normal = placed.normals[:, system.pair_edge[pairs]]
    point = placed.vertices[:, system.pair_vertex[pairs]]
    arm = point - placed.center[:, None]
    shape = (*normal.shape, system.dof)
    turn = np.zeros(shape, dtype=complex)
    shift = np.zeros(shape, dtype=complex)
    spin = 1j * normal
    # The object turns its edges, the joints those of the links.
    turn[..., 2] = np.where(of_object, 0.0, spin)
    shift[..., 0] = np.where(of_object, 0.0, -1.0)
    shift[..., 1] = np.where(of_object, 0.0, -1j)
    shift[..., 2] = np.where(of_object, 1j * arm, 0.0)
    moves = np.abs(system.pair_moves[pairs])
    turn[..., 3:] = moves * np.where(of_object, spin, 0.0)[..., None]
    reach = 1j * (point[:, :, None] - placed.axes[:, None, :])
    shift[..., 3:] = moves * np.where(of_object[:, None], 0.0, reach)
    rates = np.empty((*normal.shape, 3, system.dof))
    rates[..., 0, :] = turn.real
    rates[..., 1, :] = turn.imag
    rates[..., 2, :] = (shift.conj() * normal[..., None] + arm.conj()[..., None] * turn).imag
    return np.asarray(sign[:, None, None] * rates)


def gap_hessians(system: ContactSystem, placed: Placement, pairs: IntArray) -> FloatArray:
    """Differentiate gaps twice by the configuration.

    Args:
        system: Compiled problem, with all joints.
        placed: From `ContactSystem.place`.
        pairs: Contacts, shape (k,).

    Returns:
        Shape (s, k, 3 + n, 3 + n), symmetric.
    """
    rates = wrench_rates(system, placed, pairs)
    joints = system.joint_count
    hessians = np.empty((*rates.shape[:2], system.dof, system.dof))
    hessians[..., :3, :] = rates
    hessians[..., 3:, :3] = rates[..., 3:].swapaxes(-1, -2)
    of_object = system.pair_object_sign[pairs] > 0.0
    normal = placed.normals[:, system.pair_edge[pairs]]
    reach = placed.vertices[:, system.pair_vertex[pairs], None] - placed.axes[:, None]
    moves = system.pair_moves[pairs]
    # Joint l carries the axis of joint j along if j lies beyond it.
    carries = system.moves[-joints:] - np.eye(joints)
    carried = carries * (placed.axes[:, :, None] - placed.axes[:, None])
    vertex_moves = np.where(of_object[:, None], 0.0, np.abs(moves))
    turned = 1j * np.where(of_object[:, None], np.abs(moves), 0.0) * normal[..., None]
    shifted = 1j * (vertex_moves * reach)[:, :, None] - 1j * carried[:, None]
    change = (
        shifted.conj() * normal[..., None, None] + reach.conj()[..., None] * turned[:, :, None]
    )
    hessians[..., 3:, 3:] = moves[..., None] * change.imag
    return hessians
