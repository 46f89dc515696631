"""Steps over a border of a sheet into what lies behind, many at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cfplan_core.contact.formation import Formation
from cfplan_core.contact.gaps import gaps, wedge_lifts
from cfplan_core.contact.system import IntArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.manifold import project
from cfplan_core.planning.sheet_steps import take_steps
from cfplan_core.planning.tracing import STABILITY_MARGIN, Tracer
from cfplan_core.planning.transitions import TOUCH

# Part of the step after which what touches on the border alone does so no more.
_BEHIND = 0.02
_OVERLAP = 1e-12
_FLUSH = 1e-9


def step_across(
    tracer: Tracer,
    formation: Formation,
    rows: IntArray,
    starts: FloatArray,
    joints: FloatArray,
    departing: Sequence[frozenset[int]],
) -> list[FloatArray | None]:
    """Go on from a border inside a formation that lies behind it.

    Args:
        tracer: Knows system and model.
        formation: Behind the border.
        rows: Three of its contacts that are independent for fixed joints.
        starts: Shape (m, 3 + n), on the border.
        joints: Shape (m, n), where to.
        departing: For each step the pairs that touch on the border and open.

    Returns:
        For each step its points, shape (4, 3 + n): on the border, just behind it, half way, there;
        None where something happens on the way or the step cannot be judged.
    """
    system = tracer.system
    guesses = starts.copy()
    guesses[:, 3:] += _BEHIND * (joints - starts[:, 3:])
    gradients = tracer.gradients(starts, rows)
    if np.abs(np.linalg.det(gradients[..., :3])).min() < STABILITY_MARGIN:
        return [None] * len(starts)
    change = (gradients[..., 3:] @ (guesses - starts)[:, 3:, None])[..., 0]
    guesses[:, :3] -= np.linalg.solve(gradients[..., :3], change[..., None])[..., 0]
    behind = project(system, rows, starts, np.eye(system.dof)[3:], guesses)
    placed = system.place(behind.points)
    gap, offset = gaps(system, placed, slice(None))
    dips = (gap < -_OVERLAP) & (offset >= 0.0) & (offset <= system.pair_length)
    sound = behind.converged & (np.abs(gap[:, formation.array]).max(axis=1) < TOUCH)
    # An edge that lies flush on the border may not dip into the edge that its vertex touches.
    sound &= np.min(wedge_lifts(system, placed, formation.array), axis=(0, 2)) >= -_FLUSH
    sound &= [not dips[k, sorted(pairs)].any() for k, pairs in enumerate(departing)]
    taken = take_steps(tracer, formation, rows, behind.points, joints)
    sound &= taken.clear
    paths = np.stack([starts, behind.points, taken.middles, taken.ends], axis=1)
    return [path if good else None for path, good in zip(paths, sound, strict=True)]
