from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from cfplan_core import Problem, load_problem
from cfplan_core.study.design import StudyRun, design_study
from cfplan_core.study.parameters import parse_variations

PROBLEMS = Path(__file__).parents[2] / 'config' / 'problems'


@pytest.fixture(scope='session')
def problems() -> tuple[Problem, ...]:
    return tuple(load_problem(PROBLEMS / f'{name}.yaml') for name in ('h020', 'h122'))


@pytest.fixture(scope='session')
def design(problems: tuple[Problem, ...]) -> Callable[..., tuple[StudyRun, ...]]:
    """Design a study of the two problems from variations as text."""

    def designed(*variations: str, samples: int = 1, seed: int = 0) -> tuple[StudyRun, ...]:
        return design_study(problems, parse_variations(variations), samples, seed)

    return designed
