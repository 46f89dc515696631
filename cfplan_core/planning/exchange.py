"""In which order fingers change their places: a search over where each of them is.

A finger's place is a posture with the contacts that it makes there. A combination of places is
admitted if no two fingers overlap; a finger may leave its place if the contacts of the palm and
of the other fingers hold the object meanwhile.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cfplan_core.contact.system import BoolArray
from cfplan_core.geometry.polygon import FloatArray

_MOST_EXPANDED = 1500

# Where each finger is: an index of its places.
State = tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Place:
    """A posture of a finger.

    Attributes:
        angles: Shape (j,), of the finger's joints.
        pairs: Contacts that it makes.
        gradients: Shape (k, 3 + n), of the gaps of these.
    """

    angles: FloatArray
    pairs: frozenset[int]
    gradients: FloatArray


class Exchange:
    """The search for one pose of the object.

    Attributes:
        blocked: Moves that turned out not to be possible: a state, a finger and its new place.
    """

    def __init__(
        self,
        places: Sequence[Sequence[Place]],
        palm: FloatArray,
        apart: Callable[[int, int], BoolArray],
        holds: Callable[[FloatArray], bool],
    ) -> None:
        """Prepare.

        Args:
            places: Of each finger; the last grasp has all of them at their place 1.
            palm: Gradients of the contacts with the palm, shape (k, 3 + n).
            apart: Gives for two fingers, the first one first in order, at which places, shape
                (p, q), they do not overlap.
            holds: Tells whether contacts with gradients (k, 3 + n) hold the object.
        """
        self._places = places
        self._palm = palm
        self._apart_of = apart
        self._holds = holds
        self._held: dict[State, bool] = {}
        self._apart: dict[tuple[int, int], BoolArray] = {}
        self.blocked: set[tuple[State, int, int]] = set()

    def moves(self, begin: State) -> list[tuple[int, int]] | None:
        """Fewest moves to the last grasp, each a finger and its new place; None if none are known.

        Moves can be undone: the search goes on from both ends, where there is less to look at.
        """
        ends = begin, (1,) * len(begin)
        if begin == ends[1]:
            return []
        before: list[dict[State, State | None]] = [{end: None} for end in ends]
        border = [[end] for end in ends]
        expanded = 0
        while all(border) and expanded < _MOST_EXPANDED:
            side = int(len(border[1]) < len(border[0]))
            grown = []
            for state in border[side]:
                expanded += 1
                for after in self._neighbours(state, side == 1):
                    if after in before[side]:
                        continue
                    before[side][after] = state
                    grown.append(after)
                    if after in before[1 - side]:
                        return _moves_of(
                            _chain(before[0], after)[::-1] + _chain(before[1], after)[1:]
                        )
            border[side] = grown
        return None

    def _neighbours(self, state: State, backwards: bool) -> Iterator[State]:
        """States that a move of one finger leads to, or backwards those that it leads from."""
        for finger, at in enumerate(state):
            held = self._holds_without(state, finger)
            own = self._places[finger]
            for place in np.flatnonzero(self._room(state, finger)).tolist():
                slides = bool(own[at].pairs) and own[at].pairs == own[place].pairs
                if place == at or not (held or slides):
                    continue
                after = (*state[:finger], place, *state[finger + 1 :])
                move = (after, finger, at) if backwards else (state, finger, place)
                if move not in self.blocked:
                    yield after

    def _room(self, state: State, finger: int) -> BoolArray:
        """At which places a finger does not overlap with the others, shape (p,)."""
        room = np.ones(len(self._places[finger]), dtype=bool)
        for other, at in enumerate(state):
            if other == finger:
                continue
            key = (min(finger, other), max(finger, other))
            if key not in self._apart:
                self._apart[key] = self._apart_of(*key)
            apart = self._apart[key]
            room &= apart[:, at] if finger < other else apart[at]
        return room

    def _holds_without(self, state: State, finger: int) -> bool:
        touching = [self._places[f][at].gradients for f, at in enumerate(state) if f != finger]
        key = tuple(
            at if f != finger and self._places[f][at].pairs else -1 for f, at in enumerate(state)
        )
        if key not in self._held:
            self._held[key] = self._holds(np.concatenate([self._palm, *touching]))
        return self._held[key]


def _chain(before: dict[State, State | None], state: State) -> list[State]:
    """States from one back to where its search began."""
    chain = [state]
    while (last := before[chain[-1]]) is not None:
        chain.append(last)
    return chain


def _moves_of(states: list[State]) -> list[tuple[int, int]]:
    """The finger that moves between successive states, and where to."""
    moves = []
    for one, other in pairwise(states):
        finger = next(f for f, (a, b) in enumerate(zip(one, other, strict=True)) if a != b)
        moves.append((finger, other[finger]))
    return moves
