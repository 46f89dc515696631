from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binomtest

from cfplan_core import CfplanError, PlanResult, Problem
from cfplan_core.execution.execute import Execution, ExecutionOptions, Executor
from cfplan_core.execution.outcome import ContactEvent
from cfplan_core.execution.perturbation import Uncertainty
from cfplan_core.execution.trials import SuccessRate, Trials, run_trials


@pytest.mark.parametrize(('successes', 'trials'), [(0, 1), (0, 10), (10, 10), (7, 10), (93, 100)])
def test_interval_is_wilsons(successes: int, trials: int) -> None:
    wanted = binomtest(successes, trials).proportion_ci(0.95, method='wilson')
    assert SuccessRate(successes, trials).interval == pytest.approx(tuple(wanted), abs=1e-12)


def test_trials_differ_and_can_be_repeated(problem: Problem, planned: PlanResult) -> None:
    options = ExecutionOptions(Uncertainty(mass_error=0.2), seed=4)
    executor = Executor(problem, planned, options)
    seen: list[tuple[int, int]] = []
    trials = run_trials(executor, 3, lambda done, good: seen.append((done, good)))
    errors = [outcome.largest_angle_deviation for outcome in trials.outcomes]
    assert len(set(errors)) == 3
    again = Executor(problem, planned, options).run(2).outcome
    assert again.largest_angle_deviation == errors[2]
    assert seen == [(1, 1), (2, 2), (3, 3)]
    assert trials.success == SuccessRate(3, 3)


def test_number_of_trials_must_be_positive(problem: Problem, planned: PlanResult) -> None:
    executor = Executor(problem, planned, ExecutionOptions())
    with pytest.raises(CfplanError, match='trials: got 0, expected a number above zero'):
        run_trials(executor, 0)


def test_first_losses_are_of_failures_only(execution: Execution) -> None:
    lost = (ContactEvent(0.5, 1, 'a'), ContactEvent(0.6, 1, 'b'))
    good = replace(execution.outcome, lost=lost, in_goal=True)
    bad = replace(good, in_goal=False)
    trials = Trials((good, bad, bad, replace(bad, lost=())))
    assert trials.first_losses() == {(1, 'a'): 2}
    assert trials.success.successes == 1


def test_quantiles_are_over_all_trials(execution: Execution) -> None:
    outcomes = tuple(
        replace(execution.outcome, final_angle_error=error) for error in (0.1, 0.2, 0.3)
    )
    trials = Trials(outcomes)
    assert trials.quantile(lambda o: o.final_angle_error, 0.5) == pytest.approx(0.2)
    assert np.isclose(trials.quantile(lambda o: o.final_angle_error, 1.0), 0.3)
