"""Drives: where a motion inside a contact formation is meant to go.

A drive turns a configuration z into rows R and values r of a linear least-squares problem for the
displacement t: |R t − r|² is least where the drive is content. What the manifold, limits, links
that are near and stability allow of it is the business of `cfplan_core.planning.steering`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from cfplan_core.contact.gaps import gap_gradients, gaps, offset_gradients
from cfplan_core.contact.system import ContactSystem, IntArray
from cfplan_core.geometry.polygon import FloatArray

# Weight of coordinates that shall stay as they are but may give way.
_REST = 0.05


class Drive(Protocol):
    """What a motion is meant to do."""

    @property
    def closing(self) -> frozenset[int] | None:
        """Contacts that may close on the way; None for any."""

    def task(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Rows, shape (m, 3 + n), and values, shape (m,), of a wanted displacement."""

    def remaining(self, z: FloatArray) -> float:
        """How far a configuration is from what is wanted, in radians and object sizes."""


@dataclass(frozen=True, eq=False)
class ToConfiguration:
    """Drive some coordinates towards given values, the others moving as little as possible.

    Attributes:
        wanted: Shape (3 + n,); only the weighted coordinates count.
        weights: Shape (3 + n,), how much each coordinate counts; 0 for those that are free.
        closing: See `Drive`.
    """

    wanted: FloatArray
    weights: FloatArray
    closing: frozenset[int] | None = None

    def task(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See `Drive`."""
        driven = self.weights > 0.0
        scale = np.where(driven, self.weights, _REST)
        return np.diag(scale), np.where(driven, self.weights * (self.wanted - z), 0.0)

    def remaining(self, z: FloatArray) -> float:
        """See `Drive`."""
        driven = self.weights > 0.0
        return float(np.linalg.norm((self.weights * (self.wanted - z))[driven]))


@dataclass(frozen=True, eq=False)
class ToContact:
    """Drive the gap of a pair to zero at a place along its edge, other coordinates at rest.

    Attributes:
        system: Compiled problem.
        pair: Index of the contact that is to be made.
        offset: Where along the edge, in object sizes.
        rest: Shape (3 + n,), how strongly each coordinate is to stay.
        closing: See `Drive`.
    """

    system: ContactSystem
    pair: int
    offset: float
    rest: FloatArray
    closing: frozenset[int] | None = None
    _pairs: IntArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, '_pairs', np.array([self.pair], dtype=np.intp))

    def _off(self, z: FloatArray) -> FloatArray:
        gap, offset = gaps(self.system, self.system.place(z[None]), self._pairs)
        return np.array([-gap[0, 0], self.offset - offset[0, 0]])

    def task(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See `Drive`."""
        placed = self.system.place(z[None])
        rows = np.concatenate(
            [
                gap_gradients(self.system, placed, self._pairs)[0],
                offset_gradients(self.system, placed, self._pairs)[0],
            ]
        )
        # The vertex comes to stand before its place on the edge, then it approaches.
        off = self._off(z)
        return (
            np.concatenate([rows, np.diag(self.rest)]),
            np.concatenate([off, np.zeros(len(z))]),
        )

    def remaining(self, z: FloatArray) -> float:
        """See `Drive`."""
        return float(np.linalg.norm(self._off(z)))


def held_still(system: ContactSystem, moving: IntArray, strength: float = 20.0) -> FloatArray:
    """Weights, shape (3 + n,), that keep all coordinates but the moving columns at rest."""
    weights = np.full(system.dof, strength)
    weights[moving] = _REST
    return weights
