"""From a configuration where contacts meet or part: which contact formations lead on.

At an event some set S of elemental contacts touches. A formation F ⊂ S leads away from there along
a direction t of its manifold if all other contacts of S open, g' = ∇g·t > 0, or, where two of them
lie at one place (a vertex on a vertex), if the kept one moves into its edge.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from cfplan_core.contact.detection import coincident, touching
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.gaps import gap_gradients, gaps, offset_gradients
from cfplan_core.contact.system import BoolArray, ContactSystem, IntArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import ContactModel
from cfplan_core.planning.manifold import RANK_TOLERANCE
from cfplan_core.planning.tracing import STABILITY_MARGIN

# Contacts are located to 1e-11: what is nearer than this touches.
TOUCH = 1e-8
_STILL = 1e-7
# Part of a heading that must lie in a formation's tangent space.
_OBLIQUE = 0.2


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
    around: Surroundings, model: ContactModel, failures: Counter[str]
) -> list[Departure]:
    """List the one-dimensional formations that lead out of a configuration.

    Args:
        around: From `surroundings`.
        model: Judges stability.
        failures: Counts why others do not.

    Returns:
        In the order of their contacts.
    """
    found = []
    for kept, basis in _stable_formations(around, model, failures, 1, 1):
        for tangent in (basis[0], -basis[0]):
            found += _departure(around, kept, tangent, failures)
    return found


def crossings(
    around: Surroundings, model: ContactModel, heading: FloatArray, failures: Counter[str]
) -> list[Departure]:
    """List the formations of dimension two and more that a heading leads into.

    Args:
        around: From `surroundings`.
        model: Judges stability.
        heading: Unit vector, shape (3 + n,); each formation is entered along its projection.
        failures: Counts why others are not entered.
    """
    found = []
    for kept, basis in _stable_formations(around, model, failures, 2, len(heading)):
        ahead = basis.T @ (basis @ heading)
        length = float(np.linalg.norm(ahead))
        if length > _OBLIQUE:
            found += _departure(around, kept, ahead / length, failures)
    return found


def _stable_formations(
    around: Surroundings, model: ContactModel, failures: Counter[str], least: int, most: int
) -> Iterator[tuple[list[int], FloatArray]]:
    """Stable subsets of the touching contacts of some dimensions, with tangent bases."""
    count, dof = around.gradients.shape
    for size in range(3, count + 1):
        subsets = np.array(list(combinations(range(count), size)), dtype=np.intp)
        if dof - size > most:
            continue
        gradients = around.gradients[subsets]
        _, singular, right = np.linalg.svd(gradients)
        dimension = dof - (singular > RANK_TOLERANCE).sum(axis=1)
        fits = (dimension >= least) & (dimension <= most)
        stable = np.asarray(model.margins(gradients).stable > STABILITY_MARGIN)
        failures['unstable contact formation'] += int((fits & ~stable).sum())
        for k in np.flatnonzero(fits & stable):
            yield [int(i) for i in subsets[k]], right[k, dof - dimension[k] :]


def _departure(
    around: Surroundings, kept: list[int], direction: FloatArray, failures: Counter[str]
) -> list[Departure]:
    """Return the departure along a direction of a formation, in a list, if it is possible."""
    inward = around.inward @ direction
    if any(around.at_end[i] and abs(inward[i]) < _STILL for i in kept):
        failures['a vertex would be held on a vertex'] += 1
        return []
    if any(inward[i] < 0.0 for i in kept):
        failures['a contact would leave its edge'] += 1
        return []
    opening = [
        i for i in range(len(around.pairs)) if i not in kept and not around.together[i, kept].any()
    ]
    rates = around.gradients[opening] @ direction
    if any(rate < -_STILL for rate in rates):
        failures['a contact would penetrate'] += 1
        return []
    # A gap that stays as it is closes nothing where the vertex slides off the end of the edge.
    if any(rate < _STILL and inward[i] > -_STILL for i, rate in zip(opening, rates, strict=True)):
        failures['a contact would stay'] += 1
        return []
    leaving = frozenset(
        int(around.pairs[i]) for i, rate in zip(opening, rates, strict=True) if rate >= _STILL
    )
    return [Departure(Formation(tuple(int(i) for i in around.pairs[kept])), direction, leaving)]
