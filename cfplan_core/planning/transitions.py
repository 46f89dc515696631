"""From a configuration where contacts meet or part: which contact formations lead on.

At an event some set S of elemental contacts touches. A formation F ⊂ S leads away from there along
a direction t of its manifold if all other contacts of S open, g' = ∇g·t > 0, or, where two of them
lie at one place (a vertex on a vertex), if the kept one moves into its edge.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
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
    dof = around.gradients.shape[1]
    directions = [t for basis in _tangents(around, dof - 1) for t in (basis[0], -basis[0])]
    return _distinct(_leave(around, model, t, 1, failures) for t in directions)


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
    dof = len(heading)
    found = []
    for size in range(3, dof - 1):
        for basis in _tangents(around, size):
            ahead = basis.T @ (basis @ heading)
            length = float(np.linalg.norm(ahead))
            if length > _OBLIQUE:
                found.append(_leave(around, model, ahead / length, dof - size, failures))
    return _distinct(found)


def departure_along(
    around: Surroundings,
    model: ContactModel,
    direction: FloatArray,
    dimension: int,
    failures: Counter[str],
) -> Departure | None:
    """Return the departure along a unit vector, shape (3 + n,), if there is one.

    The direction decides which contacts are kept; together they must leave this dimension free.
    """
    return _leave(around, model, direction, dimension, failures)


def _distinct(found: Iterable[Departure | None]) -> list[Departure]:
    """Departures that differ, ordered by their contacts, then as they were found."""
    kept: list[Departure] = []
    for way in found:
        if way is not None and not any(
            way.formation == other.formation
            and np.abs(way.direction - other.direction).max() < _STILL
            for other in kept
        ):
            kept.append(way)
    return sorted(kept, key=lambda way: way.formation)


def _tangents(around: Surroundings, size: int) -> list[FloatArray]:
    """Tangent bases of all independent choices of so many touching contacts; distinct if lines."""
    count, dof = around.gradients.shape
    if count < size:
        return []
    subsets = np.array(list(combinations(range(count), size)), dtype=np.intp)
    _, singular, right = np.linalg.svd(around.gradients[subsets])
    bases = right[singular[:, -1] > RANK_TOLERANCE][:, size:]
    if dof - size > 1 or not len(bases):
        return list(bases)
    largest = np.abs(bases[:, 0]).argmax(axis=1)
    sign = np.sign(bases[np.arange(len(bases)), 0, largest])
    _, first = np.unique(np.round(bases[:, 0] * sign[:, None], 6), axis=0, return_index=True)
    return [bases[k] for k in np.sort(first)]


def _leave(
    around: Surroundings,
    model: ContactModel,
    direction: FloatArray,
    dimension: int,
    failures: Counter[str],
) -> Departure | None:
    """Return the departure along a direction, if there is one.

    The direction decides which contacts are kept: those whose gap stays as it is and whose vertex
    does not slide off the end of its edge.
    """
    rates = around.gradients @ direction
    inward = around.inward @ direction
    still = np.abs(rates) < _STILL
    if (still & around.at_end & (np.abs(inward) < _STILL)).any():
        failures['a vertex would be held on a vertex'] += 1
        return None
    slides = inward < 0.0
    kept = still & ~slides
    beside = around.together[:, kept].any(axis=1)
    if (~kept & ~beside & (rates < -_STILL)).any():
        failures['a contact would penetrate'] += 1
        return None
    gradients = around.gradients[kept]
    if (still & slides).any() and (len(direction) - len(independent_rows(gradients)) != dimension):
        failures['a contact would leave its edge'] += 1
        return None
    if not model.margins(gradients[None]).stable[0] > STABILITY_MARGIN:
        failures['unstable contact formation'] += 1
        return None
    opening = ~kept & ~beside & (rates > _STILL)
    return Departure(
        Formation(tuple(int(pair) for pair in around.pairs[kept])),
        direction,
        frozenset(int(pair) for pair in around.pairs[opening]),
    )
