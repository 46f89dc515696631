"""The margin of the motions of a mesh, and what comes near on them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cfplan_core.contact.formation import Formation
from cfplan_core.contact.system import BoolArray, IntArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.mesh import Mesh, Motion
from cfplan_core.planning.near_misses import TOUCHING, distances
from cfplan_core.planning.robustness import (
    COMFORTABLE_CLEARANCE,
    Robustness,
    finer,
    steps_along,
)

# Motions that are measured at once.
_AT_ONCE = 4000


@dataclass(frozen=True, eq=False)
class Marks:
    """What a way of a given margin has to mind; sets of pairs are bits of an integer.

    Attributes:
        near: For each node the pairs that are nearer than the margin allows.
        passed: For each motion that is wide enough backwards, and for each that is so forwards,
            the pairs that are so anywhere on it, and those that touch anywhere on it.
    """

    near: list[int]
    passed: tuple[dict[Motion, tuple[int, int]], dict[Motion, tuple[int, int]]]

    def follow(self, node: int, other: int, motion: Motion, touched: int) -> int | None:
        """Follow a motion from one of its nodes to the other.

        Args:
            node: Where it begins.
            other: Where it ends.
            motion: Between them.
            touched: Pairs that are near at its beginning and have touched since they are.

        Returns:
            The same for its end; None if something would be missed by too little, or the motion
            is not wide enough.
        """
        found = self.passed[other == motion.second].get(motion)
        if found is None:
            return None
        near, touching = found
        touched |= touching
        ahead = self.near[other]
        # What is near only on the way, or at the beginning and no more, must have touched.
        return None if near & ~ahead & ~touched else touched & ahead


class MeshMargins:
    """Margins of all motions of a mesh.

    Attributes:
        widths: Smallest ratio but for the clearance on each motion backwards and forwards, shape
            (2, m).
    """

    def __init__(
        self,
        mesh: Mesh,
        robustness: Robustness,
        expanded: Callable[[FloatArray], FloatArray],
        checkpoint: Callable[[], None] = lambda: None,
    ) -> None:
        """Measure.

        Args:
            mesh: What can be reached.
            robustness: The measure.
            expanded: Turns configurations of the mesh, shape (s, d), into those with all joints.
            checkpoint: Called now and then; may raise to interrupt.
        """
        system = robustness.system
        self._motions = mesh.motions
        count = len(mesh.motions)
        self.widths = np.full((2, count), np.inf)
        self._nearest = np.empty((count, len(system.pair_edge)), dtype=np.float32)
        self._touches = np.empty(self._nearest.shape, dtype=bool)
        self._at_nodes = distances(system, expanded(np.array(mesh.z)))[0]
        alike: dict[Formation | None, list[int]] = defaultdict(list)
        for index, motion in enumerate(mesh.motions):
            alike[motion.piece.formation if motion.piece is not None else None].append(index)
        for formation, members in alike.items():
            for first in range(0, len(members), _AT_ONCE):
                checkpoint()
                some = members[first : first + _AT_ONCE]
                parts = [mesh.motions[k].points for k in some]
                if formation is not None:
                    inner = [finer(part) for part in parts]
                    points = expanded(np.concatenate(inner))
                    steps = np.concatenate([steps_along(expanded(part)) for part in inner])
                    widths = robustness.widths(formation, points, steps)
                    self.widths[:, some] = np.minimum.reduceat(widths, _begins(inner), axis=1)
                points, begins = expanded(np.concatenate(parts)), _begins(parts)
                distance, passing = distances(system, points)
                self._touches[some] = np.logical_or.reduceat(distance < TOUCHING, begins, axis=0)
                passing[begins[1:] - 1] = np.inf
                distance[:-1] = np.minimum(distance[:-1], passing)
                self._nearest[some] = np.minimum.reduceat(distance, begins, axis=0)

    def marks(self, floor: float) -> Marks:
        """Say what a way of a margin of at least the floor has to mind."""
        near = min(floor, 1.0) * COMFORTABLE_CLEARANCE
        wide = self.widths >= floor
        some = np.flatnonzero(wide.any(axis=0))
        passing = _bits(self._nearest[some] < near)
        touching = _bits(self._touches[some])
        backwards, forwards = (
            {
                self._motions[k]: (passing[n], touching[n])
                for n, k in enumerate(some.tolist())
                if way[k]
            }
            for way in wide
        )
        return Marks(_bits(self._at_nodes < near), (backwards, forwards))


def _begins(parts: Sequence[FloatArray]) -> IntArray:
    """Where parts begin when they are put together, shape (m,)."""
    return np.cumsum([0, *(len(part) for part in parts[:-1])])


def _bits(sets: BoolArray) -> list[int]:
    """Rows of shape (s, p) as integers whose bits they are."""
    return [int.from_bytes(row.tobytes(), 'big') for row in np.packbits(sets, axis=1)]
