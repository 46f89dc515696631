"""Where on steps over a sheet something happens, located to rounding for many steps at once.

For each happening Newton's method solves for the three contacts, the event and the line that the
joints move along: five equations for five unknowns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from enum import IntEnum

import numpy as np

from cfplan_core.contact.formation import Formation
from cfplan_core.contact.gaps import gap_gradients, gaps
from cfplan_core.contact.system import BoolArray, ContactSystem, IntArray, Placement
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.equations import equations
from cfplan_core.planning.manifold import CONVERGED
from cfplan_core.planning.tracing import STABILITY_MARGIN, Tracer

_ITERATIONS = 12
_ASTRAY = 1.0
_NEAR = 1e-9
# Events nearer than this, as a part of the step, happen together.
_TOGETHER = 1e-9
_OFFSET_SLACK = 0.02


class Kind(IntEnum):
    """What may happen; see `EventKind`."""

    GAP = 0
    EDGE_END = 1
    FLUSH_AFTER = 2
    FLUSH_BEFORE = 3


@dataclass(frozen=True, eq=False)
class Happenings:
    """What may happen on steps, each attribute of shape (c,).

    Attributes:
        kind: A `Kind`.
        step: Index of the step.
        half: 0 for its first half, 1 for its second.
        pair: The pair it happens to.
        target: The offset at an edge's end.
        fraction: Estimated place in the half.
    """

    kind: IntArray
    step: IntArray
    half: IntArray
    pair: IntArray
    target: FloatArray
    fraction: FloatArray

    @staticmethod
    def of(
        kind: Kind,
        step: IntArray,
        half: IntArray,
        pair: IntArray,
        target: FloatArray,
        fraction: FloatArray,
    ) -> Happenings:
        """Happenings of one kind."""
        return Happenings(np.full(len(step), int(kind)), step, half, pair, target, fraction)

    @staticmethod
    def joined(several: Sequence[Happenings]) -> Happenings:
        """One after the other."""
        return Happenings(
            *(np.concatenate([getattr(h, f.name) for h in several]) for f in fields(Happenings))
        )

    def chosen(self, which: BoolArray | IntArray) -> Happenings:
        """Some of them."""
        return Happenings(*(getattr(self, f.name)[which] for f in fields(Happenings)))


@dataclass(frozen=True, eq=False)
class Located:
    """What ends m steps.

    Attributes:
        z: Shape (m, 3 + n), where.
        found: Shape (m,), false where it has to be followed exactly.
        open: Shape (m,), true where other formations may lie behind; false where links meet or
            stability is lost before.
        late: Shape (m,), true where it is in the second half.
    """

    z: FloatArray
    found: BoolArray
    open: BoolArray
    late: BoolArray


def locate_first(
    tracer: Tracer,
    formation: Formation,
    rows: IntArray,
    samples: FloatArray,
    happenings: Happenings,
) -> Located:
    """Find what happens first on steps.

    Args:
        tracer: Knows system and model.
        formation: The contacts.
        rows: Three of their equations that are independent for fixed joints.
        samples: Shape (m, 3, 3 + n), beginning, middle and end of the steps.
        happenings: In the first half of a step in which there are any.
    """
    system = tracer.system
    count = len(samples)
    result = Located(samples[:, 0].copy(), *(np.zeros(count, dtype=bool) for _ in range(3)))
    if not len(happenings.step):
        return result
    before = samples[happenings.step, happenings.half]
    after = samples[happenings.step, happenings.half + 1]
    z, converged = _newton(system, rows, happenings, before, after)
    chord = after - before
    place = ((z - before) * chord).sum(axis=1) / (chord * chord).sum(axis=1)
    sound = np.asarray(converged & (place >= -_TOGETHER) & (place <= 1.0 + _TOGETHER))
    placed = system.place(z)
    is_gap = np.asarray(happenings.kind == Kind.GAP)
    every = np.arange(len(z))
    gap, offset = gaps(system, placed, slice(None))
    at = offset[every, happenings.pair]
    inside = (at >= -_NEAR) & (at <= system.pair_length[happenings.pair] + _NEAR)
    real = np.asarray(sound & (inside | ~is_gap))
    order = np.lexsort((np.where(real, place, np.inf), happenings.step))
    first = order[np.unique(happenings.step[order], return_index=True)[1]]
    doubtful = np.zeros(count, dtype=bool)
    doubtful[happenings.step[~sound]] = True

    # Nothing else may have closed on the way.
    near = (gap < -_NEAR) & (offset > -_OFFSET_SLACK)
    near &= offset < system.pair_length + _OFFSET_SLACK
    near[:, formation.array] = False
    start_gap = gaps(system, system.place(before), slice(None)).gap
    clean = np.asarray(~(near & (start_gap > _NEAR)).any(axis=1))
    gradients = gap_gradients(system, placed, formation.array)
    margins = tracer.judge(z, gradients, formation.array)
    holds = margins.stable > STABILITY_MARGIN
    links = is_gap & (happenings.pair >= system.contact_count)
    for k in first[real[first] & clean[first]]:
        step = happenings.step[k]
        result.z[step] = z[k]
        result.found[step] = not doubtful[step]
        result.late[step] = happenings.half[k] == 1
        result.open[step] = holds[k] and not links[k]
    return result


def _newton(
    system: ContactSystem,
    rows: IntArray,
    happenings: Happenings,
    before: FloatArray,
    after: FloatArray,
) -> tuple[FloatArray, BoolArray]:
    """Solve for the contacts, the events and the lines between before and after."""
    count, k = len(before), len(rows)
    z = before + happenings.fraction[:, None] * (after - before)
    across = np.zeros_like(z)
    across[:, 3] = before[:, 4] - after[:, 4]
    across[:, 4] = after[:, 3] - before[:, 3]
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    matrix = np.empty((count, system.dof, system.dof))
    residual = np.empty((count, system.dof, 1))
    matrix[:, k + 1] = across
    change = np.full(count, np.inf)
    for _ in range(_ITERATIONS):
        placed = system.place(z)
        residual[:, :k, 0], matrix[:, :k] = equations(system, placed, rows)
        residual[:, k, 0], matrix[:, k] = _values(system, happenings, placed)
        residual[:, k + 1, 0] = ((z - before) * across).sum(axis=1)
        regular = np.abs(np.linalg.det(matrix)) > 1e-14
        matrix[~regular] = np.eye(system.dof)
        step = np.linalg.solve(matrix, residual)[..., 0]
        matrix[~regular, k + 1] = across[~regular]
        change = np.where(regular, np.abs(step).max(axis=1), np.inf)
        settled = change <= CONVERGED
        astray = ~(change <= _ASTRAY)
        step[astray] = 0.0
        z = z - step
        if (settled | astray).all():
            break
    return z, change <= CONVERGED


def _values(
    system: ContactSystem, happenings: Happenings, placed: Placement
) -> tuple[FloatArray, FloatArray]:
    """Functions whose roots the events are, shape (c,), and their gradients, (c, 3 + n)."""
    every = np.arange(len(happenings.pair))
    pair = happenings.pair
    vertex, edge = system.pair_vertex[pair], system.pair_edge[pair]
    point, normal = placed.vertices[every, vertex], placed.normals[every, edge]
    local = normal.conj() * (point - placed.vertices[every, edge])
    is_end = happenings.kind == Kind.EDGE_END
    value = np.where(is_end, local.imag - happenings.target, local.real)
    direction = np.where(is_end, 1j, 1.0) * normal
    gradient = np.empty((len(pair), system.dof))
    sign, moves = system.pair_object_sign[pair], system.pair_moves[pair]
    gradient[:, 0] = sign * direction.real
    gradient[:, 1] = sign * direction.imag
    gradient[:, 2] = sign * ((point - placed.center).conj() * direction).imag
    reach = point[:, None] - placed.axes
    gradient[:, 3:] = moves * (reach.conj() * direction[:, None]).imag

    behind = happenings.kind == Kind.FLUSH_AFTER
    flush = behind | (happenings.kind == Kind.FLUSH_BEFORE)
    other = np.where(behind, vertex, system.previous_vertex[vertex])
    lift = normal.conj() * placed.normals[every, other] * np.where(behind, 1.0, -1.0)
    value = np.where(flush, -lift.imag, value)
    turn = np.concatenate([np.zeros((len(pair), 2)), sign[:, None], moves], axis=1)
    return value, np.where(flush[:, None], -lift.real[:, None] * turn, gradient)
