"""The paper's figures, for a plan that was found and for a search that ended without one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from matplotlib.figure import Figure

from cfplan_core.errors import CfplanError
from cfplan_core.model import Problem
from cfplan_core.report.figures.frames import frames_figure as frames_figure
from cfplan_core.report.figures.grasps import grasps_figure as grasps_figure
from cfplan_core.report.figures.saving import FORMATS, save_figure
from cfplan_core.report.figures.torque import torque_figure as torque_figure
from cfplan_core.report.figures.trajectory import trajectory_figure as trajectory_figure
from cfplan_core.report.figures.trees import trees_figure as trees_figure
from cfplan_core.report.scene import check_belongs
from cfplan_core.trajectory.plan_result import PlanResult


def write_figures(
    problem: Problem, result: PlanResult, directory: str | Path, formats: Sequence[str] = ('png',)
) -> list[Path]:
    """Write the figures that a result gives rise to, numbered as in the paper.

    ``fig3_grasps``, ``fig4_frames``, ``fig5_trees``, ``fig6_joint_trajectory`` and
    ``fig7_torque_limits``. A result without a plan has figure 3 and, if it has trees, figure 5; a
    plan read from its file has no trees and so no figure 5.

    Args:
        problem: What was planned for.
        result: Of any status.
        directory: Where to; made if it does not exist.
        formats: Of the files: ``png``, ``pdf`` or ``svg``.

    Returns:
        The files, figure by figure.

    Raises:
        CfplanError: The problem is not the result's, a format is unknown, or the directory cannot
            be written.
    """
    unknown = [name for name in formats if name not in FORMATS]
    if unknown:
        raise CfplanError(
            f'figure format must be one of {", ".join(FORMATS)}, got {", ".join(unknown)}'
        )
    check_belongs(problem, result)
    folder = Path(directory)
    return [
        save_figure(figure, folder / f'{name}.{suffix}')
        for name, figure in _figures(problem, result)
        for suffix in formats
    ]


def _figures(problem: Problem, result: PlanResult) -> Iterator[tuple[str, Figure]]:
    yield 'fig3_grasps', grasps_figure(problem, result)
    if result.solved:
        yield 'fig4_frames', frames_figure(problem, result)
    if any(result.trees):
        yield 'fig5_trees', trees_figure(problem, result)
    if result.solved:
        yield 'fig6_joint_trajectory', trajectory_figure(problem, result)
        yield 'fig7_torque_limits', torque_figure(problem, result)
