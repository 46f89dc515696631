"""Success against parameters, counted by hand."""

from __future__ import annotations

from collections.abc import Callable

from cfplan_core.report.figures.study import study_figure
from cfplan_core.study.design import StudyRun
from cfplan_core.study.record import Record, Verdict, record_of
from cfplan_core.study.success import dependences, success_of

Design = Callable[..., tuple[StudyRun, ...]]


def _records(runs: tuple[StudyRun, ...], good: Callable[[StudyRun], bool]) -> list[Record]:
    return [record_of(r, Verdict.IN_GOAL if good(r) else Verdict.MISSED) for r in runs]


def test_each_value_counts_its_own_runs(design: Design) -> None:
    runs = design('friction=0.2,0,0.1', samples=4)
    records = _records(runs, lambda r: r.values['friction'] != 0.2 and r.sample > 0)
    problem, friction = dependences(records)
    assert (problem.name, friction.name) == ('problem', 'friction')
    assert [(x.label, x.success.successes, x.success.trials) for x in friction.levels] == [
        ('0.0', 6, 8),
        ('0.1', 6, 8),
        ('0.2', 0, 8),
    ]
    assert [x.success.successes for x in problem.levels] == [6, 6]


def test_draws_of_a_range_are_counted_in_bins(design: Design) -> None:
    runs = design('gain=0.5:10.5', samples=200)
    records = _records(runs, lambda r: float(r.values['gain'] or 0.0) > 5.5)
    levels = dependences(records)[-1].levels
    assert len(levels) == 5
    assert sum(x.success.trials for x in levels) == 400
    assert [x.success.successes / x.success.trials for x in levels[:2]] == [0.0, 0.0]
    assert [x.success.successes / x.success.trials for x in levels[3:]] == [1.0, 1.0]
    assert 0.0 < levels[2].success.successes / levels[2].success.trials < 1.0


def test_runs_without_a_plan_are_no_successes(design: Design) -> None:
    records = [record_of(run, Verdict.NO_PLAN) for run in design()]
    assert (success_of(records).successes, success_of(records).trials) == (0, 2)


def test_figure_has_a_panel_for_each_parameter_with_its_rates(design: Design) -> None:
    runs = design('friction=0,0.1', 'prefer=first,robust')
    records = _records(runs, lambda r: r.values['friction'] == 0.0)
    panels = [axes for axes in study_figure(records).axes if axes.get_visible()]
    assert [axes.get_xlabel() for axes in panels] == ['problem', 'prefer', 'friction']
    points = panels[2].containers[0].lines[0]
    assert list(points.get_xdata()) == [0.0, 0.1]
    assert list(points.get_ydata()) == [1.0, 0.0]


def test_figure_of_one_run_has_no_panel(design: Design) -> None:
    figure = study_figure([record_of(design()[0], Verdict.IN_GOAL)])
    assert not any(axes.get_xlabel() for axes in figure.axes if axes.get_visible())
