"""From a configuration where contacts meet or part: which contact formations lead on.

At an event some set S of elemental contacts touches. A formation F ⊂ S leads away from there along
a direction t of its manifold if all other contacts of S open, g' = ∇g·t > 0, or, where two of them
lie at one place (a vertex on a vertex), if the kept one moves into its edge.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from cfplan_core.contact.detection import coincident, touching
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.gaps import gap_gradients, gaps, offset_gradients
from cfplan_core.contact.system import BoolArray, ContactSystem, IntArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import ContactModel
from cfplan_core.planning.manifold import RANK_TOLERANCE, independent_rows
from cfplan_core.planning.tracing import STABILITY_MARGIN

# Contacts are located to 1e-11: what is nearer than this touches.
TOUCH = 1e-8
_STILL = 1e-7


@dataclass(frozen=True, eq=False)
class Departure:
    """A way out of a configuration.

    Attributes:
        formation: Contacts that are kept.
        direction: Unit tangent of the formation's curve, shape (3 + n,).
        departing: Touching pairs that open; not those at the place of a kept contact.
    """

    formation: Formation
    direction: FloatArray
    departing: frozenset[int]


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What touches in a configuration.

    Attributes:
        z: Shape (3 + n,).
        pairs: Touching contacts, shape (k,).
        gradients: Shape (k, 3 + n), of their gaps.
        at_end: Shape (k,), true where the vertex lies on an end of the edge.
        inward: Shape (k, 3 + n): gradient of the offset for contacts at the beginning of their
            edge, its negative at the end, zero between.
        together: Shape (k, k), true for contacts of the same bodies at one place.
    """

    z: FloatArray
    pairs: IntArray
    gradients: FloatArray
    at_end: BoolArray
    inward: FloatArray
    together: BoolArray

    @property
    def held_vertex(self) -> bool:
        """True if a vertex lies on a vertex."""
        return bool(self.together.any())

    def keeps_vertex(self, pairs: tuple[int, ...]) -> bool:
        """True if two of some touching contacts lie at one place."""
        chosen = np.isin(self.pairs, pairs)
        return bool(self.together[np.ix_(chosen, chosen)].any())


def surroundings(system: ContactSystem, z: FloatArray) -> Surroundings:
    """Detect what touches at z, shape (3 + n,)."""
    pairs = touching(system, z, TOUCH)
    placed = system.place(z[None])
    offset = gaps(system, placed, pairs).offset[0]
    first = offset < TOUCH
    last = offset > system.pair_length[pairs] - TOUCH
    sign = first.astype(float) - last
    inward = offset_gradients(system, placed, pairs)[0] * sign[:, None]
    return Surroundings(
        z,
        pairs,
        gap_gradients(system, placed, pairs)[0],
        first | last,
        inward,
        coincident(system, z, pairs, TOUCH),
    )


def departures(
    around: Surroundings, model: ContactModel, dof: int, failures: Counter[str]
) -> list[Departure]:
    """List the one-dimensional formations that lead out of a configuration.

    Args:
        around: From `surroundings`.
        model: Judges stability.
        dof: 3 + n.
        failures: Counts why others do not.

    Returns:
        In the order of their contacts.
    """
    count = len(around.pairs)
    found = []
    for size in range(dof - 1, count + 1):
        subsets = [
            kept
            for kept in combinations(range(count), size)
            if not around.together[np.ix_(kept, kept)].any()
        ]
        if not subsets:
            continue
        gradients = around.gradients[np.array(subsets)]
        _, singular, right = np.linalg.svd(gradients)
        curves = (singular > RANK_TOLERANCE).sum(axis=1) == dof - 1
        stable = model.margins(gradients).stable > STABILITY_MARGIN
        failures['unstable contact formation'] += int((curves & ~stable).sum())
        for k in np.flatnonzero(curves & stable):
            found += _leaving(around, subsets[k], right[k, -1], failures)
    return found


def _leaving(
    around: Surroundings, kept: tuple[int, ...], tangent: FloatArray, failures: Counter[str]
) -> list[Departure]:
    """Directions along a formation's tangent in which it can be left for."""
    keep = list(kept)
    others = [i for i in range(len(around.pairs)) if i not in kept]
    opening = [i for i in others if not around.together[i, keep].any()]
    rates = around.gradients[opening] @ tangent
    still = [i for i, rate in zip(opening, rates, strict=True) if abs(rate) < _STILL]
    if still:
        rank = len(independent_rows(around.gradients[keep]))
        if len(independent_rows(around.gradients[[*keep, *still]])) == rank:
            # These contacts stay: the larger formation is the one that leads on.
            return []
    inward = around.inward[keep] @ tangent
    if (np.abs(inward[around.at_end[keep]]) < _STILL).any():
        failures['a vertex would be held on a vertex'] += 1
        return []
    pairs = tuple(int(around.pairs[i]) for i in keep)
    leaving = frozenset(int(around.pairs[i]) for i in opening)
    found = []
    for sign in (1.0, -1.0):
        if (sign * rates < -_STILL).any():
            failures['a contact would penetrate'] += 1
        elif (sign * inward < -_STILL).any():
            failures['a contact would leave its edge'] += 1
        else:
            found.append(Departure(Formation(pairs), sign * tangent, leaving))
    return found
