"""Ways through a roadmap: motions inside pieces, one after the other, and what they cost."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cfplan_core.contact.formation import Formation
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.pieces import Piece
from cfplan_core.planning.search import Leg

Cost = tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Arc:
    """A motion inside a piece.

    Attributes:
        points: Shape (s, 3 + n).
        moves: False if nothing moves.
        length: Of the joints' path, rad.
    """

    points: FloatArray
    moves: bool
    length: float


@dataclass(frozen=True, eq=False)
class Label:
    """A way to a state.

    Attributes:
        piece: Where it is.
        entry: Configuration where the piece is entered, shape (3 + n,); for a label at the goal
            the goal.
        cost: Of the way, smaller is better, compared in lexical order.
        passed: Which required formations it passed.
        parent: The label before, None at the start.
        arc: The motion inside the parent's piece, None at the start.
        arrived: True at the goal.
    """

    piece: Piece
    entry: FloatArray
    cost: Cost
    passed: frozenset[int]
    parent: Label | None
    arc: Arc | None = None
    arrived: bool = False

    def chain(self) -> list[Label]:
        """Labels from the start to this one."""
        labels = [self]
        while labels[-1].parent is not None:
            labels.append(labels[-1].parent)
        return labels[::-1]

    def formations(self) -> tuple[Formation, ...]:
        """Contact formations in their order, without those passed in an instant."""
        found: list[Formation] = []
        for before, after in pairwise(self.chain()):
            moves = after.arc is not None and after.arc.moves
            if moves and before.piece.formation not in found[-1:]:
                found.append(before.piece.formation)
        return tuple(found)

    def path(self) -> tuple[list[Leg], list[Arc]]:
        """Motions from start to goal, as legs and as arcs; those of one point are left out.

        A way that does not move at all has one leg and no arcs.
        """
        chain = self.chain()
        legs: list[Leg] = []
        arcs: list[Arc] = []
        for before, after in pairwise(chain):
            piece, arc = before.piece, after.arc
            if arc is not None and arc.moves:
                legs.append(Leg(piece.index, piece.formation, piece.stability, arc.points))
                arcs.append(arc)
        if not legs:
            piece = chain[0].piece
            legs.append(Leg(piece.index, piece.formation, piece.stability, chain[0].entry[None]))
        return legs, arcs


def joint_length(points: FloatArray) -> float:
    """Length of the joints' path through configurations of shape (s, 3 + n), rad."""
    return float(np.linalg.norm(np.diff(points[:, 3:], axis=0), axis=1).sum())
