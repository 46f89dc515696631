from __future__ import annotations

import io
import json
import os
import signal
import subprocess
import threading
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from click.testing import Result
from rich.console import Console

import cfplan_core.command_line.progress
from cfplan_core import PlanOptions, PlanResult, Problem, Progress, Status, read_plan

Cfplan = Callable[..., Result]
Replace = Callable[[Callable[..., object]], None]
EndingWith = Callable[[Status], Callable[..., PlanResult]]


@pytest.mark.parametrize(
    ('status', 'exit_status'),
    [(Status.INFEASIBLE, 1), (Status.INVALID, 2), (Status.BUDGET_EXHAUSTED, 3)],
)
def test_outcome_is_the_exit_status(
    status: Status,
    exit_status: int,
    cfplan: Cfplan,
    replace_planner: Replace,
    ending_with: EndingWith,
    problem_file: Path,
) -> None:
    replace_planner(ending_with(status))
    result = cfplan('plan', problem_file)
    assert result.exit_code == exit_status
    assert 'as told' in result.output


def test_solved_plan_is_written_and_drawn(
    cfplan: Cfplan, problem_file: Path, tmp_path: Path
) -> None:
    path = tmp_path / 'new' / 'plan.json'
    figures = tmp_path / 'figures'
    result = cfplan('plan', problem_file, '--json', path, '--figures', figures)
    assert result.exit_code == 0
    assert read_plan(path).solved
    drawn = {figure.name.partition('_')[0] for figure in figures.glob('*.png')}
    assert drawn == {'fig3', 'fig4', 'fig5', 'fig6', 'fig7'}


def test_segments_are_printed(cfplan: Cfplan, solved: PlanResult, problem_file: Path) -> None:
    output = cfplan('plan', problem_file).output
    for contact in solved.segments[0].contacts:
        assert contact in output


def test_budgets_reach_the_planner(
    cfplan: Cfplan, replace_planner: Replace, ending_with: EndingWith, problem_file: Path
) -> None:
    seen: list[PlanOptions] = []

    def fake(problem: Problem, options: PlanOptions, **_: object) -> PlanResult:
        seen.append(options)
        return ending_with(Status.BUDGET_EXHAUSTED)(problem)

    replace_planner(fake)
    cfplan('plan', problem_file, '--time-budget', '1.5', '--max-nodes', '7')
    assert [(options.time_budget, options.max_nodes) for options in seen] == [(1.5, 7)]


@pytest.mark.parametrize(
    'arguments',
    [
        ('--time-budget', '-1'),
        ('--time-budget', '0'),
        ('--time-budget', 'nan'),
        ('--time-budget', 'inf'),
        ('--time-budget', 'soon'),
        ('--max-nodes', '-3'),
        ('--max-nodes', '0'),
        ('--max-nodes', '1.5'),
        ('--no-such-option',),
    ],
)
def test_bad_option_is_a_usage_error(
    arguments: Sequence[str], cfplan: Cfplan, problem_file: Path
) -> None:
    result = cfplan('plan', problem_file, *arguments)
    assert result.exit_code == 2
    assert arguments[0] in result.output


def test_invalid_problem_becomes_an_invalid_plan(
    cfplan: Cfplan, broken_file: Path, tmp_path: Path
) -> None:
    path = tmp_path / 'plan.json'
    assert cfplan('plan', broken_file, '--json', path).exit_code == 2
    document = json.loads(path.read_text(encoding='utf-8'))
    assert document['status'] == 'invalid'
    assert 'object.mass' in document['message']
    assert 'base_angle' in document['message']


def test_file_that_is_no_problem_becomes_an_invalid_plan(cfplan: Cfplan, tmp_path: Path) -> None:
    (tmp_path / 'list.yaml').write_text('[1, 2]\n')
    path = tmp_path / 'plan.json'
    assert cfplan('plan', tmp_path / 'list.yaml', '--json', path).exit_code == 2
    assert read_plan(path).status is Status.INVALID


def test_unwritable_output_is_refused_before_planning(
    cfplan: Cfplan, replace_planner: Replace, problem_file: Path, tmp_path: Path
) -> None:
    (tmp_path / 'file').touch()
    replace_planner(lambda *_, **__: pytest.fail('planned'))
    result = cfplan('plan', problem_file, '--json', tmp_path / 'file' / 'plan.json')
    assert result.exit_code == 2
    assert str(tmp_path / 'file') in result.output


def test_interrupt_cancels_the_search_and_writes_nothing(
    cfplan: Cfplan,
    replace_planner: Replace,
    ending_with: EndingWith,
    problem_file: Path,
    tmp_path: Path,
) -> None:
    def fake(problem: Problem, *_: object, cancel: threading.Event, **__: object) -> PlanResult:
        os.kill(os.getpid(), signal.SIGINT)
        assert cancel.wait(5.0)
        return ending_with(Status.BUDGET_EXHAUSTED)(problem)

    replace_planner(fake)
    path = tmp_path / 'plan.json'
    assert cfplan('plan', problem_file, '--json', path).exit_code == 130
    assert not path.exists()


def test_second_interrupt_does_not_wait_for_the_search(
    cfplan: Cfplan, replace_planner: Replace, problem_file: Path
) -> None:
    def fake(*_: object, cancel: threading.Event, **__: object) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        assert cancel.wait(5.0)
        os.kill(os.getpid(), signal.SIGINT)
        pytest.fail('still searching')

    replace_planner(fake)
    assert cfplan('plan', problem_file).exit_code == 130


def test_interrupted_process_leaves_no_traceback(
    start_cfplan: Callable[..., subprocess.Popen[str]], problem_file: Path
) -> None:
    endless = """
import cfplan_core.planner as planner
from cfplan_core import PlanResult, Status

def search(problem, options, progress, cancel):
    print('searching', flush=True)
    cancel.wait(30.0)
    return PlanResult(problem.name, Status.BUDGET_EXHAUSTED, ())

planner.plan = search
"""
    process = start_cfplan('plan', problem_file, first=endless, stdout=subprocess.PIPE)
    assert process.stdout is not None
    assert process.stdout.readline() == 'searching\n'
    process.send_signal(signal.SIGINT)
    _, complaint = process.communicate(timeout=20.0)
    assert process.returncode == 130
    assert complaint == 'cfplan: interrupted; nothing is written\n'


def test_progress_is_shown_on_a_terminal(
    cfplan: Cfplan,
    replace_planner: Replace,
    ending_with: EndingWith,
    problem_file: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    screen = io.StringIO()
    terminal = Console(file=screen, force_terminal=True, width=80)
    monkeypatch.setattr(cfplan_core.command_line.progress, 'complaints', lambda: terminal)

    def fake(
        problem: Problem, *_: object, progress: Callable[[Progress], None], **__: object
    ) -> PlanResult:
        progress(Progress(elapsed=0.5, nodes=(3, 4), formations=12, message=''))
        return ending_with(Status.INFEASIBLE)(problem)

    replace_planner(fake)
    cfplan('plan', problem_file, '--time-budget', '1')
    assert '3 + 4 nodes, 12 formations' in screen.getvalue()


def test_no_progress_is_asked_for_without_a_terminal(
    cfplan: Cfplan, replace_planner: Replace, ending_with: EndingWith, problem_file: Path
) -> None:
    seen: list[object] = []

    def fake(problem: Problem, *_: object, progress: object, **__: object) -> PlanResult:
        seen.append(progress)
        return ending_with(Status.INFEASIBLE)(problem)

    replace_planner(fake)
    cfplan('plan', problem_file)
    assert seen == [None]


@pytest.mark.parametrize('width', [80, 160])
def test_tables_fit_the_terminal(
    width: int, cfplan: Cfplan, problem_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('COLUMNS', str(width))
    output = cfplan('plan', problem_file).output
    assert max(len(line) for line in output.splitlines()) <= width
