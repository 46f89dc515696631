"""Bases of linear programs in three rows, solved by enumeration for all configurations at once."""

from __future__ import annotations

from functools import lru_cache
from itertools import combinations

import numpy as np

from cfplan_core.contact.system import IntArray
from cfplan_core.geometry.polygon import FloatArray


@lru_cache(maxsize=128)
def subsets(count: int, size: int) -> IntArray:
    """All choices of so many of the first numbers, shape (choices, size)."""
    return np.array(list(combinations(range(count), size)), dtype=np.intp).reshape(-1, size)


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross products of vectors, shape (..., 3); np.cross spends most of its time on checks."""
    return np.stack(
        [
            a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1],
            a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2],
            a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0],
        ],
        axis=-1,
    )


def dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Dot products of vectors, shapes (..., 3) and (...)."""
    return np.asarray((a * b).sum(axis=-1))
