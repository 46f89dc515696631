"""How contacts change when hand, object and friction are not what was planned.

To first order, for errors of a typical size each. A contact's gap gradient, (wᵀ, jᵀ), changes

- if the edge turns by α about the contact: by α times the gradient of the offset along the edge;
- if the vertex is d farther along the edge: its moments change by −d;
- if a gap is off by g, or a joint by θ: object and free joints follow, and the gradients with them
  as the gaps' second derivatives say;
- if there is friction μ: the force leans against the sliding of the vertex, which is an edge
  turned by −μ times the sign of that sliding. It only ever leans that way.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cfplan_core.contact.curvature import gap_hessians
from cfplan_core.contact.gaps import offset_gradients
from cfplan_core.contact.system import ContactSystem, IntArray
from cfplan_core.geometry.polygon import FloatArray

GEOMETRY = 0.01
"""Error of each coordinate of a vertex, in sizes of the object."""
JOINT = math.radians(0.5)
"""Error of a joint's zero, rad."""
MASS = 0.2
"""Error of the object's mass, as a part of it."""
FRICTION = 0.15
"""Coefficient of friction that is not planned for."""
TORQUE = 0.02
"""Error of a torque, in weights times sizes of the object."""

# Sliding slower than this part of the path's speed is not trusted to have a direction.
_SLIDING = 0.05


class Disturbance(NamedTuple):
    """What typical errors do to the k contacts of a stretch of s configurations.

    Attributes:
        turned: Shape (s, k, 3 + n), change of each gap gradient by an error of its edge's angle.
        shifted: Shape (s, k, 3 + n), by an error of its vertex along the edge.
        hessians: Shape (s, k, 3 + n, 3 + n), of the gaps.
        leaning: Shape (s, k, 3 + n), change by friction, in the one direction that it has.
    """

    turned: FloatArray
    shifted: FloatArray
    hessians: FloatArray
    leaning: FloatArray


def disturbance(system: ContactSystem, z: FloatArray, pairs: IntArray) -> Disturbance:
    """Differentiate the contacts of a stretch by what may be wrong with them.

    Args:
        system: Compiled problem, with all joints.
        z: Shape (s, 3 + n), configurations in the order in which they are passed.
        pairs: Contacts that are kept, shape (k,).
    """
    placed = system.place(z)
    along = offset_gradients(system, placed, pairs)
    # Either end of the edge may be off.
    angles = 2.0 * GEOMETRY / system.pair_length[pairs]
    shifts = np.zeros((len(pairs), system.dof))
    shifts[:, 2] = -GEOMETRY * system.pair_object_sign[pairs]
    shifts[:, 3:] = -GEOMETRY * system.pair_moves[pairs]
    velocity = np.gradient(z, axis=0) if len(z) > 1 else np.zeros_like(z)
    slide = np.einsum('skd,sd->sk', along, velocity)
    slow = _SLIDING * np.abs(velocity).max(axis=1)[:, None]
    against = -np.divide(slide, slow, out=np.zeros_like(slide), where=slow > 0.0).clip(-1.0, 1.0)
    return Disturbance(
        angles[:, None] * along,
        np.broadcast_to(shifts, along.shape),
        gap_hessians(system, placed, pairs),
        FRICTION * against[..., None] * along,
    )
