"""Time-optimal motion along a path, by reachability analysis (Pham & Pham, TOPP-RA, 2018).

Of a coordinate q(s) the velocity is q' ṡ and the acceleration q' s̈ + q'' ṡ². Limits on both are
linear in s̈ and ṡ², and toppra finds the largest ṡ that can be sped up to and stopped from.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from cfplan_core.errors import CfplanError
from cfplan_core.geometry.polygon import FloatArray

# Steps that a stretch is divided into at least.
_FEWEST = 8
# The largest acceleration turns into its opposite at once: cubics through the frames need a little
# more time for that everywhere, or, with less loss, a peak that is rounded off.
_SMOOTHINGS = 3
_TINY = 1e-12


def fastest_steps(path: FloatArray, velocity: FloatArray, acceleration: FloatArray) -> FloatArray:
    """Time the steps of a smooth path from rest to rest.

    Args:
        path: Shape (f, m): coordinates at the frames.
        velocity: Shape (f - 1, m): limits on each step, inf for none.
        acceleration: Shape (m,): limits, inf for none.

    Returns:
        Shape (f - 1,), s: the least times, as near as the path between frames is known; zero where
        nothing moves. Where no motion keeps the limits at rest or the path is too crooked to
        tell, those with which each step alone keeps its velocity limits.
    """
    changes = np.diff(path, axis=0)
    lengths = np.linalg.norm(changes, axis=1)
    alone = np.asarray((np.abs(changes) / velocity).max(axis=1, initial=0.0))
    if (lengths <= _TINY).any():
        return alone
    parts = -(-_FEWEST // len(lengths))
    grid, first, second = _derivatives(changes, lengths, parts)
    speeds = _largest_speeds(first, velocity, parts)
    used = np.isfinite(acceleration)
    profile = _profile(grid, first[:, used], second[:, used], speeds, acceleration[used])
    if profile is None:
        return alone
    for _ in range(_SMOOTHINGS):
        squares = profile**2
        profile[1:-1] = np.sqrt(0.25 * squares[:-2] + 0.5 * squares[1:-1] + 0.25 * squares[2:])
    mean = 0.5 * (profile[1:] + profile[:-1])
    if not (mean > 0.0).all():
        return alone
    return np.asarray((np.diff(grid) / mean).reshape(-1, parts).sum(axis=1))


def _derivatives(
    changes: FloatArray, lengths: FloatArray, parts: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Path parameter, shape (g,), and first and second derivatives, (g, m), on a grid.

    The parameter is the length of the path; every step is divided into equal parts. Derivatives
    are those of parabolas through three frames, and linear in between.
    """
    secants = changes / lengths[:, None]
    first = np.repeat(secants[:1], len(lengths) + 1, axis=0)
    second = np.zeros_like(first)
    if len(lengths) > 1:
        before, after = lengths[:-1, None], lengths[1:, None]
        second[1:-1] = 2.0 * (secants[1:] - secants[:-1]) / (before + after)
        second[0], second[-1] = second[1], second[-2]
        first[1:-1] = (after * secants[:-1] + before * secants[1:]) / (before + after)
        first[0] = secants[0] - 0.5 * lengths[0] * second[0]
        first[-1] = secants[-1] + 0.5 * lengths[-1] * second[-1]
    frames = np.concatenate([[0.0], np.cumsum(lengths)])
    if parts == 1:
        return frames, first, second
    index = np.arange(len(lengths) * parts + 1)
    step = np.minimum(index // parts, len(lengths) - 1)
    share = (index / parts - step)[:, None]
    grid = frames[step] + share[:, 0] * lengths[step]
    return (
        grid,
        (1.0 - share) * first[step] + share * first[step + 1],
        (1.0 - share) * second[step] + share * second[step + 1],
    )


def _largest_speeds(first: FloatArray, velocity: FloatArray, parts: int) -> FloatArray:
    """Largest ṡ that keeps velocity limits at each point of the grid: of the steps beside it."""
    limits = np.repeat(velocity, parts, axis=0)
    limits = np.minimum(
        np.concatenate([limits[:1], limits]), np.concatenate([limits, limits[-1:]])
    )
    return np.asarray(1.0 / np.maximum((np.abs(first) / limits).max(axis=1), _TINY))


def _profile(
    grid: FloatArray,
    first: FloatArray,
    second: FloatArray,
    speeds: FloatArray,
    acceleration: FloatArray,
) -> FloatArray | None:
    """Run TOPP-RA: ṡ on the grid, shape (g,), or None."""
    solver, limits = import_toppra()
    problem = solver(
        [limits(first, second, speeds, acceleration)],
        _Path(first.shape[1], grid[[0, -1]]),
        grid,
    )
    _, profile, _ = problem.compute_parameterization(0.0, 0.0)
    return None if profile is None or np.isnan(profile).any() else np.asarray(profile)


class _Path(NamedTuple):
    """What toppra asks of a path whose constraints bring their own derivatives."""

    dof: int
    path_interval: FloatArray


@cache
def import_toppra() -> tuple[Any, Any]:
    """Import TOPP-RA, and with it a constraint of velocity and acceleration on a grid.

    It costs a third of a second the first time; who wants to be quick later calls it early.

    Raises:
        CfplanError: It is not installed.
    """
    try:
        with _drawing_put_off():
            from toppra.algorithm import TOPPRA
            from toppra.algorithm.algorithm import ParameterizationAlgorithm
            from toppra.constraint import LinearConstraint
            from toppra.solverwrapper.cy_seidel_solverwrapper import seidelWrapper
    except ImportError as error:
        raise CfplanError(
            f'plans are timed by toppra: {error}; install it with pip install toppra'
        ) from error

    class Solver(TOPPRA):  # type: ignore[misc]
        """With its own solver; TOPPRA's constructor looks on disk for others each time."""

        def __init__(self, constraints: list[Any], path: _Path, grid: FloatArray) -> None:
            ParameterizationAlgorithm.__init__(self, constraints, path, gridpoints=grid)
            self.solver_wrapper = seidelWrapper(constraints, path, self.gridpoints, True)

    class Limits(LinearConstraint):  # type: ignore[misc]
        """Bounds of ṡ, and |q' s̈ + q'' ṡ²| within limits at each point of the grid."""

        def __init__(
            self,
            first: FloatArray,
            second: FloatArray,
            speeds: FloatArray,
            acceleration: FloatArray,
        ) -> None:
            super().__init__()
            self.dof = first.shape[1]
            self.identical = True
            bounds = np.column_stack([np.zeros_like(speeds), speeds**2])
            both = np.concatenate([np.eye(self.dof), -np.eye(self.dof)])
            limit = np.concatenate([acceleration, acceleration])
            still = np.zeros_like(first)
            self._parameters = (first, second, still, both, limit, None, bounds)

        def compute_constraint_params(self, *_: object) -> tuple[FloatArray | None, ...]:
            return self._parameters

    return Solver, Limits


@contextmanager
def _drawing_put_off() -> Iterator[None]:
    """Let modules import pyplot for a quarter of a second less: it is loaded when it is used."""
    name = 'matplotlib.pyplot'
    if name in sys.modules:
        yield
        return
    stand_in = ModuleType(name)

    def put_back() -> None:
        if sys.modules.get(name) is stand_in:
            del sys.modules[name]

    def load(wanted: str) -> object:
        put_back()
        return getattr(import_module(name), wanted)

    vars(stand_in)['__getattr__'] = load
    sys.modules[name] = stand_in
    try:
        yield
    finally:
        put_back()
