"""Root finding inside a bracket, for functions that are evaluated at many places at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cfplan_core.geometry.polygon import FloatArray

_WIDTH = 1e-8
_CLOSE = np.array([-0.1, -1e-2, -1e-3, -1e-4, -1e-6, 1e-6, 1e-4, 1e-3, 1e-2, 0.1])


def enclose(
    function: Callable[[FloatArray], FloatArray], width: float = _WIDTH
) -> tuple[float, float]:
    """Enclose a root of a function that changes its sign between 0 and 1.

    Inverse polynomial interpolation, kept inside a bracket. The function is evaluated at several
    places at once, which costs hardly more than at one: first spread over the interval, then
    around the interpolated root at ever smaller distances on either side.

    Args:
        function: Maps places, shape (s,), to values, shape (s,).
        width: Widest interval to return.

    Returns:
        Ends of an interval in which the sign changes.
    """
    places = np.linspace(0.0, 1.0, 9)
    values = function(places)
    while True:
        first = int(np.argmax((values > 0.0) != (values[0] > 0.0)))
        low, high = float(places[first - 1]), float(places[first])
        if high - low <= width or first == 0:
            return low, high
        guess = _inverse(places, values, first)
        if not low < guess < high:
            guess = 0.5 * (low + high)
        more = np.concatenate([guess + (high - low) * _CLOSE, [0.5 * (low + high)]])
        more = np.unique(more[(more > low) & (more < high)])
        kept = slice(max(first - 3, 0), first)
        places = np.concatenate([places[kept], more, [high]])
        values = np.concatenate([values[kept], function(more), [values[first]]])


def _inverse(places: FloatArray, values: FloatArray, first: int) -> float:
    """Place of value zero on the polynomial place(value) through neighbours of the root.

    Margins have a kink where they are zero: four points before it are better than some on either
    side.
    """
    near = slice(first - 4, first) if first >= 4 else slice(0, first + 1)
    x, y = places[near], values[near]
    total = 0.0
    for i, (place, value) in enumerate(zip(x, y, strict=True)):
        others = np.delete(y, i)
        if (others == value).any():
            return float(np.nan)
        total += float(place * np.prod(others / (others - value)))
    return total
