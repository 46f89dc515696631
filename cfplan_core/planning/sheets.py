"""Contact formations of dimension two of hands with two joints, explored completely.

Three independent contacts that hold the object fix its pose as a function of the joint angles:
such a formation is a sheet over the joint plane, bordered by curves where a fourth contact closes,
a vertex reaches the end of its edge, stability is lost, a joint is at its limit or links meet. A
sheet is filled over a grid of joint angles. What the grid steps meet on the border is found
exactly; what is smaller than the spacing may be missed: narrow necks, slivers, short borders.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from cfplan_core.contact.formation import Formation
from cfplan_core.contact.system import BoolArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.options import RESOLUTION
from cfplan_core.planning.equations import equation_gradients, formation_rows, is_second_order
from cfplan_core.planning.events import EventKind
from cfplan_core.planning.goal_region import GoalRegion
from cfplan_core.planning.joint_grid import JointGrid, Place
from cfplan_core.planning.manifold import formation_equations, independent_rows, project
from cfplan_core.planning.pieces import SAME, Piece, Region
from cfplan_core.planning.regions import Regions, _heading
from cfplan_core.planning.settling_steps import settling_steps
from cfplan_core.planning.sheet_crossing import step_across
from cfplan_core.planning.sheet_filling import Table, fill
from cfplan_core.planning.sheet_goals import goals_on_sheet
from cfplan_core.planning.sheet_graph import Border, Sheet
from cfplan_core.planning.sheet_steps import take_steps
from cfplan_core.planning.sheet_walks import towards, walk
from cfplan_core.planning.tracing import STEP, classify
from cfplan_core.planning.transitions import Departure

if TYPE_CHECKING:
    from cfplan_core.planning.roadmap import Roadmap

# Number of grids, each half as coarse as the one before.
_LEVELS = 4
# Distance of places where contact forces are let vanish on a border, by the grid's spacing.
_BORDER = 3.0


class Sheets(Regions):
    """Regions of a roadmap of a hand with two joints."""

    def __init__(self, roadmap: Roadmap, spacing: float = RESOLUTION) -> None:
        """Start empty.

        Args:
            roadmap: Of a hand with two joints.
            spacing: Of the grid, rad.
        """
        super().__init__(roadmap)
        self.grid = JointGrid.of(roadmap.system, spacing, _LEVELS)
        self._tables: dict[Formation, Table] = {}

    @property
    def sheets(self) -> list[Sheet]:
        """All sheets found."""
        return [piece for piece in self._roadmap.pieces if isinstance(piece, Sheet)]

    def coverage(self) -> str:
        """Say how completely regions were explored."""
        vertices = sum(len(sheet.vertices) for sheet in self.sheets)
        return (
            f'{self._everything()} was explored: curves in steps of at most {STEP:g} rad and '
            f'object sizes, {len(self.sheets)} regions of dimension 2 at {vertices} '
            f'configurations over a grid of joint angles of {self.grid.spacing:g} rad, or finer '
            f'in small regions, down to {self.grid.finest:g} rad'
        )

    def around(self, formation: Formation, z: FloatArray) -> Region:
        """Return the sheet of a formation that a stable configuration lies on."""
        return self._join(formation, z, z[None])

    def reach(
        self, region: Region, goal: GoalRegion, near: FloatArray | None
    ) -> Iterator[FloatArray]:
        """Configurations on a sheet that have a goal's coordinates; see `Regions.reach`."""
        assert isinstance(region, Sheet)
        if region.places == [None]:
            yield from super().reach(region, goal, near)
            return
        rows = self._table(region.formation, region.vertices[0]).rows
        for points in goals_on_sheet(self._roadmap.tracer, region, rows, goal, near):
            region.links.append((points[-1], points))
            yield points[-1]

    def losses(self, region: Region) -> Iterator[FloatArray]:
        """Ways from a sheet's vertices to where two contacts come to hold the object alone.

        Not all of them: borders are sampled.
        """
        assert isinstance(region, Sheet)
        if region.places == [None]:
            yield from super().losses(region)
        if not region.losses:
            return
        tracer, rows = self._roadmap.tracer, self._table(region.formation, region.anchor).rows
        vertices = np.array([region.vertices[vertex] for vertex, _ in region.losses])
        joints = np.array([angles for _, angles in region.losses])
        for k in settling_steps(tracer, rows, vertices, joints, _BORDER * self.grid.spacing):
            trace = towards(tracer, region.formation, vertices[k], joints[k])
            if trace.kind is EventKind.UNSTABLE and len(trace.points) > 1:
                yield trace.points

    def _samples(self, piece: Piece) -> FloatArray:
        """Points of a curve and three more between any two of them."""
        if piece.dimension != 1:
            return piece.points
        system = self._roadmap.system
        before, after = piece.points[:-1], piece.points[1:]
        middle = before[len(before) // 2]
        rows, _ = formation_equations(system, piece.formation.array, middle)
        bases = np.linalg.svd(equation_gradients(system, before, rows))[2][:, len(rows) :]
        parts = [before]
        for fraction in (0.25, 0.5, 0.75):
            guesses = before + fraction * (after - before)
            found = project(system, rows, before, bases, guesses)
            parts.append(np.where(found.converged[:, None], found.points, before))
        between = np.stack(parts, axis=1).reshape(-1, piece.points.shape[1])
        return np.concatenate([between, piece.points[-1:]])

    def _places(self, holds: BoolArray) -> list[int]:
        """First, middle and last of every run of points where the rest holds the object."""
        bounds = np.flatnonzero(np.diff(np.concatenate([[0], holds.astype(int), [0]])))
        return sorted(
            {
                place
                for first, end in bounds.reshape(-1, 2).tolist()
                for place in (first, (first + end - 1) // 2, end - 1)
            }
        )

    def _merge(self, formation: Formation, z: FloatArray, inward: FloatArray) -> Region | None:
        return self._join(formation, z, inward)

    def _join(self, formation: Formation, z: FloatArray, inward: FloatArray) -> Sheet:
        """Find or make the sheet that points from z lead onto, and link z to it."""
        tracer = self._roadmap.tracer
        table = self._table(formation, inward[-1])
        corners: dict[Place, int] = {}
        for level in range(self.grid.levels):
            for corner in self.grid.corners(inward[-1, 3:], level):
                corners.setdefault(corner, level)
        starts = np.tile(inward[-1], (len(corners), 1))
        joints = np.array([self.grid.joints(corner) for corner in corners])
        taken = take_steps(tracer, formation, table.rows, starts, joints)
        for k, (corner, level) in enumerate(corners.items()):
            if taken.clear[k]:
                between = np.stack([taken.ends[k], taken.middles[k]])
                return self._linked(table, corner, level, z, between, inward)
        borders = []
        ways = walk(tracer, formation, table.rows, starts, joints)
        for way, (corner, level) in zip(ways, corners.items(), strict=True):
            if way.arrived:
                return self._linked(table, corner, level, z, way.points[:0:-1], inward)
            if way.leads_on and len(way.points) > 1:
                borders.append(Border(0, way.points, corner, way.changes_class))
        return self._sliver(table, z, inward, borders)

    def _linked(
        self,
        table: Table,
        place: Place,
        level: int,
        z: FloatArray,
        between: FloatArray,
        inward: FloatArray,
    ) -> Sheet:
        """Link z to the sheet at a node; points between lead from there to the last inward."""
        node = between[0] if len(between) else inward[-1]
        sheet, vertex = self._at_node(table, place, node, level)
        points = [sheet.vertices[vertex][None], between[1:], inward[::-1]]
        sheet.links.append((z, np.concatenate(points)))
        return sheet

    def _at_node(self, table: Table, place: Place, z: FloatArray, level: int) -> tuple[Sheet, int]:
        """Find or fill the sheet with a configuration over a node; return the vertex too."""
        known = table.find(place, z)
        if known is not None:
            return known
        patch = self._new_sheet(table.formation, z)
        table.add(patch, place, z)
        sheet = fill(self._roadmap.tracer, self.grid, table, patch, level)
        if sheet is patch:
            self._roadmap.pieces.append(sheet)
        found = table.find(place, z)
        assert found is not None
        return found

    def _sliver(
        self, table: Table, z: FloatArray, inward: FloatArray, borders: list[Border]
    ) -> Sheet:
        """Find or make a sheet between the nodes of the grid."""
        anchor = inward[-1]
        stability = classify(self._roadmap.tracer.margins(table.formation, anchor[None]))
        for sheet in table.slivers:
            near = np.abs(sheet.anchor - anchor).max() < 2.0 * self.grid.spacing
            if sheet.stability is stability and near:
                joining = self._straight(table.formation, anchor, sheet.anchor)
                if joining is not None:
                    points = [sheet.anchor[None], joining[-2::-1], inward[-2::-1]]
                    sheet.links.append((z, np.concatenate(points)))
                    return sheet
        sheet = self._new_sheet(table.formation, anchor)
        self._roadmap.pieces.append(sheet)
        sheet.add(anchor, None)
        sheet.borders = borders
        sheet.links.append((z, inward[::-1]))
        table.slivers.append(sheet)
        return sheet

    def _new_sheet(self, formation: Formation, anchor: FloatArray) -> Sheet:
        """Sheet that is not yet a piece; nothing else becomes one while it is filled."""
        roadmap = self._roadmap
        return Sheet(
            len(roadmap.pieces),
            formation,
            classify(roadmap.tracer.margins(formation, anchor[None])),
            2,
            anchor[None],
            (),
            straight=lambda start, end: self._straight(formation, start, end),
        )

    def _table(self, formation: Formation, z: FloatArray) -> Table:
        if formation not in self._tables:
            rows = formation_rows(formation.array)
            gradients = equation_gradients(self._roadmap.system, z[None], rows)[0]
            chosen = list(independent_rows(gradients[:, :3]))
            self._tables[formation] = Table(formation, rows[chosen])
        return self._tables[formation]

    def _shoot(self, region: Region) -> Iterator[tuple[FloatArray, Piece]]:
        """Pieces behind the borders of a sheet."""
        assert isinstance(region, Sheet)
        if region.places == [None]:
            # A strip narrower than the grid may be long.
            yield from super()._shoot(region)
        found: list[tuple[FloatArray, Piece]] = []
        onwards: list[tuple[Border, Departure]] = []
        for border in region.borders:
            self._roadmap.attempts += 1
            z = border.z
            region.links.append((z, border.points))
            if not border.changes_class and self._joins(region, z):
                found.append((z, self._roadmap.root(z)))
            elif np.abs(border.points - z).max() > SAME:
                heading = _heading(border.points)
                if border.changes_class:
                    onwards.append((border, Departure(region.formation, heading, frozenset())))
                else:
                    onwards += [(border, way) for way in self._ways(region, z, heading)]
        yield from found
        yield from self._cross(region, onwards)

    def _cross(
        self, region: Sheet, onwards: list[tuple[Border, Departure]]
    ) -> Iterator[tuple[FloatArray, Piece]]:
        """Enter sheets over borders, to the nodes that the steps led to where that is possible."""
        alike: dict[Formation, list[int]] = {}
        for number, (_, way) in enumerate(onwards):
            alike.setdefault(way.formation, []).append(number)
        for formation, numbers in alike.items():
            some = [onwards[number][0] for number in numbers]
            table = self._table(formation, some[0].z)
            starts = np.array([border.z for border in some])
            joints = np.array([self.grid.joints(border.beyond) for border in some])
            departing = [onwards[number][1].departing for number in numbers]
            crossed: list[FloatArray | None]
            tracer = self._roadmap.tracer
            if is_second_order(formation):
                crossed = [None] * len(numbers)
            else:
                crossed = step_across(tracer, formation, table.rows, starts, joints, departing)
            for number, points in zip(numbers, crossed, strict=True):
                border, way = onwards[number]
                place = border.beyond
                entered: Region | None
                known = points is not None and table.find(place, points[-1]) is not None
                if points is not None and (known or self.grid.is_coarse(place)):
                    entered = self._linked(table, place, 0, border.z, points[:1:-1], points[:2])
                else:
                    entered = self.enter(border.z, way)
                if entered is not None and entered is not region:
                    yield border.z, entered
