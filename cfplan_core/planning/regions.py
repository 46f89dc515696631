"""Contact formations of dimension two and more, explored along rays.

A region is entered from a curve by opening one of its contacts, or at a start or goal inside it.
From its anchor rays are followed, straight within the manifold, to the events that end them; each
leads to a neighbouring piece. Two entries belong to the same region if a straight path within the
formation joins their anchors. Rays see what can be seen from the anchors: exploration is complete
for points and curves, and only that far for regions.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, islice
from typing import TYPE_CHECKING

import numpy as np

from cfplan_core.contact.formation import Formation
from cfplan_core.contact.system import BoolArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import Stability
from cfplan_core.planning.events import OPEN_EVENTS, EventKind
from cfplan_core.planning.goal_drives import drives
from cfplan_core.planning.goal_region import GoalRegion
from cfplan_core.planning.manifold import (
    formation_equations,
    independent_rows,
    tangent_basis,
)
from cfplan_core.planning.pieces import SAME, Piece, Region
from cfplan_core.planning.stability_classes import split_by_class
from cfplan_core.planning.tracing import STABILITY_MARGIN, STEP, Trace, classify
from cfplan_core.planning.transitions import Departure, crossings

if TYPE_CHECKING:
    from cfplan_core.planning.roadmap import Roadmap

# Rays from an anchor: directions in the plane for dimension two, as many for each further one;
# and choices of joints to hold still.
_RAYS = 12
# How far, in radians and object sizes, an entry is followed to find an anchor.
_DEPTH = 0.4
# Anchors of one formation and class that no straight path joins: more are not kept apart.
_MOST_REGIONS = 6
_ARRIVED = 1e-9


class Regions:
    """Regions of a roadmap."""

    def __init__(self, roadmap: Roadmap) -> None:
        """Start empty."""
        self._roadmap = roadmap
        self._known: dict[tuple[Formation, Stability], list[Region]] = {}
        self._beyond: dict[int, list[tuple[FloatArray, Piece]]] = {}
        self._beside: dict[int, list[tuple[FloatArray, Piece]]] = {}
        self._losses: dict[int, list[FloatArray]] = {}

    def coverage(self) -> str:
        """Say how completely formations were explored."""
        regions = sum(piece.dimension > 1 for piece in self._roadmap.pieces)
        if not regions:
            return (
                f'{self._everything()} was explored: no region of dimension 2 or more, and '
                f'curves in steps of at most {STEP:g} rad and object sizes'
            )
        return (
            'contact formations of dimension 0 and 1 were searched completely, '
            f'{regions} regions of dimension 2 and more only along rays'
        )

    def _everything(self) -> str:
        """Say which stability everything that was explored has."""
        order = (
            'of first or second order' if self._roadmap.model.second_order else 'of first order'
        )
        return f'everything that can be reached with stability {order}'

    def around(self, formation: Formation, z: FloatArray) -> Region:
        """Return the region of a formation that a stable configuration lies inside."""
        return self._find(formation, z, z[None]) or self._make(formation, z, z[None])

    def beside(self, piece: Piece) -> list[tuple[FloatArray, Piece]]:
        """Regions that a piece borders on: those where one of its contacts opens."""
        if piece.index not in self._beside:
            self._beside[piece.index] = list(self._openings(piece))
        return self._beside[piece.index]

    def beyond(self, piece: Piece) -> list[tuple[FloatArray, Piece]]:
        """Pieces that rays from a region's anchor lead to, with where they enter them."""
        if piece.index not in self._beyond:
            assert isinstance(piece, Region)
            self._beyond[piece.index] = list(self._shoot(piece))
        return self._beyond[piece.index]

    def losses(self, region: Region) -> Iterator[FloatArray]:
        """Ways from a region's anchor to where stability ends, each (s, 3 + n); after `beyond`."""
        yield from self._losses.get(region.index, ())

    def drop(self, region: Region, z: FloatArray) -> None:
        """Forget that a region is entered or left at a configuration, shape (3 + n,)."""

        def apart(other: FloatArray) -> bool:
            return bool(np.abs(other - z).max() > SAME)

        region.links = [link for link in region.links if apart(link[0])]
        for table in (self._beyond, self._beside):
            for index, found in table.items():
                table[index] = [
                    (at, piece)
                    for at, piece in found
                    if apart(at) or (piece is not region and index != region.index)
                ]
        self._roadmap.settling.drop(region, z)

    def reach(
        self, region: Region, goal: GoalRegion, near: FloatArray | None
    ) -> Iterator[FloatArray]:
        """Configurations inside a region that have a goal's coordinates.

        Args:
            region: Of this roadmap, with the goal's contacts.
            goal: What is looked for.
            near: Where the region is entered, shape (3 + n,), to find what is near first; None
                to find what there is all over it.

        Yields:
            Shape (3 + n,), linked to the region's anchor.
        """
        for points in drives(self._roadmap.tracer, region, goal, near):
            region.links.append((points[-1], points))
            yield points[-1]

    def _openings(self, piece: Piece) -> Iterator[tuple[FloatArray, Piece]]:
        tracer = self._roadmap.tracer
        points = self._samples(piece)
        for pair in piece.formation.pairs:
            rest = Formation(tuple(p for p in piece.formation.pairs if p != pair))
            if len(rest) < 3:
                continue
            holds = tracer.margins(rest, points).stable > STABILITY_MARGIN
            # More than this formation touches, or links meet, at the ends.
            holds[0] = holds[-1] = False
            for place in self._places(holds):
                z = points[place]
                heading = self._opening(rest, pair, z)
                if heading is None:
                    continue
                region = self.enter(z, Departure(rest, heading, frozenset({pair})))
                if region is not None:
                    yield z, region

    def _samples(self, piece: Piece) -> FloatArray:
        """Points of a curve, shape (s, 3 + n), where contacts may open."""
        return piece.points

    def _places(self, holds: BoolArray) -> list[int]:
        """Indices of points at which to open a contact, where the rest holds the object."""
        return _middles(holds)

    def _opening(self, rest: Formation, pair: int, z: FloatArray) -> FloatArray | None:
        """Direction in which a gap opens fastest while the other contacts are kept."""
        pairs = np.array([*rest.pairs, pair], dtype=np.intp)
        gradients = self._roadmap.tracer.gradients(z[None], pairs)[0]
        rows = list(independent_rows(gradients[:-1]))
        basis = tangent_basis(gradients[rows])
        if len(basis) < 2:
            return None
        slope = basis @ gradients[-1]
        steepness = float(np.linalg.norm(slope))
        return None if steepness < STABILITY_MARGIN else slope @ basis / steepness

    def enter(self, z: FloatArray, way: Departure) -> Region | None:
        """Follow a heading into a region and return it; None if it ends at once."""
        trace = self._ray(z, way, _DEPTH)
        self._roadmap.attempts += 1
        if len(trace.points) < 3:
            self._roadmap.failures[f'at once, {trace.why}'] += 1
            return None
        points = split_by_class(self._roadmap.tracer, way.formation, trace.points)[0][1]
        return self._merge(way.formation, z, points[: len(points) // 2 + 1])

    def _merge(self, formation: Formation, z: FloatArray, inward: FloatArray) -> Region | None:
        """Find or make the region that points from z lead into; None if there are too many."""
        region = self._find(formation, z, inward)
        if region is None and len(self._like(formation, inward[-1])) >= _MOST_REGIONS:
            self._roadmap.failures['too many regions of one formation'] += 1
            return None
        return region or self._make(formation, z, inward)

    def _like(self, formation: Formation, z: FloatArray) -> list[Region]:
        """Known regions of a formation in the stability class of a configuration."""
        stability = classify(self._roadmap.tracer.margins(formation, z[None]))
        return self._known.setdefault((formation, stability), [])

    def _find(self, formation: Formation, z: FloatArray, inward: FloatArray) -> Region | None:
        """Find the known region that points from z lead into, and link z to it."""
        for region in self._like(formation, inward[-1]):
            joining = self._straight(formation, inward[-1], region.anchor)
            if joining is not None:
                region.links.append((z, np.concatenate([joining[::-1], inward[-2::-1]])))
                return region
        return None

    def _make(self, formation: Formation, z: FloatArray, inward: FloatArray) -> Region:
        """Make the region that points from z lead into; the last of them is its anchor."""
        roadmap = self._roadmap
        anchor = inward[-1]
        rows, _ = formation_equations(roadmap.system, formation.array, anchor)
        region = Region(
            len(roadmap.pieces),
            formation,
            classify(roadmap.tracer.margins(formation, anchor[None])),
            roadmap.system.dof - len(rows),
            anchor[None],
            (),
            [(z, inward[::-1])],
        )
        roadmap.pieces.append(region)
        self._like(formation, anchor).append(region)
        return region

    def _straight(
        self, formation: Formation, start: FloatArray, end: FloatArray
    ) -> FloatArray | None:
        """Points of the path from start to end projected onto the manifold, if it gets there."""

        def steer(z: FloatArray, basis: FloatArray) -> FloatArray | None:
            ahead = np.asarray(basis.T @ (basis @ (end - z)))
            return ahead if np.abs(ahead).max() > _ARRIVED else None

        if np.abs(end - start).max() <= _ARRIVED:
            return start[None]
        trace = self._roadmap.tracer.follow(
            formation, start, steer, longest=4.0 * float(np.abs(end - start).max())
        )
        if trace.kind is not EventKind.TARGET or np.abs(trace.end - end).max() > 1e-6:
            return None
        if len(split_by_class(self._roadmap.tracer, formation, trace.points)) > 1:
            return None
        return np.concatenate([trace.points[:-1], end[None]])

    def _ray(
        self,
        z: FloatArray,
        departure: Departure,
        longest: float,
        held: tuple[int, ...] = (),
    ) -> Trace:
        """Follow a heading, kept as straight as the manifold allows."""
        heading = departure.direction

        def steer(_: FloatArray, basis: FloatArray) -> FloatArray | None:
            nonlocal heading
            ahead = basis.T @ (basis @ heading)
            length = float(np.linalg.norm(ahead))
            if length < 0.1:
                return None
            heading = ahead / length
            return heading

        return self._roadmap.tracer.follow(
            departure.formation, z, steer, departure.departing, longest, held
        )

    def _shoot(self, region: Region) -> Iterator[tuple[FloatArray, Piece]]:
        roadmap = self._roadmap
        for heading, held in self._headings(region):
            roadmap.attempts += 1
            ray = Departure(region.formation, heading, frozenset())
            trace = self._ray(region.anchor, ray, np.pi, held)
            (_, points), *others = split_by_class(roadmap.tracer, region.formation, trace.points)
            end = points[-1]
            if np.abs(end - region.anchor).max() < SAME:
                roadmap.failures[f'at once, {trace.why}'] += 1
                continue
            if others:
                ways = [Departure(region.formation, _heading(points), frozenset())]
            elif trace.kind in OPEN_EVENTS:
                ways = self._ways(region, end, _heading(points))
            else:
                roadmap.failures[trace.why] += 1
                if trace.kind is EventKind.UNSTABLE:
                    self._losses.setdefault(region.index, []).append(points)
                continue
            region.links.append((end, points))
            if not others and self._joins(region, end):
                yield end, roadmap.root(end)
            for way in ways:
                entered = self.enter(end, way)
                if entered is not None and entered is not region:
                    yield end, entered

    def _headings(self, region: Region) -> Iterator[tuple[FloatArray, tuple[int, ...]]]:
        """Directions of a region's rays: all around, and those that move fewest joints.

        Each comes with the columns of z, joints, that are held still.
        """
        system = self._roadmap.system
        _, rows = formation_equations(system, region.formation.array, region.anchor)
        basis = tangent_basis(rows)
        for direction in _directions(len(basis)):
            yield direction @ basis, ()
        columns = range(3, system.dof)
        for held in islice(combinations(columns, len(basis) - 1), _RAYS):
            still = np.concatenate([rows, np.eye(system.dof)[list(held)]])
            if len(independent_rows(still)) == len(still):
                (tangent,) = tangent_basis(still)
                yield tangent, held
                yield -tangent, held

    def _joins(self, region: Region, z: FloatArray) -> bool:
        """Tell whether more contacts touch at an event, and hold the object there."""
        junction = self._roadmap.junction(z)
        stable = junction.stability is not Stability.UNSTABLE
        return stable and junction.formation != region.formation

    def _ways(self, region: Region, z: FloatArray, heading: FloatArray) -> list[Departure]:
        """Formations of fewer than all touching contacts that a ray of a region runs into."""
        roadmap = self._roadmap
        around = roadmap.junction(z).around
        if around is None or self._joins(region, z):
            return []
        refused = roadmap.failures.total()
        ways = crossings(around, roadmap.model, heading, roadmap.failures)
        roadmap.attempts += roadmap.failures.total() - refused
        return ways


def _middles(holds: BoolArray) -> list[int]:
    """Middle index of every run of true values."""
    bounds = np.flatnonzero(np.diff(np.concatenate([[0], holds.astype(int), [0]])))
    return [int(a + b - 1) // 2 for a, b in zip(bounds[::2], bounds[1::2], strict=True)]


def _heading(points: FloatArray) -> FloatArray:
    """Unit vector towards the last point from the last one that is not the same."""
    steps = points[-1] - points[:-1]
    length = np.linalg.norm(steps, axis=1)
    last = int(np.flatnonzero(length > SAME)[-1])
    return np.asarray(steps[last] / length[last])


def _directions(dimension: int) -> FloatArray:
    """Unit vectors spread over a sphere, shape (k, dimension); the same on every call."""
    if dimension == 2:
        angles = np.arange(_RAYS) * (2.0 * np.pi / _RAYS)
        return np.stack([np.cos(angles), np.sin(angles)], axis=1)
    spread = np.random.default_rng(0).normal(size=(_RAYS * (dimension - 1), dimension))
    return np.asarray(spread / np.linalg.norm(spread, axis=1, keepdims=True))
