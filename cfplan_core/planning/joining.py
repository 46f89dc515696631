"""Join two trees inside a contact formation that both have come to.

Both trees may reach one formation without ever reaching one configuration. Then a path inside the
formation, from the middle of a motion of one tree to the middle of one of the other, joins them
(Trinkle & Hunter, 1991, Section 2.2: a common contact formation and a path inside it). It shows,
too, that what was taken for two pieces of the formation is one.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from cfplan_core.contact.formation import Formation
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.connecting import connect
from cfplan_core.planning.efforts import within_efforts
from cfplan_core.planning.milestones import Milestone, Stretch
from cfplan_core.planning.pieces import Region
from cfplan_core.planning.pushing import Classifier
from cfplan_core.planning.stability_classes import split_by_class
from cfplan_core.planning.tracing import Tracer

# Random trees inside a formation are grown at every so manieth straight line that ended before.
_PATIENCE = 8
_MOST_DRAWN = 20


class SamePieces:
    """Which regions are known to be one connected piece; others may be, too."""

    def __init__(self) -> None:
        """Nothing is known."""
        self._of: dict[int, Region] = {}

    def of(self, region: Region) -> Region:
        """The region that stands for all those known to be one with it."""
        while region.index in self._of:
            region = self._of[region.index]
        return region

    def unite(self, one: Region, other: Region) -> None:
        """Note that two regions are one; the one found first stands for both."""
        first, second = sorted((self.of(one), self.of(other)), key=lambda region: region.index)
        if first is not second:
            self._of[second.index] = first


class Joining:
    """Looks for paths between the motions of two trees.

    Attributes:
        same: What the paths found show of the regions.
    """

    def __init__(
        self, tracer: Tracer, region_of: Classifier, seed: int | Sequence[int] = 0
    ) -> None:
        """Prepare.

        Args:
            tracer: Follows motions.
            region_of: Names the connected piece that a motion lies in.
            seed: Of the generators that paths are drawn from.
        """
        self.same = SamePieces()
        self._tracer = tracer
        self._region_of = region_of
        self._seed = [seed] if isinstance(seed, int) else list(seed)
        self._known: tuple[dict[Formation, list[Milestone]], ...] = ({}, {})
        self._failed: Counter[Formation] = Counter()

    def add(self, side: int, milestone: Milestone) -> None:
        """Remember the motion that led a tree to a milestone."""
        formation = _inner_formation(milestone)
        if formation is not None:
            self._known[side].setdefault(formation, []).append(milestone)

    def join(self, side: int, new: Milestone) -> tuple[Milestone, Milestone] | None:
        """Look for a path from a new milestone's motion to one of the other tree.

        Args:
            side: Tree of the new milestone.
            new: Just reached.

        Returns:
            A milestone beside the new one, which is where one of the other tree is, and that
            one; None if no path was found.
        """
        formation = _inner_formation(new)
        others = self._known[1 - side].get(formation, []) if formation is not None else []
        if formation is None or not others:
            return None
        points = _motion(new)
        middle = len(points) // 2
        there = [_motion(other) for other in others]
        off = [float(np.abs(p[len(p) // 2] - points[middle]).max()) for p in there]
        nearest = int(np.argmin(off))
        other, rest = others[nearest], there[nearest]
        failed = self._failed[formation]
        drawn = _MOST_DRAWN if failed % _PATIENCE == _PATIENCE - 1 else 0
        path = connect(
            self._tracer,
            formation,
            points[middle],
            rest[len(rest) // 2],
            [*self._seed, failed],
            drawn,
        )
        if path is None or not self._strong(formation, path):
            self._failed[formation] += 1
            return None
        parts = split_by_class(self._tracer, formation, path)
        if len(parts) == 1:
            self.same.unite(_region_in_the_middle(new), _region_in_the_middle(other))
        way = np.concatenate([points[:middle], path, rest[len(rest) // 2 + 1 :]])
        stretches = []
        for stability, part in split_by_class(self._tracer, formation, way):
            known = [s.region for s in new.stretches] if len(parts) == 1 else []
            region = self._region_of(known, formation, stability)
            stretches.append(Stretch(formation, stability, part, region))
        return Milestone(other.z, other.around, new.parent, tuple(stretches)), other

    def _strong(self, formation: Formation, path: FloatArray) -> bool:
        return bool(within_efforts(self._tracer.system, self._tracer.model, formation, path).all())


def _inner_formation(milestone: Milestone) -> Formation | None:
    """Formation of the motion to a milestone, if that has a point inside."""
    if not milestone.stretches or len(_motion(milestone)) < 3:
        return None
    return milestone.stretches[0].formation


def _motion(milestone: Milestone) -> FloatArray:
    """All points of the motion to a milestone, shape (s, 3 + n)."""
    first, *more = milestone.stretches
    return np.concatenate([first.points, *(stretch.points[1:] for stretch in more)])


def _region_in_the_middle(milestone: Milestone) -> Region:
    """Region that the middle point of the motion to a milestone lies in."""
    left = len(_motion(milestone)) // 2
    for stretch in milestone.stretches[:-1]:
        if left < len(stretch.points):
            return stretch.region
        left -= len(stretch.points) - 1
    return milestone.stretches[-1].region
