from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cfplan_core import PlanResult, Problem, load_problem, plan
from cfplan_core.execution.execute import Execution, execute_plan
from cfplan_core.report.figures.execution import EXECUTED, PLANNED, execution_figure

PROBLEM_FILE = Path(__file__).parents[2] / 'config' / 'problems' / 'h020.yaml'


@pytest.fixture(scope='module')
def problem() -> Problem:
    return load_problem(PROBLEM_FILE)


@pytest.fixture(scope='module')
def planned(problem: Problem) -> PlanResult:
    return plan(problem)


@pytest.fixture(scope='module')
def execution(problem: Problem, planned: PlanResult) -> Execution:
    return execute_plan(problem, planned)


def test_panels_show_planned_and_measured_pose_and_torque(
    problem: Problem, planned: PlanResult, execution: Execution
) -> None:
    figure = execution_figure(problem, planned, execution)
    panels = [axes for axes in figure.axes if axes.get_ylabel()]
    assert [axes.get_ylabel().replace('\n', ' ') for axes in panels] == [
        'object x (mm)',
        'object y (mm)',
        'object angle (rad)',
        'left_joint torque (N·m)',
        'right_joint torque (N·m)',
    ]
    run = execution.run
    measured = [*(run.object_poses * [1e3, 1e3, 1.0]).T, *run.torques.T]
    reference = execution.reference
    wanted = [*(reference.object_poses * [1e3, 1e3, 1.0]).T, *reference.torques.T]
    for axes, values, asked in zip(panels, measured, wanted, strict=True):
        lines = {line.get_gid(): line for line in axes.lines}
        assert np.array_equal(lines[EXECUTED].get_ydata(), values)
        assert np.array_equal(lines[PLANNED].get_ydata(), asked[run.rows])
        low, high = axes.get_ylim()
        assert low < asked.min() <= asked.max() < high
        assert np.mean((low < values) & (values < high)) > 0.97
