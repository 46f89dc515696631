"""No command writes over what it reads, or works for a file that it cannot write."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import Result

from cfplan_core import CfplanError
from cfplan_core.command_line.outputs import check_outputs

Cfplan = Callable[..., Result]

PROBLEM = Path(__file__).parents[2] / 'config' / 'problems' / 'h020.yaml'


def test_a_problem_is_not_overwritten_by_its_plan(cfplan: Cfplan, tmp_path: Path) -> None:
    problem = tmp_path / 'h020.yaml'
    shutil.copy(PROBLEM, problem)
    other_name = tmp_path / 'link.yaml'
    other_name.symlink_to(problem)
    for target in (problem, other_name):
        result = cfplan('plan', problem, '--json', target)
        assert result.exit_code == 2
        assert 'a file that is read; expected another file' in result.stderr
    assert problem.read_text() == PROBLEM.read_text()


def test_a_study_is_not_overwritten_by_its_parquet(cfplan: Cfplan, tmp_path: Path) -> None:
    log = tmp_path / 's.csv'
    log.write_text('kept')
    result = cfplan('study', PROBLEM, '-o', log, '--parquet', log)
    assert result.exit_code == 2
    assert 'the file of --output; expected another file' in result.stderr
    assert log.read_text() == 'kept'


def test_missing_folders_are_created_and_impossible_ones_are_named(tmp_path: Path) -> None:
    check_outputs({'--figure': tmp_path / 'a' / 'b' / 'f.png', '--record': None}, [None])
    assert (tmp_path / 'a' / 'b').is_dir()
    file = tmp_path / 'file'
    file.touch()
    with pytest.raises(CfplanError, match=r'--figure: cannot write .*f\.png'):
        check_outputs({'--figure': file / 'f.png'}, [])
    with pytest.raises(CfplanError, match=r'--figure: got the folder .*, expected a file'):
        check_outputs({'--figure': tmp_path}, [])
