"""Connect two configurations of one contact formation without leaving it.

First the straight line between them is projected onto the formation's manifold, stretch by
stretch, and followed by the tracer, which ends it where a contact is made, stability, a limit or
the way past another link is lost. Where that happens two trees of such motions grow from both
ends towards configurations drawn at random and towards each other: RRT-Connect (Kuffner & LaValle,
2000) with projection onto the manifold (Berenson et al., 2009).

A path that is found shows that both lie in one connected piece of the formation. That none is
found shows nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from cfplan_core.contact.formation import Formation
from cfplan_core.contact.gaps import gaps
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.pieces import SAME
from cfplan_core.planning.steering import COMFORT
from cfplan_core.planning.tracing import Tracer

_ARRIVED = 1e-9
# A motion ends where only so small a part of what is missing lies along the manifold.
_ACROSS = 0.01
# How far, in radians and object sizes, a tree grows towards a random configuration at once.
_REACH = 0.4
# A tree grows by no less than this, and keeps so far away from what ends a motion.
_LEAST = 0.02
# How far around both ends, and what is reached already, configurations are drawn.
_AROUND = 0.4
# Other contacts keep this distance, in object sizes.
_CLEARANCE = 1e-3


def projected_path(
    tracer: Tracer,
    formation: Formation,
    start: FloatArray,
    end: FloatArray,
    departing: frozenset[int] = frozenset(),
) -> FloatArray | None:
    """Follow the straight way in joints and pose, projected onto the formation's manifold.

    Args:
        tracer: Follows it.
        formation: The contacts that are kept.
        start: Shape (3 + n,), inside the formation or on its border.
        end: As start.
        departing: Other pairs that touch at the start and open.

    Returns:
        Points from start to end, shape (s, 3 + n); None if the way ends before.
    """
    apart = float(np.abs(end - start).max())
    if apart < SAME:
        return None
    trace = tracer.follow(formation, start, _straight(end), departing, longest=4.0 * apart)
    if np.abs(trace.end - end).max() > SAME or len(trace.points) < 2:
        return None
    return np.concatenate([trace.points[:-1], end[None]])


def connect(
    tracer: Tracer,
    formation: Formation,
    start: FloatArray,
    end: FloatArray,
    seed: int | Sequence[int] = 0,
    most: int = 60,
) -> FloatArray | None:
    """Look for a path between two configurations inside a formation.

    Args:
        tracer: Knows system, mechanics and bounds.
        formation: All that touches at both ends.
        start: Shape (3 + n,).
        end: Shape (3 + n,).
        seed: Of the generator that configurations are drawn from.
        most: Number of configurations drawn; 0 for the projected straight line alone.

    Returns:
        Points from start to end, shape (s, 3 + n), on the manifold, stable, within limits and
        bounds, other contacts apart; None if none was found.
    """
    if float(np.abs(end - start).max()) < SAME:
        return np.stack([start, end])
    straight = projected_path(tracer, formation, start, end)
    if straight is not None and _good(tracer, formation, straight) == len(straight):
        return straight
    rng = np.random.default_rng(seed)
    trees = (_Tree(start), _Tree(end))
    for turn in range(most):
        growing, other = trees[turn % 2], trees[1 - turn % 2]
        reached = np.concatenate([tree.table for tree in trees])
        low, high = reached.min(axis=0) - _AROUND, reached.max(axis=0) + _AROUND
        wanted = rng.uniform(low, high)
        new = growing.extend(tracer, formation, growing.nearest(wanted), wanted, _REACH)
        if new is None:
            continue
        target = growing.table[new]
        near = other.nearest(target)
        met = other.extend(tracer, formation, near, target, np.inf)
        if met is not None and np.abs(other.table[met] - target).max() < SAME:
            ways = (growing.way(new), other.way(met))
            before, after = ways if turn % 2 == 0 else ways[::-1]
            return np.concatenate([before, after[-2::-1]])
    return None


def _straight(end: FloatArray) -> Callable[[FloatArray, FloatArray], FloatArray | None]:
    """Steering along the projection of the straight line to a configuration."""

    def steer(z: FloatArray, basis: FloatArray) -> FloatArray | None:
        rest = end - z
        ahead = np.asarray(basis.T @ (basis @ rest))
        least = max(_ARRIVED, _ACROSS * float(np.abs(rest).max()))
        return ahead if float(np.abs(ahead).max()) > least else None

    return steer


class _Tree:
    """Configurations inside one formation that can be reached from the first."""

    def __init__(self, root: FloatArray) -> None:
        self._nodes = [root]
        self._parents: list[int] = [0]
        self._motions: list[FloatArray] = [root[None]]

    @property
    def table(self) -> FloatArray:
        """Shape (m, 3 + n)."""
        return np.array(self._nodes)

    def nearest(self, wanted: FloatArray) -> int:
        return int(np.argmin(np.linalg.norm(self.table - wanted, axis=1)))

    def extend(
        self,
        tracer: Tracer,
        formation: Formation,
        node: int,
        wanted: FloatArray,
        reach: float,
    ) -> int | None:
        """Grow from a node towards a configuration; returns the new node if it gets anywhere."""
        start = self._nodes[node]
        longest = min(reach, 4.0 * float(np.abs(wanted - start).max()))
        points = tracer.follow(formation, start, _straight(wanted), longest=longest).points
        if np.abs(points[-1] - wanted).max() < SAME:
            points = np.concatenate([points[:-1], wanted[None]])
        points = points[: _good(tracer, formation, points)]
        if not len(points) or np.abs(points[-1] - start).max() < _LEAST:
            arrived = len(points) > 1 and np.abs(points[-1] - wanted).max() < SAME
            if not arrived:
                return None
        self._nodes.append(points[-1])
        self._parents.append(node)
        self._motions.append(points)
        return len(self._nodes) - 1

    def way(self, node: int) -> FloatArray:
        """Points from the root to a node, shape (s, 3 + n)."""
        parts = []
        while node:
            parts.append(self._motions[node][1:])
            node = self._parents[node]
        return np.concatenate([self._nodes[0][None], *parts[::-1]])


def _good(tracer: Tracer, formation: Formation, points: FloatArray) -> int:
    """Number of points of a motion up to where another contact or a loss of stability is near."""
    system = tracer.system
    others = np.setdiff1d(np.arange(system.contact_count), formation.array)
    gap, offset = gaps(system, system.place(points), others)
    beyond = np.maximum(np.maximum(-offset, offset - system.pair_length[others]), 0.0)
    distance = np.hypot(gap, beyond).min(axis=1, initial=np.inf)
    margins = tracer.margins(formation, points).stable
    bad = distance < min(_CLEARANCE, 0.5 * float(distance[0]))
    bad |= margins < 0.5 * min(float(margins[0]), COMFORT)
    return int(np.argmax(bad)) if bad.any() else len(points)
