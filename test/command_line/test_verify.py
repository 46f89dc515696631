from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import Result

from cfplan_core.verification.checks import CHECKS

Cfplan = Callable[..., Result]


def test_plan_of_the_planner_is_certified(
    cfplan: Cfplan, problem_file: Path, plan_file: Path
) -> None:
    result = cfplan('verify', problem_file, plan_file)
    assert result.exit_code == 0
    assert 'Certified' in result.output


def test_certificate_is_one_line_unless_every_check_is_asked_for(
    cfplan: Cfplan, problem_file: Path, plan_file: Path
) -> None:
    assert len(cfplan('verify', problem_file, plan_file).output.splitlines()) == 1
    verbose = cfplan('verify', '--verbose', problem_file, plan_file).output
    assert len(verbose.splitlines()) > len(CHECKS)
    assert 'Certified' in verbose


def test_only_failed_checks_are_listed(
    cfplan: Cfplan, problem_file: Path, plan_file: Path
) -> None:
    document = json.loads(plan_file.read_text(encoding='utf-8'))
    document['frames'][-1]['torque_upper'][0] = 7.0
    plan_file.write_text(json.dumps(document), encoding='utf-8')
    output = cfplan('verify', problem_file, plan_file).output
    assert 'torque limits at the ends of segments' in output
    assert 'time strictly increases' not in output


def test_segments_are_counted_as_in_the_table_of_the_plan(
    cfplan: Cfplan, problem_file: Path, plan_file: Path
) -> None:
    document = json.loads(plan_file.read_text(encoding='utf-8'))
    document['segments'][-1]['contacts'].pop()
    plan_file.write_text(json.dumps(document), encoding='utf-8')
    output = cfplan('verify', problem_file, plan_file).output
    assert f'segment {len(document["segments"])} does not name' in output


def test_example_of_the_documentation_is_solved_and_certified(
    cfplan: Cfplan, tmp_path: Path
) -> None:
    text = (Path(__file__).parents[2] / 'docs' / 'file-formats.md').read_text(encoding='utf-8')
    example = tmp_path / 'my_problem.yaml'
    example.write_text(text.split('```yaml\n')[1].split('```')[0], encoding='utf-8')
    assert cfplan('plan', example, '--json', tmp_path / 'plan.json').exit_code == 0
    assert cfplan('verify', example, tmp_path / 'plan.json').exit_code == 0


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
    output = cfplan('verify', '--verbose', problem_file, plan_file).output
    assert max(len(line) for line in output.splitlines()) <= 80
    assert '…' not in output
