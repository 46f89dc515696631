from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import Result

Cfplan = Callable[..., Result]


def test_plan_of_the_planner_is_certified(
    cfplan: Cfplan, problem_file: Path, plan_file: Path
) -> None:
    result = cfplan('verify', problem_file, plan_file)
    assert result.exit_code == 0
    assert 'Certified' in result.output


def test_first_failing_frame_is_named(cfplan: Cfplan, problem_file: Path, plan_file: Path) -> None:
    document = json.loads(plan_file.read_text(encoding='utf-8'))
    document['frames'][5]['object_pose'][1] -= 1e-4
    plan_file.write_text(json.dumps(document), encoding='utf-8')
    result = cfplan('verify', problem_file, plan_file)
    assert result.exit_code == 1
    # Half-way between the frames 4 and 5 may already be wrong; that is reported with frame 4.
    assert 'First failure: frame 4' in result.output or 'First failure: frame 5' in result.output
    assert ' expected at most ' in result.output


def test_plan_for_another_problem_is_not_certified(
    cfplan: Cfplan, problem_file: Path, plan_file: Path
) -> None:
    other = problem_file.with_name('h013.yaml')
    assert cfplan('verify', other, plan_file).exit_code == 1


def test_file_that_is_not_a_plan_is_refused(cfplan: Cfplan, problem_file: Path) -> None:
    result = cfplan('verify', problem_file, problem_file)
    assert result.exit_code == 2
    assert str(problem_file) in result.output


def test_table_fits_a_narrow_terminal(
    cfplan: Cfplan, problem_file: Path, plan_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('COLUMNS', '80')
    output = cfplan('verify', problem_file, plan_file).output
    assert max(len(line) for line in output.splitlines()) <= 80
    assert '…' not in output
