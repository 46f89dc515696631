"""The equations of a contact formation's manifold.

Contacts that are kept have no gap. Where two contacts alone hold the object (stable to second
order), they also balance its weight: one equation more, without which the object would slide
along them. *Rows* name the equations: indices of pairs whose gaps vanish, and `EQUILIBRIUM` last
where the two before it balance the load.
"""

from __future__ import annotations

from collections.abc import Sized

import numpy as np

from cfplan_core.contact.curvature import wrench_rates
from cfplan_core.contact.gaps import gap_gradients, gaps
from cfplan_core.contact.system import ContactSystem, IntArray, Placement
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.second_order import imbalance

EQUILIBRIUM = -1


def is_second_order(pairs: Sized) -> bool:
    """Tell whether contacts can hold an object at most to second order: two of them."""
    return len(pairs) == 2


def formation_rows(pairs: IntArray) -> IntArray:
    """All equations of a formation, dependent or not.

    Args:
        pairs: Its contacts, shape (k,).

    Returns:
        The pairs, and `EQUILIBRIUM` behind two of them: fewer than three contacts hold the object
        only where they balance it.
    """
    return np.append(pairs, EQUILIBRIUM) if is_second_order(pairs) else pairs


def equations(
    system: ContactSystem, placed: Placement, rows: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Evaluate equations, which are zero on the manifold.

    Args:
        system: Compiled problem.
        placed: From `ContactSystem.place`.
        rows: Shape (k,).

    Returns:
        Values, shape (s, k), and gradients, shape (s, k, 3 + n).
    """
    if not len(rows) or rows[-1] != EQUILIBRIUM:
        return gaps(system, placed, rows).gap, gap_gradients(system, placed, rows)
    pairs = rows[:-1]
    gradients = gap_gradients(system, placed, pairs)
    rates = wrench_rates(system, placed, pairs)
    value, slope = imbalance(gradients[..., :3], rates, system.load)
    return (
        np.concatenate([gaps(system, placed, pairs).gap, value[:, None]], axis=1),
        np.concatenate([gradients, slope[:, None]], axis=1),
    )


def equation_gradients(system: ContactSystem, z: FloatArray, rows: IntArray) -> FloatArray:
    """Gradients of equations, shape (s, k, 3 + n), at configurations of shape (s, 3 + n)."""
    return equations(system, system.place(z), rows)[1]
