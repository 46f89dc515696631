"""Steps on a sheet on which contact forces vanish until two contacts hold the object alone.

For each pair of a sheet's contacts Newton's method solves, for many steps at once, for the
contacts, for the balance of the two and for the line that the joints move along.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from cfplan_core.contact.curvature import wrench_rates
from cfplan_core.contact.gaps import gap_gradients
from cfplan_core.contact.system import BoolArray, IntArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.equations import EQUILIBRIUM, equations
from cfplan_core.planning.manifold import CONVERGED
from cfplan_core.planning.tracing import STABILITY_MARGIN, Tracer

_ITERATIONS = 10
# How far before and behind a step, as a part of it, is on it.
_SLACK = 0.1


def settling_steps(
    tracer: Tracer, rows: IntArray, starts: FloatArray, joints: FloatArray, apart: float
) -> list[int]:
    """Choose steps that end where two contacts hold the object to second order.

    Args:
        tracer: Knows system and model.
        rows: Three contacts of the sheet that are independent for fixed joints.
        starts: Shape (m, 5), where the steps begin, stable.
        joints: Shape (m, 2), where they lead.
        apart: How far the chosen ones are from each other, at least, in radians and object sizes.

    Returns:
        Indices of steps, ascending.
    """
    chosen: list[int] = []
    if EQUILIBRIUM in rows:
        return chosen
    for pair in combinations(rows.tolist(), 2):
        places, real = _places(tracer, rows, np.array(pair, dtype=np.intp), starts, joints)
        kept: list[FloatArray] = []
        for k in np.flatnonzero(real):
            if all(np.abs(places[k] - other).max() > apart for other in kept):
                kept.append(places[k])
                chosen.append(int(k))
    return sorted(set(chosen))


def _places(
    tracer: Tracer, rows: IntArray, pair: IntArray, starts: FloatArray, joints: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Where two of three contacts balance on steps, shape (m, 5), and whether they hold there."""
    system = tracer.system
    count = len(starts)
    ahead = joints - starts[:, 3:]
    length = np.linalg.norm(ahead, axis=1)
    across = np.zeros_like(starts)
    across[:, 3], across[:, 4] = -ahead[:, 1] / length, ahead[:, 0] / length
    balance = np.append(pair, EQUILIBRIUM)
    z = starts.copy()
    matrix = np.empty((count, 5, 5))
    residual = np.empty((count, 5, 1))
    matrix[:, 4] = across
    change = np.full(count, np.inf)
    for _ in range(_ITERATIONS):
        placed = system.place(z)
        residual[:, :3, 0], matrix[:, :3] = equations(system, placed, rows)
        value, slope = equations(system, placed, balance)
        residual[:, 3, 0], matrix[:, 3] = value[:, -1], slope[:, -1]
        residual[:, 4, 0] = ((z - starts) * across).sum(axis=1)
        regular = np.abs(np.linalg.det(matrix)) > 1e-14
        safe = np.where(regular[:, None, None], matrix, np.eye(5))
        step = np.linalg.solve(safe, residual)[..., 0]
        change = np.where(regular, np.abs(step).max(axis=1), np.inf)
        # Steps are short: what leaves them far behind is no answer.
        z = z - np.where((change <= 1.0)[:, None], step, 0.0)
        if (change <= CONVERGED).all():
            break
    place = ((z[:, 3:] - starts[:, 3:]) * ahead).sum(axis=1) / length**2
    on_step = (change <= CONVERGED) & (place > -_SLACK) & (place < 1.0 + _SLACK)
    placed = system.place(z)
    gradients = gap_gradients(system, placed, pair)
    margins = tracer.model.second_order_margins(gradients, wrench_rates(system, placed, pair))
    return z, on_step & (margins.stable > STABILITY_MARGIN)
