"""Form closure and first-order stability by the sign of 3 × 3 determinants.

Vectors of rank 3 positively span R³ if and only if no closed half-space holds them all. A cone
that is not all of R³ has a supporting plane through two independent ones of its generators, so it
suffices to look at the planes through all pairs: on either side of each must lie a vector.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from cfplan_core.contact.system import BoolArray, IntArray
from cfplan_core.geometry.polygon import FloatArray

_PARALLEL = 1e-9
_COPLANAR = 1e-9


class _Planes(NamedTuple):
    """Index tables for k vectors.

    Attributes:
        first: Shape (p,): with `second` all pairs of vectors, each spanning a plane.
        second: Shape (p,).
        pair: Shape (p, 1): 0 to p - 1.
        others: Shape (p, k - 2): the vectors that are not in the pair.
        rest: Shape (p,), true for pairs without the last vector.
    """

    first: IntArray
    second: IntArray
    pair: IntArray
    others: IntArray
    rest: BoolArray


@lru_cache(maxsize=64)
def _planes(count: int) -> _Planes:
    first, second = np.triu_indices(count, 1)
    others = [
        [k for k in range(count) if k not in pair] for pair in zip(first, second, strict=True)
    ]
    table = np.array(others, dtype=np.intp).reshape(len(first), max(count - 2, 0))
    return _Planes(first, second, np.arange(len(first))[:, None], table, second < count - 1)


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
    rest = _planes(count).rest
    # Every triple is there in both orientations: one comparison shows both signs.
    signs = height > _COPLANAR
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
    first, second = _planes(vectors.shape[1])[:2]
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
    planes = _planes(count)
    others = height[:, planes.pair, planes.others]
    emptier = np.minimum(others.max(axis=-1), -others.min(axis=-1))
    emptier[length <= _PARALLEL] = np.inf
    smallest = (emptier / np.maximum(length, _PARALLEL)).min(axis=-1)
    smallest[np.isinf(smallest)] = -1.0
    return np.asarray(smallest)
