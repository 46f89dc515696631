from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import matplotlib
import pytest

from cfplan_core.errors import CfplanError
from cfplan_core.model import Problem
from cfplan_core.report.figures import write_figures
from cfplan_core.report.figures.saving import replacing
from cfplan_core.trajectory.plan_result import PlanResult

NAMES = [
    'fig3_grasps',
    'fig4_frames',
    'fig5_trees',
    'fig6_joint_trajectory',
    'fig7_torque_limits',
]


def test_a_plan_has_five_figures_in_every_format(
    problem: Problem, result: PlanResult, tmp_path: Path
) -> None:
    paths = write_figures(problem, result, tmp_path / 'new', ('png', 'svg'))
    assert [path.name for path in paths] == [f'{n}.{s}' for n in NAMES for s in ('png', 'svg')]
    assert sorted(paths) == sorted((tmp_path / 'new').iterdir())


def test_a_search_without_a_plan_has_grasps_and_trees(
    problem: Problem, unsolved: PlanResult, tmp_path: Path
) -> None:
    paths = write_figures(problem, unsolved, tmp_path)
    assert [path.name for path in paths] == ['fig3_grasps.png', 'fig5_trees.png']


def test_a_plan_without_trees_has_no_figure_5(
    problem: Problem, result: PlanResult, tmp_path: Path
) -> None:
    paths = write_figures(problem, replace(result, trees=((), ())), tmp_path)
    assert [path.stem for path in paths] == [name for name in NAMES if name != 'fig5_trees']


@pytest.mark.parametrize('suffix', ['png', 'pdf', 'svg'])
def test_the_same_plan_gives_the_same_bytes(
    problem: Problem, unsolved: PlanResult, tmp_path: Path, suffix: str
) -> None:
    first = write_figures(problem, unsolved, tmp_path / 'a', (suffix,))
    second = write_figures(problem, unsolved, tmp_path / 'b', (suffix,))
    assert [p.read_bytes() for p in first] == [p.read_bytes() for p in second]


def test_text_in_vector_figures_stays_text(
    problem: Problem, unsolved: PlanResult, tmp_path: Path
) -> None:
    grasps, _ = write_figures(problem, unsolved, tmp_path, ('svg',))
    assert '>object element</text>' in grasps.read_text()


def test_an_unknown_format_is_refused(
    problem: Problem, result: PlanResult, tmp_path: Path
) -> None:
    with pytest.raises(CfplanError, match='must be one of png, pdf, svg, got bmp'):
        write_figures(problem, result, tmp_path, ('png', 'bmp'))
    assert not list(tmp_path.iterdir())


def test_a_folder_that_cannot_be_made_is_named(
    problem: Problem, result: PlanResult, tmp_path: Path
) -> None:
    (tmp_path / 'file').write_text('')
    with pytest.raises(CfplanError, match=r'cannot write .*file/figures/fig3_grasps\.png'):
        write_figures(problem, result, tmp_path / 'file' / 'figures')


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    target = tmp_path / 'picture.png'
    target.write_text('old')

    def fail() -> None:
        with replacing(target) as temporary:
            temporary.write_text('half')
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert target.read_text() == 'old'
    assert list(tmp_path.iterdir()) == [target]


def test_writing_changes_no_settings_of_matplotlib(
    problem: Problem, unsolved: PlanResult, tmp_path: Path
) -> None:
    before = dict(matplotlib.rcParams)
    write_figures(problem, unsolved, tmp_path, ('pdf',))
    assert dict(matplotlib.rcParams) == before


def test_reports_do_without_pyplot() -> None:
    code = (
        'import sys, cfplan_core.report.figures, cfplan_core.report.animation;'
        'sys.exit("matplotlib.pyplot" in sys.modules)'
    )
    assert subprocess.run([sys.executable, '-c', code], check=False).returncode == 0


def test_tables_do_without_matplotlib() -> None:
    code = 'import sys, cfplan_core.report.tables; sys.exit("matplotlib" in sys.modules)'
    assert subprocess.run([sys.executable, '-c', code], check=False).returncode == 0
