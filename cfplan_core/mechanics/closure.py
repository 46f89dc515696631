"""Form closure and first-order stability by the sign of 3 × 3 determinants.

Vectors of rank 3 positively span R³ if and only if no closed half-space holds them all. A cone
that is not all of R³ has a supporting plane through two independent ones of its generators, so it
suffices to look at the planes through all pairs: on either side of each must lie a vector.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from cfplan_core.contact.system import BoolArray, IntArray
from cfplan_core.geometry.polygon import FloatArray

_PARALLEL = 1e-9
_COPLANAR = 1e-9


@lru_cache(maxsize=64)
def _planes(count: int) -> tuple[IntArray, IntArray, FloatArray]:
    """Pairs of vectors, and for each pair a huge value at its own two vectors, else zero."""
    first, second = np.triu_indices(count, 1)
    own = np.zeros((len(first), count))
    rows = np.arange(len(first))
    own[rows, first] = own[rows, second] = 1e9
    return first, second, own


def span_margin(vectors: FloatArray) -> FloatArray:
    """How far vectors are from failing to positively span R³.

    Args:
        vectors: Shape (s, k, 3), rows are the vectors.

    Returns:
        Shape (s,): over all planes through two of the vectors, the smallest distance to which the
        others reach on the plane's emptier side. Positive if and only if the vectors positively
        span R³. Continuous in the vectors but where two become parallel: there it may jump,
        between values of one sign. -1 for fewer than four vectors or rank below two.
    """
    height, length = _heights(vectors)
    return _margin(height, length)


def span_margins(vectors: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Judge vectors, and all of them but the last.

    Args:
        vectors: Shape (s, k, 3).

    Returns:
        `span_margin` of all and of all but the last, each of shape (s,), and the signs of the
        determinants of all triples, shape (s, m): where they do not change along a path, whether
        the vectors span does not change either.
    """
    height, length = _heights(vectors)
    count = vectors.shape[1]
    rest = _planes(count)[1] < count - 1
    signs = np.concatenate([height > _COPLANAR, height < -_COPLANAR], axis=1)
    return (
        _margin(height, length),
        _margin(height[:, rest, :-1], length[:, rest]),
        signs.reshape(len(vectors), -1),
    )


def _heights(vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Heights of all vectors over all planes, times the plane's length, which is returned too.

    Args:
        vectors: Shape (s, k, 3).

    Returns:
        Shapes (s, p, k) and (s, p) for the p pairs of vectors.
    """
    first, second, _ = _planes(vectors.shape[1])
    a, b = vectors[:, first], vectors[:, second]
    normal = np.empty_like(a)
    normal[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    normal[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    normal[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    length = np.sqrt(np.einsum('spi,spi->sp', normal, normal))
    return normal @ vectors.transpose(0, 2, 1), length


def _margin(height: FloatArray, length: FloatArray) -> FloatArray:
    count = height.shape[-1]
    if count < 4:
        return np.full(len(height), -1.0)
    own = _planes(count)[2]
    emptier = np.minimum((height - own).max(axis=-1), -(height + own).min(axis=-1))
    margin = np.where(length > _PARALLEL, emptier / np.maximum(length, _PARALLEL), np.inf)
    smallest = margin.min(axis=-1)
    return np.where(np.isfinite(smallest), smallest, -1.0)
