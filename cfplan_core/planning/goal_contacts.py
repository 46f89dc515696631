"""Drives that make contacts which a goal names."""

from __future__ import annotations

import numpy as np

from cfplan_core.contact.gaps import gaps
from cfplan_core.contact.system import ContactSystem
from cfplan_core.planning.drives import ToContact, held_still
from cfplan_core.planning.goal_test import GoalTest
from cfplan_core.planning.milestones import Milestone

# How strongly coordinates stay where a contact is made by any of them.
_LOOSE = 0.3


def contact_drive(
    system: ContactSystem, test: GoalTest, milestone: Milestone, rng: np.random.Generator
) -> ToContact | None:
    """Draw a contact that a goal names and that is not made, and a place on its edge.

    Args:
        system: Compiled problem.
        test: The goal.
        milestone: Where.
        rng: To draw from.

    Returns:
        A drive that closes the gap, by the link's own joints or by all coordinates; None if the
        goal's contacts are all made.
    """
    missing = test.missing(milestone.around.pairs)
    if not missing:
        return None
    pair = missing[int(rng.integers(len(missing)))]
    placed = system.place(milestone.z[None])
    offset = float(gaps(system, placed, np.array([pair], dtype=np.intp)).offset[0, 0])
    length = float(system.pair_length[pair])
    nearest = float(np.clip(offset, 0.05 * length, 0.95 * length))
    at = nearest if rng.random() < 0.5 else length * float(rng.uniform(0.05, 0.95))
    moving = 3 + np.flatnonzero(system.moves[system.pair_body[pair]])
    alone = len(moving) > 0 and bool(rng.random() < 0.5)
    rest = held_still(system, moving) if alone else np.full(system.dof, _LOOSE)
    return ToContact(system, pair, at, rest, frozenset(missing))
