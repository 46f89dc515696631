"""A contact formation at a configuration: which pairs touch, and what that leaves free."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cfplan_core.contact.system import IntArray


@dataclass(frozen=True, order=True)
class Formation:
    """A set of elemental contacts.

    Attributes:
        pairs: Pair indices of a `ContactSystem`, ascending.
    """

    pairs: tuple[int, ...]

    @property
    def array(self) -> IntArray:
        """The pairs as an index array, shape (k,)."""
        return np.array(self.pairs, dtype=np.intp)

    def __len__(self) -> int:
        return len(self.pairs)

    def __contains__(self, pair: object) -> bool:
        return pair in self.pairs
