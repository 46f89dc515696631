"""Configurations that a search of many joints has reached, and the motions between them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from cfplan_core.contact.formation import Formation
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import Stability
from cfplan_core.planning.pieces import Region
from cfplan_core.planning.transitions import Surroundings


@dataclass(frozen=True, eq=False)
class Stretch:
    """A motion inside one contact formation and stability class.

    Attributes:
        formation: The contacts.
        stability: The class.
        points: Shape (s, 3 + n), s > 1.
        region: Connected piece of the formation that it is known to lie in.
    """

    formation: Formation
    stability: Stability
    points: FloatArray
    region: Region


@dataclass(eq=False)
class Milestone:
    """A configuration that a tree has reached.

    Attributes:
        z: Shape (3 + n,).
        around: What touches.
        parent: The milestone that it was reached from, None for a root.
        stretches: The motion from there.
        entered: Regions that are known to border on it or to contain it.
        tries: How often the tree was extended from here.
    """

    z: FloatArray
    around: Surroundings
    parent: Milestone | None
    stretches: tuple[Stretch, ...]
    entered: list[Region] = field(default_factory=list)
    tries: int = 0


@dataclass(eq=False)
class Growth:
    """A tree of milestones.

    Attributes:
        milestones: Parents before children.
        by_bodies: Indices of milestones by the bodies of the hand that touch.
    """

    milestones: list[Milestone] = field(default_factory=list)
    by_bodies: dict[tuple[int, ...], list[int]] = field(default_factory=dict)
    _table: FloatArray = field(default_factory=lambda: np.empty((0, 0)))

    def add(self, milestone: Milestone, bodies: tuple[int, ...]) -> None:
        """Add a milestone in which some bodies of the hand touch the object."""
        self.by_bodies.setdefault(bodies, []).append(len(self.milestones))
        count = len(self.milestones)
        if count == len(self._table):
            table = np.empty((2 * count + 64, len(milestone.z)))
            table[:count] = self._table[:count] if count else 0.0
            self._table = table
        self._table[count] = milestone.z
        self.milestones.append(milestone)

    @property
    def table(self) -> FloatArray:
        """Configurations of the milestones, shape (m, 3 + n)."""
        return np.asarray(self._table[: len(self.milestones)])

    @staticmethod
    def chain(milestone: Milestone) -> list[Milestone]:
        """Milestones from the root to one of them."""
        chain = []
        at: Milestone | None = milestone
        while at is not None:
            chain.append(at)
            at = at.parent
        return chain[::-1]
