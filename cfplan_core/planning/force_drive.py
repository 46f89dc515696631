"""Drive a contact force to zero: to where the contact may be let go.

Three contacts have one equilibrium. More have many, in form closure without bound, but how hard a
contact presses *at least*,

    m_i = min { c_i : W c = −f, c ≥ 0 },

is one number in every class, the contact's force where that is unique, and m_i = 0 if and only if
the others can hold the object without it. So m_i is what is driven. It is attained at a basis T of
three contacts, c_T = −W_T⁻¹ f, whose derivative is

    ∂c_T = −W_T⁻¹ (∂W_T) c_T,

with ∂w for w = (n, r × n) from the turn of the edge's body, ∂n = i n, and the vertex's motion, ∂r.
Beyond m_i = 0 minus the stability margin of the other contacts takes its place, so that a drive to
a value below zero goes on until they hold the object with some reserve.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from cfplan_core.contact.formation import Formation
from cfplan_core.contact.gaps import gap_gradients
from cfplan_core.contact.system import ContactSystem, IntArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import ContactModel
from cfplan_core.planning.steering import COMFORT

_SINGULAR = 1e-9
_NEGATIVE = 1e-9
_REST = 0.05
_DIFFERENCE = 1e-6


def wrench_slopes(system: ContactSystem, z: FloatArray, pairs: IntArray) -> FloatArray:
    """Differentiate the contacts' wrench directions by the configuration.

    Args:
        system: Compiled problem.
        z: Shape (3 + n,).
        pairs: Contacts, shape (k,).

    Returns:
        Shape (k, 3, 3 + n).
    """
    placed = system.place(z[None])
    normal = placed.normals[0, system.pair_edge[pairs]]
    arm = placed.vertices[0, system.pair_vertex[pairs]] - placed.center[0]
    reach = placed.vertices[0, system.pair_vertex[pairs], None] - placed.axes[0]
    sign = system.pair_object_sign[pairs]
    on_object = sign > 0.0
    moves = system.moves[system.pair_body[pairs]]
    turn = np.zeros((len(pairs), system.dof))
    turn[~on_object, 2] = 1.0
    turn[on_object, 3:] = moves[on_object]
    shift = np.zeros((len(pairs), system.dof), dtype=complex)
    shift[on_object, 2] = 1j * arm[on_object]
    shift[~on_object, 0], shift[~on_object, 1] = -1.0, -1j
    shift[~on_object, 3:] = 1j * (moves * reach)[~on_object]
    bend = 1j * normal[:, None] * turn
    moment = (shift.conj() * normal[:, None] + arm.conj()[:, None] * bend).imag
    return np.asarray(sign[:, None, None] * np.stack([bend.real, bend.imag, moment], axis=1))


def least_force(
    wrenches: FloatArray, load: FloatArray, contact: int
) -> tuple[float, tuple[int, ...]]:
    """How hard a contact presses at least, and a basis of an equilibrium in which it does so.

    Args:
        wrenches: Shape (k, 3).
        load: Shape (3,).
        contact: Index of the contact.

    Returns:
        In weights, infinite without an equilibrium, and the three contacts that press there.
    """
    best: tuple[float, tuple[int, ...]] = (np.inf, ())
    for basis in combinations(range(len(wrenches)), 3):
        columns = wrenches[list(basis)].T
        if abs(float(np.linalg.det(columns))) < _SINGULAR:
            continue
        forces = np.linalg.solve(columns, -load)
        if forces.min() < -_NEGATIVE * (1.0 + float(np.abs(forces).max())):
            continue
        force = max(float(forces[basis.index(contact)]), 0.0) if contact in basis else 0.0
        if force < best[0]:
            best = force, basis
    return best


@dataclass(frozen=True, eq=False)
class ToForce:
    """Drive the least force of a contact to a value, coordinates moving as little as possible.

    Attributes:
        system: Compiled problem.
        model: Judges how the other contacts hold.
        load: Gravity's wrench, shape (3,).
        formation: All contacts.
        pair: The contact.
        wanted: In weights; below zero the stability margin of the others, with its sign changed.
        closing: See `cfplan_core.planning.drives.Drive`.
    """

    system: ContactSystem
    model: ContactModel
    load: FloatArray
    formation: Formation
    pair: int
    wanted: float = -COMFORT
    closing: frozenset[int] | None = frozenset()

    def value(self, z: FloatArray) -> tuple[float, FloatArray]:
        """The least force, or minus the margin of the others, and its gradient, (3 + n,)."""
        pairs = self.formation.array
        wrenches = gap_gradients(self.system, self.system.place(z[None]), pairs)[0, :, :3]
        contact = self.formation.pairs.index(self.pair)
        force, basis = least_force(wrenches, self.load, contact)
        if np.isfinite(force) and force > _NEGATIVE:
            columns = wrenches[list(basis)].T
            forces = np.linalg.solve(columns, -self.load)
            slopes = wrench_slopes(self.system, z, pairs[list(basis)])
            change = -np.linalg.solve(columns, np.einsum('kcd,k->cd', slopes, forces))
            return force, np.asarray(change[basis.index(contact)])
        others = pairs[pairs != self.pair]
        points = np.concatenate([z[None], z + _DIFFERENCE * np.eye(len(z))])
        gradients = gap_gradients(self.system, self.system.place(points), others)
        margins = self.model.margins(gradients).stable
        return -float(margins[0]), -(margins[1:] - margins[0]) / _DIFFERENCE

    def task(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See `cfplan_core.planning.drives.Drive`."""
        value, slope = self.value(z)
        rows = np.concatenate([slope[None], _REST * np.eye(len(z))])
        return rows, np.concatenate([[self.wanted - value], np.zeros(len(z))])

    def remaining(self, z: FloatArray) -> float:
        """See `cfplan_core.planning.drives.Drive`."""
        return max(0.0, self.value(z)[0] - self.wanted)
