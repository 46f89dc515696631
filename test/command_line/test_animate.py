from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import Result

from cfplan_core import CfplanError, PlanResult, Status, write_plan
from cfplan_core.command_line.inputs import problem_of_plan

Cfplan = Callable[..., Result]


@pytest.fixture
def heavier_file(problem_file: Path, tmp_path: Path) -> Path:
    """The same problem with another mass, to tell which file was read."""
    path = tmp_path / 'heavier.yaml'
    text = problem_file.read_text(encoding='utf-8')
    path.write_text(text.replace('mass: 0.1', 'mass: 0.2'), encoding='utf-8')
    return path


def test_animation_is_drawn_beside_the_plan(
    cfplan: Cfplan, plan_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[Path] = []
    monkeypatch.setattr(
        'cfplan_core.report.animation.write_animation',
        lambda problem, result, path, progress: drawn.append(path),
    )
    assert cfplan('animate', plan_file).exit_code == 0
    assert drawn == [plan_file.with_suffix('.gif')]


def test_given_problem_is_taken(solved: PlanResult, plan_file: Path, heavier_file: Path) -> None:
    assert problem_of_plan(solved, plan_file, heavier_file).object.mass == 0.2


def test_problem_beside_the_plan_is_taken_before_the_examples(
    solved: PlanResult, plan_file: Path, heavier_file: Path
) -> None:
    heavier_file.rename(plan_file.with_name(f'{solved.problem}.yaml'))
    assert problem_of_plan(solved, plan_file, None).object.mass == 0.2


def test_examples_of_the_working_directory_are_taken_next(
    solved: PlanResult,
    plan_file: Path,
    heavier_file: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    folder = tmp_path / 'elsewhere' / 'config' / 'problems'
    folder.mkdir(parents=True)
    heavier_file.rename(folder / f'{solved.problem}.yaml')
    monkeypatch.chdir(tmp_path / 'elsewhere')
    assert problem_of_plan(solved, plan_file, None).object.mass == 0.2


def test_examples_of_the_installation_are_taken_last(
    solved: PlanResult, plan_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert problem_of_plan(solved, plan_file, None).object.mass == 0.1


def test_file_of_another_problem_is_refused(
    solved: PlanResult, plan_file: Path, problem_file: Path
) -> None:
    with pytest.raises(CfplanError, match='h013'):
        problem_of_plan(solved, plan_file, problem_file.with_name('h013.yaml'))


@pytest.mark.parametrize('name', ['unheard_of', '../problems/h013'])
def test_problem_that_is_nowhere_is_asked_for(name: str, cfplan: Cfplan, plan_file: Path) -> None:
    text = plan_file.read_text(encoding='utf-8')
    plan_file.write_text(text.replace('trinkle_hunter_1991', name), encoding='utf-8')
    result = cfplan('animate', plan_file)
    assert result.exit_code == 2
    assert '--problem' in result.output


def test_plan_without_frames_is_refused(cfplan: Cfplan, tmp_path: Path) -> None:
    path = tmp_path / 'plan.json'
    write_plan(PlanResult('trinkle_hunter_1991', Status.INFEASIBLE, ('a',), message='no'), path)
    result = cfplan('animate', path)
    assert result.exit_code == 2
    assert 'infeasible' in result.output


def test_output_that_is_neither_gif_nor_mp4_is_refused(cfplan: Cfplan, plan_file: Path) -> None:
    assert cfplan('animate', plan_file, '-o', plan_file.with_suffix('.tiff')).exit_code == 2
