"""Flood fill: find all of a sheet from one of its configurations."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from cfplan_core.contact.formation import Formation
from cfplan_core.contact.system import IntArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.joint_grid import JointGrid, Place
from cfplan_core.planning.sheet_graph import Border, Sheet
from cfplan_core.planning.sheet_steps import take_steps
from cfplan_core.planning.sheet_walks import walk
from cfplan_core.planning.tracing import Tracer

# Configurations over the same joint angles nearer than this are the same.
_SAME = 1e-5
# Sheets with fewer vertices are filled again at the next finer level.
_FEW = 100
# With more vertices at a finer level than the first, a sheet is continued at a coarser one.
_MANY = 400
# Finer steps around a vertex with borders near on both sides.
_RINGS = 4


@dataclass(eq=False)
class Table:
    """The sheets of one formation by the nodes of the grid that they lie over.

    Attributes:
        formation: The contacts.
        rows: Three of their equations that are independent for fixed joints, shape (3,).
        slivers: Sheets between the nodes.
        vertices: For each node the sheets over it, with the index of the vertex.
    """

    formation: Formation
    rows: IntArray
    slivers: list[Sheet] = field(default_factory=list)
    vertices: dict[Place, list[tuple[Sheet, int]]] = field(default_factory=dict)

    def find(self, place: Place, z: FloatArray) -> tuple[Sheet, int] | None:
        """Return the vertex at a configuration, shape (3 + n,), over a node."""
        for sheet, vertex in self.vertices.get(place, ()):
            if np.abs(sheet.vertices[vertex] - z).max() < _SAME:
                return sheet, vertex
        return None

    def add(self, sheet: Sheet, place: Place, z: FloatArray) -> int:
        """Add a vertex to a sheet and return its index."""
        vertex = sheet.add(z, place)
        self.vertices.setdefault(place, []).append((sheet, vertex))
        return vertex

    def absorb(self, sheet: Sheet, patch: Sheet) -> list[int]:
        """Make a patch part of a sheet; return the new indices of its vertices."""
        index = []
        for vertex, (place, z) in enumerate(zip(patch.places, patch.vertices, strict=True)):
            assert place is not None
            self.vertices[place].remove((patch, vertex))
            index.append(self.add(sheet, place, z))
        for first, beside in enumerate(patch.edges):
            for second, between in beside.items():
                sheet.connect(index[first], index[second], between)
        sheet.borders += [replace(border, vertex=index[border.vertex]) for border in patch.borders]
        sheet.losses += [(index[vertex], joints) for vertex, joints in patch.losses]
        return index


def fill(tracer: Tracer, grid: JointGrid, table: Table, patch: Sheet, level: int) -> Sheet:
    """Find all of a sheet that grid steps reach from a vertex.

    A sheet with few vertices is filled again at finer levels; one with many at a fine level is
    continued at coarser ones. Where borders are near on both sides it is filled finer.

    Args:
        tracer: Knows system and model.
        grid: Steps lead between its nodes.
        table: Of the formation.
        patch: With one vertex, in the table.
        level: Of the grid to begin with.

    Returns:
        The patch, or the known sheet that it was found to be a part of.
    """
    return _Filling(tracer, grid, table, patch).run(level)


# A step over the grid: vertex, joint, number of lines, node that it leads to.
_Step = tuple[int, int, int, Place]


class _Filling:
    """State of one flood fill."""

    def __init__(self, tracer: Tracer, grid: JointGrid, table: Table, patch: Sheet) -> None:
        self.tracer = tracer
        self.grid = grid
        self.table = table
        self.sheet = patch
        self.front = [0]
        # Steps taken, by vertex, joint and number of lines; and those that met something.
        self.done: set[tuple[int, int, int]] = set()
        self.stopped: list[_Step] = []
        # Steps that led to a vertex, and vertices that were looked around, by level.
        self.led: set[tuple[int, int, int]] = set()
        self.looked: set[tuple[int, int]] = set()
        self.join: tuple[int, Sheet, int, FloatArray] | None = None

    def run(self, level: int) -> Sheet:
        refining, most = True, _MANY
        while True:
            self._spread(level, most if level > 0 else None)
            count = len(self.sheet.vertices)
            if self.join is not None:
                if self.stopped:
                    self._look_closer()
                vertex, sheet, beside, between = self.join
                index = self.table.absorb(sheet, self.sheet)
                sheet.connect(index[vertex], beside, between)
                return sheet
            if self.front:
                refining = False
                stride = self.grid.stride(level - 1)
                coarser = [k for k in range(count) if self._lies_on_lines(k, stride)]
                if coarser:
                    self.front, level = coarser, level - 1
                else:
                    most *= 2
            elif refining and count < _FEW and level + 1 < self.grid.levels:
                # What stopped a step is met again by a shorter one.
                self.stopped = []
                self.sheet.losses = []
                level += 1
                self.front = list(range(count))
            elif self.stopped:
                refining = False
                self._look_closer()
            elif not self._look_between(level):
                return self.sheet

    def _lies_on_lines(self, vertex: int, stride: int) -> bool:
        place = self.sheet.places[vertex]
        return place is not None and all(line % stride == 0 for line in place)

    def _spread(self, level: int, most: int | None) -> None:
        """Take steps of a level until there are no more, too many vertices, or a known sheet."""
        stride = self.grid.stride(level)
        while self.front and self.join is None:
            if most is not None and len(self.sheet.vertices) > most:
                return
            self.tracer.checkpoint()
            self._step(self._open_steps(stride))

    def _step(self, steps: list[_Step]) -> None:
        self.front = []
        if not steps:
            return
        starts, joints = self._ends(steps)
        formation, rows = self.table.formation, self.table.rows
        taken = take_steps(self.tracer, formation, rows, starts, joints)
        for k, step in enumerate(steps):
            if step[:3] in self.done:
                continue
            self.done.add(step[:3])
            if taken.clear[k]:
                self._arrive(step, taken.ends[k], taken.middles[k : k + 1])
            elif taken.lost[k]:
                self.sheet.losses.append((step[0], joints[k]))
            else:
                self.stopped.append(step)

    def _look_closer(self) -> None:
        """Find what stopped steps have met, or that they have met nothing."""
        steps, self.stopped = self.stopped, []
        starts, joints = self._ends(steps)
        formation, rows = self.table.formation, self.table.rows
        ways = walk(self.tracer, formation, rows, starts, joints)
        for step, way, angles in zip(steps, ways, joints, strict=True):
            if way.arrived:
                self._arrive(step, way.points[-1], way.points[1:-1])
            elif way.leads_on:
                border = Border(step[0], way.points, step[3], way.changes_class)
                self.sheet.borders.append(border)
            else:
                self.sheet.losses.append((step[0], angles))

    def _look_between(self, level: int) -> bool:
        """Fill finer where borders are near on both sides; tell whether there is more to do then.

        A neck may lead on from there between the lines.
        """
        count = len(self.sheet.vertices)
        for finer in range(level + 1, self.grid.levels):
            coarse = self.grid.stride(finer - 1)
            tips = [
                vertex
                for vertex in range(len(self.sheet.vertices))
                if (vertex, finer) not in self.looked and self._is_pinched(vertex, coarse)
            ]
            self.looked.update((vertex, finer) for vertex in tips)
            self.front = tips
            for _ in range(_RINGS):
                if self.front and self.join is None:
                    self.tracer.checkpoint()
                    self._step(self._open_steps(self.grid.stride(finer)))
        stride = self.grid.stride(level)
        new = range(count, len(self.sheet.vertices))
        self.front = [vertex for vertex in new if self._lies_on_lines(vertex, stride)]
        return bool(self.front or self.stopped or self.join is not None)

    def _is_pinched(self, vertex: int, lines: int) -> bool:
        """Tell whether steps of some joint both up and down met something, or a limit."""
        place = self.sheet.places[vertex]
        assert place is not None
        for joint in range(len(place)):
            steps = [(vertex, joint, way) for way in (-lines, lines)]
            if any(step in self.led for step in steps):
                continue
            met = [step in self.done for step in steps]
            beyond = [self.grid.neighbour(place, joint, way) is None for way in (-lines, lines)]
            if any(met) and all(m or b for m, b in zip(met, beyond, strict=True)):
                return True
        return False

    def _ends(self, steps: list[_Step]) -> tuple[FloatArray, FloatArray]:
        """Where steps begin, shape (m, 3 + n), and the joint angles they lead to, (m, n)."""
        starts = np.array([self.sheet.vertices[vertex] for vertex, _, _, _ in steps])
        return starts, np.array([self.grid.joints(place) for _, _, _, place in steps])

    def _open_steps(self, stride: int) -> list[_Step]:
        steps = []
        for vertex in self.front:
            place = self.sheet.places[vertex]
            assert place is not None
            for joint in range(len(place)):
                for lines in (-stride, stride):
                    beside = self.grid.neighbour(place, joint, lines)
                    if beside is not None and (vertex, joint, lines) not in self.done:
                        steps.append((vertex, joint, lines, beside))
        return steps

    def _arrive(self, step: _Step, z: FloatArray, between: FloatArray) -> None:
        """Note that a step leads to z."""
        vertex, joint, lines, place = step
        known = self.table.find(place, z)
        if known is None:
            reached = self.table.add(self.sheet, place, z)
            self.front.append(reached)
        elif known[0] is self.sheet:
            reached = known[1]
        else:
            self.join = (vertex, *known, between)
            return
        self.sheet.connect(vertex, reached, between)
        self.done.add((reached, joint, -lines))
        self.led |= {(vertex, joint, lines), (reached, joint, -lines)}
