"""One run of a study is a plan and its execution."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from cfplan_core import CfplanError, ExecutionOptions, Problem, Uncertainty, plan
from cfplan_core.execution.execute import Executor
from cfplan_core.execution.trials import run_trials
from cfplan_core.study import running
from cfplan_core.study.design import StudyRun
from cfplan_core.study.record import MEASURES, Record, Verdict
from cfplan_core.study.running import run_once

pytest.importorskip('mujoco')

Design = Callable[..., tuple[StudyRun, ...]]


def _measure(record: Record, name: str) -> float | None:
    return record.measures[MEASURES.index(name)]


def test_samples_are_the_trials_of_the_same_seed(
    design: Design, problems: tuple[Problem, ...]
) -> None:
    runs = design('friction=0.3', 'mass-error=0.2', 'joint-noise=3', samples=2, seed=5)[:2]
    uncertainty = Uncertainty(0.3, 0.2, joint_noise=math.radians(3.0))
    options = ExecutionOptions(uncertainty, 5)
    trials = run_trials(Executor(problems[0], plan(problems[0]), options), 2)
    for run, outcome in zip(runs, trials.outcomes, strict=True):
        record = run_once(run)
        assert (record.verdict is Verdict.IN_GOAL) == outcome.in_goal
        assert _measure(record, 'position_error') == pytest.approx(
            outcome.final_position_error, rel=1e-5
        )
        assert record.lost == (outcome.lost[0].contact if outcome.lost else '')


def test_plan_is_searched_for_once(design: Design, monkeypatch: pytest.MonkeyPatch) -> None:
    searched = []
    monkeypatch.setattr(running, '_PLANS', {})
    monkeypatch.setattr(running, 'plan', lambda *a: searched.append(a) or plan(*a))
    for run in design('friction=0,0.1')[:2]:
        assert run_once(run).verdict is Verdict.IN_GOAL
    assert len(searched) == 1


def test_search_without_a_plan_says_why(design: Design) -> None:
    record = run_once(design('max-nodes=1')[0])
    assert record.verdict is Verdict.NO_PLAN
    assert record.reason.startswith('budget_exhausted: ')
    assert _measure(record, 'position_error') is None


def test_world_that_cannot_be_drawn_is_a_failed_run(
    design: Design, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object) -> None:
        raise CfplanError('geometry_error: expected less')

    monkeypatch.setattr(running, 'Executor', refused)
    record = run_once(design()[0])
    assert record.verdict is Verdict.FAILED
    assert record.reason == 'geometry_error: expected less'
