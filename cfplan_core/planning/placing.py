"""Choose a new contact for a link that does not touch: which gap is worth driving to zero."""

from __future__ import annotations

import numpy as np

from cfplan_core.contact.gaps import gaps
from cfplan_core.contact.system import BoolArray, ContactSystem
from cfplan_core.planning.drives import ToContact, held_still
from cfplan_core.planning.milestones import Milestone

_FARTHEST = 2.5


def placements(
    system: ContactSystem, milestone: Milestone, rng: np.random.Generator
) -> ToContact | None:
    """Draw a gap of a link that does not touch, the nearer the likelier, and a place on its edge.

    Args:
        system: Compiled problem.
        milestone: Where.
        rng: To draw from.

    Returns:
        A drive that closes it with the other joints and the object at rest; None if no link is
        free.
    """
    count = system.contact_count
    body = system.pair_body[:count]
    free: BoolArray = np.asarray(system.moves.any(axis=1))
    free[body[milestone.around.pairs]] = False
    gap, offset = (v[0] for v in gaps(system, system.place(milestone.z[None]), slice(0, count)))
    length = system.pair_length[:count]
    place = np.clip(offset, 0.05 * length, 0.95 * length)
    distance = np.hypot(gap, offset - place)
    worth = free[body] & (gap > 0.0) & (distance < _FARTHEST)
    pairs = np.flatnonzero(worth)
    if not len(pairs):
        return None
    links = np.unique(body[pairs])
    link = int(links[int(rng.integers(len(links)))])
    pairs = pairs[body[pairs] == link]
    pairs = pairs[np.argsort(distance[pairs], kind='stable')]
    pair = int(pairs[min(int(rng.exponential(1.5)), len(pairs) - 1)])
    at = (
        float(place[pair]) if rng.random() < 0.4 else float(length[pair] * rng.uniform(0.05, 0.95))
    )
    moving = 3 + np.flatnonzero(system.moves[link])
    return ToContact(system, pair, at, held_still(system, moving), frozenset({pair}))
