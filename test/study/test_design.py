"""The runs of a study: which there are, and what their keys depend on."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cfplan_core import CfplanError, Problem, load_problem
from cfplan_core.study.design import StudyRun, design_study, problem_digest

Design = Callable[..., tuple[StudyRun, ...]]


def test_listed_values_are_combined_with_each_other_and_the_problems(design: Design) -> None:
    runs = design('friction=0,0.1', 'prefer=first,robust', 'gain=20', samples=3)
    combinations = {
        (r.problem.name, r.values['friction'], r.values['prefer'], r.sample) for r in runs
    }
    assert len(runs) == len(combinations) == 2 * 2 * 2 * 3
    assert {r.values['gain'] for r in runs} == {20.0}


def test_ranges_are_filled_evenly(design: Design) -> None:
    runs = design('mass-error=0.1:0.3', 'friction=0:1', samples=1000)
    drawn = np.array([[r.values[n] for n in ('mass-error', 'friction')] for r in runs[:1000]])
    assert drawn.min(axis=0) == pytest.approx([0.1, 0.0], abs=0.01)
    assert drawn.max(axis=0) == pytest.approx([0.3, 1.0], abs=0.01)
    assert drawn.mean(axis=0) == pytest.approx([0.2, 0.5], abs=0.03)
    assert abs(np.corrcoef(drawn.T)[0, 1]) < 0.1


def test_combinations_share_the_draws(design: Design) -> None:
    runs = design('mass-error=0:0.2', 'friction=0,0.1', samples=5)
    by_sample: dict[int, set[object]] = {}
    for run in runs:
        by_sample.setdefault(run.sample, set()).add(run.values['mass-error'])
    assert all(len(values) == 1 for values in by_sample.values())
    assert len({run.values['mass-error'] for run in runs}) == 5


def test_more_samples_begin_with_the_same_runs(design: Design) -> None:
    few, many = (design('mass-error=0:0.2', samples=n) for n in (3, 8))
    assert {run.key for run in few} < {run.key for run in many}


def test_draws_do_not_depend_on_what_else_varies(design: Design) -> None:
    alone = design('mass-error=0:0.2', samples=3)
    beside = design('gain=1:2', 'mass-error=0:0.2', 'friction=0:1', samples=3)
    assert [r.values['mass-error'] for r in alone] == [r.values['mass-error'] for r in beside]


def test_another_seed_draws_others(design: Design) -> None:
    first, other = (design('mass-error=0:0.2', seed=seed) for seed in (0, 1))
    assert first[0].values['mass-error'] != other[0].values['mass-error']


def test_keys_are_different_for_all_that_decides_the_outcome(
    design: Design, problems: tuple[Problem, ...]
) -> None:
    heavier = replace(problems[0], object=replace(problems[0].object, mass=0.2))
    keys = [r.key for r in design('friction=0,0.1', samples=2)]
    keys += [r.key for r in design('friction=0,0.1', samples=2, seed=1)]
    keys += [r.key for r in design_study([heavier], (), 1, 0)]
    assert len(set(keys)) == 8 + 8 + 1


def test_key_is_the_same_in_every_process(design: Design) -> None:
    code = (
        'from cfplan_core import load_problem; from cfplan_core.study.design import *\n'
        f'print(design_study([load_problem({str(_h020())!r})], (), 1, 0)[0].key)'
    )
    ran = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == design()[0].key


def test_digest_is_of_the_content_and_not_of_the_file(
    tmp_path: Path, problems: tuple[Problem, ...]
) -> None:
    copy = tmp_path / 'copy.yaml'
    copy.write_text(f'# a comment\n{_h020().read_text(encoding="utf-8")}', encoding='utf-8')
    assert problem_digest(load_problem(copy)) == problem_digest(problems[0])


def test_impossible_study_is_refused(design: Design, problems: tuple[Problem, ...]) -> None:
    for arguments, message in (
        ({'samples': 0}, 'samples: got 0'),
        ({'seed': -1}, 'seed: got -1'),
    ):
        with pytest.raises(CfplanError, match=message):
            design(**arguments)
    with pytest.raises(CfplanError, match=r'friction: got 11\.0, expected 0 to 10'):
        design('friction=0,11')
    with pytest.raises(CfplanError, match="2 problems of the name 'h020'"):
        design_study([problems[0], problems[0]], (), 1, 0)


def _h020() -> Path:
    return Path(__file__).parents[2] / 'config' / 'problems' / 'h020.yaml'
