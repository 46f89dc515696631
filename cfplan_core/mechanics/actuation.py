"""How actuators can hold stretches of motion: torques, and the joints to be given them.

Four contacts leave one force to be chosen: those torques that tolerate the largest errors
(`cfplan_core.mechanics.tolerant_torques`). More contacts leave more, and the forces are the middle
of all equilibria (`cfplan_core.mechanics.central_forces`); fewer leave none.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cfplan_core.contact.disturbance import Disturbance
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.central_forces import central_forces, force_caps
from cfplan_core.mechanics.contact_model import Actuation, Holding
from cfplan_core.mechanics.control_roles import control_roles
from cfplan_core.mechanics.tolerant_torques import most_tolerant

# So many joints, of those whose torque may be off by most, are compared in earnest.
_CANDIDATES = 3


def actuations(
    stretches: Sequence[Holding], load: FloatArray, squeeze: float
) -> tuple[tuple[Actuation, ...], ...]:
    """Find ways to hold stretches, each inside one contact formation.

    Args:
        stretches: In any order.
        load: Shape (3,), f; its length is the unit of force.
        squeeze: Largest contact force wanted, in units of the load; more where `HEADROOM` times
            the needed force is more.

    Returns:
        For each stretch at least one way, the best first.
    """
    ways: dict[int, tuple[Actuation, ...]] = {}
    for count in {stretch.gradients.shape[1] for stretch in stretches}:
        alike = [k for k, stretch in enumerate(stretches) if stretch.gradients.shape[1] == count]
        # Calls cost more than what they compute.
        together = _joined([stretches[k] for k in alike])
        ends = np.cumsum([len(stretches[k].gradients) for k in alike]).tolist()
        rows = [
            slice(end - len(stretches[k].gradients), end)
            for k, end in zip(alike, ends, strict=True)
        ]
        held = _central(together, rows, load, squeeze)
        if count == 4:
            held = _tolerant(together, rows, held, load, squeeze)
        ways.update(zip(alike, held, strict=True))
    return tuple(ways[k] for k in range(len(stretches)))


def _joined(stretches: Sequence[Holding]) -> Holding:
    """Put stretches of as many contacts one behind the other."""
    gradients, disturbances, lower, upper = zip(*stretches, strict=True)
    return Holding(
        np.concatenate(gradients),
        Disturbance(*(np.concatenate(parts) for parts in zip(*disturbances, strict=True))),
        np.concatenate(lower),
        np.concatenate(upper),
    )


def _central(
    together: Holding, rows: Sequence[slice], load: FloatArray, squeeze: float
) -> list[tuple[Actuation, ...]]:
    """Ways to supply the middle of all equilibria."""
    w, arms = together.gradients[..., :3], -together.gradients[..., 3:]
    forces = central_forces(w, arms, load, (together.lower, together.upper), squeeze)
    torques = np.einsum('sk,skn->sn', forces, arms)
    return [
        tuple(
            Actuation(roles.effort, np.asarray(torques[own]), roles.margin)
            for roles in control_roles(w[own], arms[own], forces[own])
        )
        for own in rows
    ]


def _tolerant(
    together: Holding,
    rows: Sequence[slice],
    held: Sequence[tuple[Actuation, ...]],
    load: FloatArray,
    squeeze: float,
) -> list[tuple[Actuation, ...]]:
    """Ways to hold four contacts as tolerantly as can be, or `held` where that is not at all."""
    arms = -together.gradients[..., 3:]
    cap = force_caps(together.gradients[..., :3], load, squeeze)
    wanted = [
        [way.effort[0] for way in ways[:_CANDIDATES] if len(way.effort) == 1] for ways in held
    ]
    found: list[list[Actuation]] = [[] for _ in rows]
    for joint in sorted({joint for joints in wanted for joint in joints}):
        limits = together.lower, together.upper
        forces, tolerance = most_tolerant(
            together.gradients, together.disturbance, joint, load, limits, cap
        )
        torques = np.einsum('sk,skn->sn', np.maximum(forces, 0.0), arms)
        for k, own in enumerate(rows):
            # At the ends of a stretch contacts are made and lost.
            inside = tolerance[own][1:-1] if own.stop - own.start > 2 else tolerance[own]
            if joint in wanted[k]:
                supplied = np.where(np.isnan(torques[own]), held[k][0].torques, torques[own])
                found[k].append(Actuation((joint,), supplied, float(inside.min())))
    best = [sorted(ways, key=lambda way: -way.margin) for ways in found]
    return [
        tuple(ways) if ways and ways[0].margin > 0.0 else before
        for ways, before in zip(best, held, strict=True)
    ]
