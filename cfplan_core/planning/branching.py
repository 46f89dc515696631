"""Which contacts to keep and which to open where a drive leaves a configuration.

For every stable choice F of the touching contacts a drive is served by the displacement t that is
best among those with ∇g·t = 0 for F and ∇g·t > 0 for the others: the drive's projection onto the
cone of that choice. The choices are ordered by how much of the drive they serve.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from cfplan_core.contact.formation import Formation
from cfplan_core.contact.system import BoolArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.drives import Drive
from cfplan_core.planning.manifold import independent_rows, tangent_basis
from cfplan_core.planning.steering import Helm, displacement, gained
from cfplan_core.planning.tracing import STABILITY_MARGIN, Tracer
from cfplan_core.planning.transitions import Departure, Surroundings, departure_along

# Contacts that open do so by this much, in radians and object sizes, in the first displacement.
_OPENING = 0.004
# Of more touching contacts than this only so many are opened at once.
_MANY = 8
_MOST_OPENED = 4


@dataclass(frozen=True, eq=False)
class Branch:
    """A way out of a configuration along a drive.

    Attributes:
        departure: Contacts kept and direction.
        ahead: First displacement, shape (3 + n,).
        gain: How much of the drive it serves.
    """

    departure: Departure
    ahead: FloatArray
    gain: float


def branches(
    around: Surroundings,
    tracer: Tracer,
    helm: Helm,
    drive: Drive,
    keep_on_edges: bool,
    failures: Counter[str],
) -> list[Branch]:
    """Ways out of a configuration, the one that serves the drive best first."""
    found: dict[tuple[int, ...], Branch] = {}
    for kept in _stable_choices(around, tracer):
        tracer.checkpoint()
        branch = _branch(around, tracer, helm, drive, kept, keep_on_edges, failures)
        if branch is not None:
            key = branch.departure.formation.pairs
            if key not in found or branch.gain > found[key].gain:
                found[key] = branch
    return sorted(found.values(), key=lambda b: (-round(b.gain, 9), b.departure.formation))


def _stable_choices(around: Surroundings, tracer: Tracer) -> list[BoolArray]:
    """Choices of touching contacts that hold the object, none of them at another's place."""
    count = len(around.pairs)
    fewest = max(3, count - _MOST_OPENED) if count > _MANY else 3
    choices: list[BoolArray] = []
    for size in range(count, fewest - 1, -1):
        chosen = np.array(list(combinations(range(count), size)), dtype=np.intp)
        apart = np.array(
            [not around.together[np.ix_(row, row)].any() for row in chosen], dtype=bool
        )
        chosen = chosen[apart]
        if not len(chosen):
            continue
        stable = tracer.model.margins(around.gradients[chosen]).stable > STABILITY_MARGIN
        for row in chosen[stable]:
            kept = np.zeros(count, dtype=bool)
            kept[row] = True
            choices.append(kept)
    return choices


def _branch(
    around: Surroundings,
    tracer: Tracer,
    helm: Helm,
    drive: Drive,
    kept: BoolArray,
    keep_on_edges: bool,
    failures: Counter[str],
) -> Branch | None:
    gradients = around.gradients[kept]
    rows = gradients[list(independent_rows(gradients))]
    basis = tangent_basis(rows)
    if not len(basis):
        return None
    beside = around.together[:, kept].any(axis=1)
    opens = ~kept & ~beside
    inward = around.inward[kept & around.at_end]
    formation = Formation(tuple(int(pair) for pair in around.pairs[kept]))
    touching = frozenset(int(pair) for pair in around.pairs)
    limits = helm.limits(formation, drive, around.z, basis, keep_on_edges, touching).with_rows(
        np.concatenate([around.gradients[opens], inward]),
        np.full(int(opens.sum()) + len(inward), _OPENING),
    )
    ahead = displacement(drive, around.z, basis, limits)
    if ahead is None:
        return None
    length = float(np.linalg.norm(ahead))
    if length < 1e-9:
        return None
    way = departure_along(around, tracer.model, ahead / length, len(basis), failures)
    return None if way is None else Branch(way, ahead, gained(drive, around.z, ahead))
