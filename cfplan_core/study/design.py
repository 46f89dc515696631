"""The runs of a study: a grid of the values that are listed, a sample of the ranges."""

from __future__ import annotations

import hashlib
import itertools
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from cfplan_core import __version__
from cfplan_core.errors import CfplanError
from cfplan_core.model import Problem
from cfplan_core.study.parameters import (
    PARAMETERS,
    Value,
    Variation,
    execution_options,
    plan_options,
)

# Keeps what is drawn for ranges apart from the errors that an execution draws with the same seed
# and number.
_RANGES = 1
_KEY_LENGTH = 16


@dataclass(frozen=True, eq=False)
class StudyRun:
    """One plan and its execution once.

    Attributes:
        key: Of everything that decides what becomes of it.
        problem: What is planned.
        digest: Of the problem's content.
        values: Of all parameters, by name.
        seed: Of the study.
        sample: Which draw of the ranges, and of the world that the plan is executed in.
    """

    key: str
    problem: Problem
    digest: str
    values: Mapping[str, Value]
    seed: int
    sample: int


def design_study(
    problems: Sequence[Problem], variations: Sequence[Variation], samples: int, seed: int
) -> tuple[StudyRun, ...]:
    """List the runs of a study: every problem with every combination of the listed values.

    Each combination is run `samples` times: in run k the ranges take their k-th values, which all
    combinations share, and the plan is executed in the k-th world of the seed. More samples of
    the same seed begin with the same runs.

    Args:
        problems: With different names.
        variations: Of different parameters.
        samples: At least 1.
        seed: Not negative.

    Raises:
        CfplanError: Problems share a name, or a value or number is not possible.
    """
    if samples < 1:
        raise CfplanError(f'samples: got {samples}, expected a number above zero')
    if seed < 0:
        raise CfplanError(f'seed: got {seed}, expected a whole number from 0')
    names = [problem.name for problem in problems]
    for name in names:
        if names.count(name) > 1:
            raise CfplanError(f'got {names.count(name)} problems of the name {name!r}, expected 1')
    lists = [variation for variation in variations if variation.bounds is None]
    grid = [
        dict(zip((v.name for v in lists), combination, strict=True))
        for combination in itertools.product(*(v.values for v in lists))
    ]
    draws = [_drawn(variations, seed, sample) for sample in range(samples)]
    defaults = {name: parameter.default for name, parameter in PARAMETERS.items()}
    runs = []
    for problem in problems:
        digest = problem_digest(problem)
        for cell, (sample, drawn) in itertools.product(grid, enumerate(draws)):
            values = {**defaults, **cell, **drawn}
            _refuse_impossible(values, seed)
            key = run_key(digest, values, seed, sample)
            runs.append(StudyRun(key, problem, digest, values, seed, sample))
    return tuple(runs)


def _drawn(variations: Sequence[Variation], seed: int, sample: int) -> dict[str, float]:
    """Draw the ranges' values of one sample; a parameter's do not depend on what else varies."""
    parts = np.random.default_rng([seed, sample, _RANGES]).uniform(size=len(PARAMETERS))
    by_name = dict(zip(PARAMETERS, parts, strict=True))
    drawn = {}
    for variation in variations:
        if variation.bounds is not None:
            low, high = variation.bounds
            value = low + (high - low) * by_name[variation.name]
            drawn[variation.name] = float(f'{value:.6g}')
    return drawn


def _refuse_impossible(values: Mapping[str, Value], seed: int) -> None:
    plan_options(values)
    execution_options(values, seed)


def run_key(digest: str, values: Mapping[str, Value], seed: int, sample: int) -> str:
    """Name a run by what decides its outcome: problem, parameters, seed, sample, cfplan's version.

    Args:
        digest: Of the problem.
        values: Of all parameters.
        seed: Of the study.
        sample: Number of the run in its combination.
    """
    return _digest([__version__, digest, dict(values), seed, sample])[:_KEY_LENGTH]


def problem_digest(problem: Problem) -> str:
    """Digest of a problem's content, wherever its files are and however they are written."""
    return _digest(asdict(problem))


def _digest(data: object) -> str:
    text = json.dumps(data, sort_keys=True, default=_plain)
    return hashlib.sha256(text.encode()).hexdigest()


def _plain(value: object) -> object:
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Mapping):
        return dict(value)
    raise TypeError(f'no digest of {type(value).__name__}')
