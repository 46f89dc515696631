"""Steps on a sheet: from configurations to where the joints are a little elsewhere, many at once.

In a first-order stable contact formation the object's pose is a function of the joint angles:
with rows [W J] of the independent contacts, W dq + J dθ = 0 and W is regular. A step is predicted
by that and corrected by Newton's method with the joints held, at its middle and at its end.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cfplan_core.contact.formation import Formation
from cfplan_core.contact.gaps import gap_gradients, gaps, wedge_lifts
from cfplan_core.contact.system import BoolArray, IntArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.equations import equation_gradients
from cfplan_core.planning.manifold import project
from cfplan_core.planning.sheet_events import Happenings, Kind
from cfplan_core.planning.tracing import STABILITY_MARGIN, Tracer

# A gap whose interpolated minimum between three samples is below this gets a closer look.
_GRAZE = 1e-6
_NEAR = 1e-9
# Longest step of the pose, in sizes and radians, that is taken at once.
_LONGEST = 0.15
# How far, as a part of the step, its middle may be from the chord's.
_BENT = 0.1
_APART = 1e-7
# Offsets where a gap closes are interpolated: what is so near an edge's end gets a closer look.
_OFFSET_SLACK = 0.02


@dataclass(frozen=True, eq=False)
class Steps:
    """What m steps led to.

    Attributes:
        middles: Shape (m, 3 + n).
        ends: Shape (m, 3 + n).
        clear: Shape (m,), true where nothing happens on the way.
        lost: Shape (m,), true where nothing happens on the way before stability is lost.
        smooth: Shape (m,), false where a step is too long or bent to be judged.
        happenings: What may happen first on the others, before their middle or behind it.
    """

    middles: FloatArray
    ends: FloatArray
    clear: BoolArray
    lost: BoolArray
    smooth: BoolArray
    happenings: Happenings


class _Half(NamedTuple):
    """Samples at the beginnings and ends of the halves of m steps, each of shape (m, 2, ...)."""

    before: FloatArray
    after: FloatArray


def take_steps(
    tracer: Tracer,
    formation: Formation,
    rows: IntArray,
    starts: FloatArray,
    joints: FloatArray,
) -> Steps:
    """Move joints while contacts are kept.

    Args:
        tracer: Knows system and model.
        formation: The contacts.
        rows: Three of their equations that are independent for fixed joints.
        starts: Shape (m, 3 + n), stable.
        joints: Shape (m, n), where they shall be.
    """
    system = tracer.system
    count = len(starts)
    middles, ends, smooth = _continued(tracer, rows, starts, joints)
    path = np.stack([starts, middles, ends], axis=1)
    flat = path.reshape(-1, system.dof)
    placed = system.place(flat)
    gradients = gap_gradients(system, placed, formation.array)
    margins = tracer.judge(flat, gradients, formation.array)
    stable = (margins.stable > STABILITY_MARGIN).reshape(count, 3)
    closed = (margins.form_closure > STABILITY_MARGIN).reshape(count, 3)
    signs = margins.signs.reshape(count, 3, margins.signs.shape[1])
    turning = (signs[:, 1:] != signs[:, :-1]).any(axis=2) & stable[:, 1:]
    turning |= closed[:, 1:] != closed[:, :-1]

    kept = formation.array
    gap, offset = (v.reshape(count, 3, -1) for v in gaps(system, placed, slice(None)))
    lifts = [v.reshape(count, 3, -1) for v in wedge_lifts(system, placed, kept)]
    happenings = _sight(system.pair_length, kept, gap, offset, lifts)
    happens = np.zeros((count, 2), dtype=bool)
    happens[happenings.step, happenings.half] = True
    odd = turning | _grazing(system.pair_length, gap, offset, kept)[:, None]
    odd |= (np.abs(gap[:, 1:, kept]) > _APART).any(axis=2)
    smooth = smooth & ~odd[:, 0] & (happens[:, 0] | ~stable[:, 1] | ~odd[:, 1])

    clear = smooth & stable.all(axis=1) & ~happens.any(axis=1)
    lost = smooth & ~happens[:, 0] & (~stable[:, 1] | (~happens[:, 1] & ~stable[:, 2]))
    first = (happenings.half == 0) | ~happens[happenings.step, 0]
    first &= smooth[happenings.step] & ~lost[happenings.step]
    return Steps(middles, ends, clear, lost, smooth, happenings.chosen(first))


def _continued(
    tracer: Tracer, rows: IntArray, starts: FloatArray, joints: FloatArray
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Middles and ends of steps, and which of them are smooth."""
    count = len(starts)
    gradients = equation_gradients(tracer.system, starts, rows)
    change = np.zeros_like(starts)
    change[:, 3:] = joints - starts[:, 3:]
    drive = (gradients[..., 3:] @ change[:, 3:, None])[..., 0]
    change[:, :3] = -np.linalg.solve(gradients[..., :3], drive[..., None])[..., 0]
    modest = np.abs(change).max(axis=1) <= _LONGEST
    change[~modest] = 0.0
    guesses = np.concatenate([starts + 0.5 * change, starts + change])
    origins = np.concatenate([starts, starts])
    found = project(tracer.system, rows, origins, np.eye(tracer.system.dof)[3:], guesses)
    middles, ends = found.points[:count], found.points[count:]
    step = np.abs(ends - starts).max(axis=1)
    bend = np.abs(middles - 0.5 * (starts + ends)).max(axis=1)
    smooth = modest & found.converged[:count] & found.converged[count:]
    smooth &= (step <= 1.5 * _LONGEST) & (bend <= _BENT * step)
    middles[~smooth] = ends[~smooth] = starts[~smooth]
    return middles, ends, smooth


def _sight(
    length: FloatArray,
    kept: IntArray,
    gap: FloatArray,
    offset: FloatArray,
    lifts: list[FloatArray],
) -> Happenings:
    """Gaps that close, kept contacts at their edge's end, edges that come to lie flush.

    Args:
        length: Shape (p,), of the edges of all pairs.
        kept: Shape (k,), contacts of the formation.
        gap: Shape (m, 3, p).
        offset: Shape (m, 3, p).
        lifts: Two of shape (m, 3, k), of the edges behind and before each kept vertex.
    """
    closes = (gap[:, :-1] > _NEAR) & (gap[:, 1:] <= _NEAR)
    closes[..., kept] = False
    step, half, pair = np.nonzero(closes)
    first, last = gap[step, half, pair], gap[step, half + 1, pair]
    fraction = first / (first - last)
    at = offset[step, half, pair]
    at = at + fraction * (offset[step, half + 1, pair] - at)
    within = (at >= -_OFFSET_SLACK) & (at <= length[pair] + _OFFSET_SLACK)
    nought = np.zeros(len(step))
    found = [Happenings.of(Kind.GAP, step, half, pair, nought, fraction).chosen(within)]
    along = offset[..., kept]
    edge = length[kept]
    for kind, height, target in (
        (Kind.EDGE_END, along, np.zeros_like(edge)),
        (Kind.EDGE_END, edge - along, edge),
        (Kind.FLUSH_AFTER, lifts[0], np.zeros_like(edge)),
        (Kind.FLUSH_BEFORE, lifts[1], np.zeros_like(edge)),
    ):
        below = (height[:, :-1] >= -_NEAR) & (height[:, 1:] < -_NEAR)
        step, half, k = np.nonzero(below)
        first, last = height[step, half, k], height[step, half + 1, k]
        fraction = np.clip(first / (first - last), 0.0, 1.0)
        found.append(Happenings.of(kind, step, half, kept[k], target[k], fraction))
    return Happenings.joined(found)


def _grazing(length: FloatArray, gap: FloatArray, offset: FloatArray, kept: IntArray) -> BoolArray:
    """Tell in which steps, shape (m,), a gap, interpolated, may close and open again."""
    before, middle, after = gap[:, 0], gap[:, 1], gap[:, 2]
    bend = before - 2.0 * middle + after
    dips = (middle > 0.0) & (before >= 0.0) & (after >= 0.0) & (bend > _NEAR)
    dips &= np.abs(after - before) < 2.0 * bend
    lowest = middle - 0.125 * (after - before) ** 2 / np.where(dips, bend, 1.0)
    within = (offset.max(axis=1) > 0.0) & (offset.min(axis=1) < length)
    dips &= (lowest < _GRAZE) & within
    dips[:, kept] = False
    return np.asarray(dips.any(axis=1))
