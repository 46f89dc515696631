"""The frictionless quasi-static model: contacts push along their normals, gravity loads.

Equilibrium: W c + f = 0, c ≥ 0; actuator torques τ = −Jᵀ c. Trinkle & Hunter (1991), Section 3;
the inequalities are those of Trinkle's quasi-static model of sliding contacts. The small linear
programs are solved by enumerating bases, all configurations at once.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cfplan_core.contact.system import BoolArray
from cfplan_core.errors import JammedError
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.actuation import actuations
from cfplan_core.mechanics.bases import cross, dot, subsets
from cfplan_core.mechanics.closure import span_margin, span_margins
from cfplan_core.mechanics.contact_model import Actuation, Holding, Margins, Motion
from cfplan_core.mechanics.needed_force import needed_forces
from cfplan_core.mechanics.second_order import pair_forces, second_order_margin

_SINGULAR = 1e-12
_NEGATIVE = 1e-9
_IMBALANCE = 1e-6
# Torques that are so far outside their limits are so for a linear program's tolerance, too.
_BEYOND = 1e-6


class FrictionlessModel:
    """Frictionless contacts of rigid bodies, slow motion.

    Attributes:
        load: Shape (3,), gravity's wrench on the object, without units; zero if there is none.
        second_order: Whether stability of second order counts.
    """

    reversible = True

    def __init__(self, load: FloatArray, second_order: bool = True) -> None:
        """Create the model for one direction of gravity (see `ContactSystem.load`)."""
        self.load = load
        self.second_order = second_order

    def margins(self, gradients: FloatArray) -> Margins:
        """Judge stability: the columns of W and f, or of W alone, positively span R³."""
        vectors = np.empty((len(gradients), gradients.shape[1] + 1, 3))
        vectors[:, :-1] = gradients[..., :3]
        vectors[:, -1] = self.load
        stable, form_closure, signs = span_margins(vectors)
        # Both are positive in form closure, but the load may make the margin smaller.
        return Margins(np.maximum(stable, form_closure), form_closure, signs)

    def second_order_margins(self, gradients: FloatArray, rates: FloatArray) -> Margins:
        """Judge two contacts by the energy's curvature (`second_order_margin`)."""
        nowhere = np.full(len(gradients), -1.0)
        stable = nowhere
        if self.second_order:
            stable = second_order_margin(gradients[..., :3], rates, self.load)
        return Margins(stable, nowhere, np.empty((len(gradients), 0), dtype=bool), True)

    def torque_limits(self, gradients: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Minimum and maximum of τ_j over {c ≥ 0, W c = −f}, over its vertices and rays."""
        w, j = gradients[..., :3], gradients[..., 3:]
        torques, feasible = self._equilibria(w, j)
        lower = np.where(feasible[..., None], torques, np.inf).min(axis=1, initial=np.inf)
        upper = np.where(feasible[..., None], torques, -np.inf).max(axis=1, initial=-np.inf)
        self._open_unbounded(w, j, lower, upper)
        impossible = ~feasible.any(axis=1)
        lower[impossible] = upper[impossible] = np.nan
        return lower, upper

    def holds_within(
        self, gradients: FloatArray, lower: FloatArray, upper: FloatArray
    ) -> BoolArray:
        """Look for an equilibrium within torque limits: a vertex, else by linear programming.

        Where some joint's limits exclude all torques that it can have there is none.
        """
        w, j = gradients[..., :3], gradients[..., 3:]
        torques, feasible = self._equilibria(w, j)
        within = (torques >= lower[:, None]) & (torques <= upper[:, None])
        holds = np.asarray((feasible & within.all(axis=-1)).any(axis=1))
        if holds.all():
            return holds
        least, most = self.torque_limits(gradients)
        hopeless = ((least > upper + _BEYOND) | (most < lower - _BEYOND)).any(axis=1)
        for index in np.flatnonzero(~holds & ~hopeless):
            from scipy.optimize import linprog  # Costs half a second to import.

            limits = np.concatenate([upper[index], -lower[index]])
            bounded = np.isfinite(limits)
            found = linprog(
                np.zeros(w.shape[1]),
                A_ub=np.concatenate([-j[index].T, j[index].T])[bounded],
                b_ub=limits[bounded],
                A_eq=w[index].T,
                b_eq=-self.load,
            )
            holds[index] = found.status == 0
        return holds

    def actuations(
        self, stretches: Sequence[Holding], squeeze: float
    ) -> tuple[tuple[Actuation, ...], ...]:
        """Find the most tolerant torques of four contacts, else the middle of all equilibria."""
        return actuations(stretches, self.load, squeeze)

    def needed_forces(self, gradients: FloatArray) -> FloatArray:
        """Smallest possible largest contact force, in weights, of each configuration."""
        return needed_forces(gradients[..., :3], self.load)

    def _equilibria(self, w: FloatArray, j: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Torques at the basic solutions of W c = −f, and which of them have c ≥ 0.

        Args:
            w: Shape (s, k, 3).
            j: Shape (s, k, n).

        Returns:
            Shapes (s, b, n) and (s, b) for the b choices of three contacts; of two there is one.
        """
        if w.shape[1] == 2:
            pressing, rest = pair_forces(w, self.load)
            scale = 1.0 + np.abs(pressing).max(axis=1)
            holds = (rest <= _IMBALANCE * scale) & (pressing.min(axis=1) >= -_NEGATIVE * scale)
            return -np.einsum('sc,scn->sn', pressing, j)[:, None], holds[:, None]
        triples = subsets(w.shape[1], 3)
        a, b, c = (w[:, triples[:, i]] for i in range(3))
        bc, ca, ab = cross(b, c), cross(c, a), cross(a, b)
        determinant = dot(a, bc)
        regular = np.abs(determinant) > _SINGULAR
        safe = np.where(regular, determinant, 1.0)
        forces = -np.stack([bc @ self.load, ca @ self.load, ab @ self.load], axis=-1)
        forces = forces / safe[..., None]
        scale = 1.0 + np.abs(forces).max(axis=-1)
        feasible = regular & (forces.min(axis=-1) >= -_NEGATIVE * scale)
        return -np.einsum('stc,stcn->stn', forces, j[:, triples]), feasible

    @staticmethod
    def _open_unbounded(
        w: FloatArray, j: FloatArray, lower: FloatArray, upper: FloatArray
    ) -> None:
        """Replace limits by infinity along the rays of {c ≥ 0, W c = 0}."""
        quadruples = subsets(w.shape[1], 4)
        if not len(quadruples):
            return
        a, b, c, d = (w[:, quadruples[:, i]] for i in range(4))
        bc, cd = cross(b, c), cross(c, d)
        ad = cross(a, d)
        internal = np.stack([dot(b, cd), -dot(a, cd), -dot(ad, b), -dot(a, bc)], axis=-1)
        size = np.abs(internal).max(axis=-1, keepdims=True)
        internal = internal / np.maximum(size, _SINGULAR)
        internal = internal * np.where(internal.sum(axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
        ray = (size[..., 0] > _SINGULAR) & (internal.min(axis=-1) >= -_NEGATIVE)
        torques = -np.einsum('stc,stcn->stn', internal, j[:, quadruples])
        upper[(ray[..., None] & (torques > _NEGATIVE)).any(axis=1)] = np.inf
        lower[(ray[..., None] & (torques < -_NEGATIVE)).any(axis=1)] = -np.inf

    def motion(self, gradients: FloatArray, joint_velocity: FloatArray) -> Motion:
        """Minimise −fᵀ q̇ subject to Wᵀ q̇ + J θ̇ ≥ 0 over the vertices of the feasible set.

        Raises:
            JammedError: The set is empty, or the contacts do not restrain the object enough for it
                to have a vertex.
        """
        w, drive = gradients[:, :3], gradients[:, 3:] @ joint_velocity
        triples = subsets(len(w), 3)
        a, b, c = (w[triples[:, i]] for i in range(3))
        bc, ca, ab = cross(b, c), cross(c, a), cross(a, b)
        determinant = dot(a, bc)
        regular = np.abs(determinant) > _SINGULAR
        if not regular.any():
            raise JammedError(
                f'contacts of rank below 3 do not determine the motion ({len(w)} contacts)'
            )
        target = -drive[triples[regular]]
        velocity = (
            target[:, :1] * bc[regular]
            + target[:, 1:2] * ca[regular]
            + target[:, 2:] * ab[regular]
        ) / determinant[regular, None]
        rates = velocity @ w.T + drive
        tolerance = _NEGATIVE * (1.0 + np.abs(velocity).max(axis=1))
        feasible = rates.min(axis=1) >= -tolerance
        if not feasible.any():
            raise JammedError(
                f'no object velocity keeps all {len(w)} gaps open at joint velocity '
                f'{np.array2string(joint_velocity, precision=4)}: the grasp jams'
            )
        best = np.flatnonzero(feasible)[np.argmax(velocity[feasible] @ self.load)]
        kept = rates[best] <= tolerance[best]
        # Any other velocity as good differs by a direction that opens no kept gap below zero and
        # does not climb: there is none if and only if these wrenches and the load span.
        restraints = np.concatenate([w[kept], self.load[None]])
        return Motion(
            velocity[best],
            np.where(kept, 0.0, rates[best]),
            bool(span_margin(restraints[None])[0] > _NEGATIVE),
        )
