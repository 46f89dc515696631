"""Small least-squares problems with inequalities: the inner loop of steering.

Minimise ½ aᵀ H a − fᵀ a subject to G a ≥ h. With S = G H⁻¹ Gᵀ its dual asks for multipliers
λ ≥ 0 that minimise ½ λᵀ S λ + λᵀ (G a₀ − h), where a₀ = H⁻¹ f is the answer without inequalities;
then a = a₀ + H⁻¹ Gᵀ λ. The active set is grown by the most violated row, and rows whose multiplier
turns negative leave it.
"""

from __future__ import annotations

import numpy as np

from cfplan_core.geometry.polygon import FloatArray

_TOLERANCE = 1e-9


def constrained_minimum(
    h_matrix: FloatArray, f: FloatArray, rows: FloatArray, bounds: FloatArray
) -> FloatArray | None:
    """Solve the problem above.

    Args:
        h_matrix: H, symmetric and positive definite, shape (d, d).
        f: Shape (d,).
        rows: G, shape (m, d).
        bounds: h, shape (m,).

    Returns:
        a, shape (d,); None if no a fulfils the inequalities, or none was found.
    """
    free = np.linalg.solve(h_matrix, f)
    if not len(rows) or (rows @ free >= bounds - _TOLERANCE).all():
        return np.asarray(free)
    spread = np.linalg.solve(h_matrix, rows.T)
    dual = rows @ spread
    short = bounds - rows @ free
    size = np.maximum(np.sqrt(np.abs(np.diagonal(dual))), _TOLERANCE)
    active: list[int] = []
    multipliers: FloatArray = np.zeros(0)
    for _ in range(4 * len(rows) + 20):
        violation = short.copy()
        if active:
            violation -= dual[:, active] @ multipliers
        violation /= size
        violation[active] = -np.inf
        worst = int(np.argmax(violation))
        if not violation[worst] * size[worst] > _TOLERANCE:
            return np.asarray(free + spread[:, active] @ multipliers)
        active.append(worst)
        while active:
            block = dual[np.ix_(active, active)]
            multipliers = np.asarray(np.linalg.lstsq(block, short[active], rcond=1e-12)[0])
            if np.abs(block @ multipliers - short[active]).max() > 1e-7:
                return None
            if (multipliers >= -_TOLERANCE).all():
                break
            active.pop(int(np.argmin(multipliers)))
        if not active:
            multipliers = np.zeros(0)
    return None
