"""``cfplan study``: what it prints and writes, and that nothing stops it for good."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest
from click.testing import Result
from PIL import Image

from cfplan_core import load_problem
from cfplan_core.study.design import design_study
from cfplan_core.study.log import sorted_text
from cfplan_core.study.parameters import parse_variations
from cfplan_core.study.running import run_once

pytest.importorskip('mujoco')
pytest.importorskip('distributed')

H020 = Path(__file__).parents[2] / 'config' / 'problems' / 'h020.yaml'
STUDY = (H020, '--vary', 'friction=0,0.1', '--vary', 'mass-error=0:0.2', '--samples', 6)
RUNS = 12

Cfplan = Callable[..., Result]
Start = Callable[..., 'subprocess.Popen[str]']


@pytest.fixture(scope='session')
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of the study, run in this process."""
    path = tmp_path_factory.mktemp('undisturbed') / 'study.csv'
    variations = parse_variations(['friction=0,0.1', 'mass-error=0:0.2'])
    runs = design_study([load_problem(H020)], variations, 6, 0)
    path.write_bytes(sorted_text(run_once(run) for run in runs))
    return path


def _workers_of(process: subprocess.Popen[str]) -> list[psutil.Process]:
    children = psutil.Process(process.pid).children()
    servers = [child for child in children if 'forkserver' in ' '.join(child.cmdline())]
    return [worker for server in servers for worker in server.children()]


def _wait_for_rows(path: Path, rows: int, process: subprocess.Popen[str]) -> None:
    end = time.monotonic() + 120.0
    while not (path.exists() and path.read_bytes().count(b'\n') > rows):
        assert process.poll() is None
        assert time.monotonic() < end
        time.sleep(0.02)


def test_killed_worker_and_killed_study_lose_nothing(
    cfplan: Cfplan, start_cfplan: Start, undisturbed: Path, tmp_path: Path
) -> None:
    path = tmp_path / 'study.csv'
    process = start_cfplan('study', *STUDY, '-o', path, '--workers', 2, start_new_session=True)
    _wait_for_rows(path, 1, process)
    _workers_of(process)[0].kill()
    _wait_for_rows(path, 3, process)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    kept = path.read_bytes()
    kept = kept[: kept.rfind(b'\n') + 1]
    assert 3 <= kept.count(b'\n') - 1 < RUNS
    path.write_bytes(kept + b'0123456789abcdef,h020,fir')
    assert cfplan('study', *STUDY, '-o', path, '--workers', 1).exit_code == 0
    assert path.read_bytes() == undisturbed.read_bytes()


def test_interrupted_study_says_how_far_it_came(
    cfplan: Cfplan, start_cfplan: Start, undisturbed: Path, tmp_path: Path
) -> None:
    path = tmp_path / 'study.csv'
    process = start_cfplan('study', *STUDY, '-o', path, '--workers', 1, start_new_session=True)
    _wait_for_rows(path, 1, process)
    os.killpg(process.pid, signal.SIGINT)
    _, complaint = process.communicate()
    assert process.returncode == 130
    assert f'of {RUNS} runs are in {path}; the same command goes on' in complaint
    assert complaint.splitlines()[-1] == 'cfplan: interrupted'
    assert 'Traceback' not in complaint
    assert 1 <= path.read_bytes().count(b'\n') - 1 < RUNS
    assert cfplan('study', *STUDY, '-o', path, '--workers', 1).exit_code == 0
    assert path.read_bytes() == undisturbed.read_bytes()


def test_workers_do_not_outlive_a_killed_study(start_cfplan: Start, tmp_path: Path) -> None:
    path = tmp_path / 'study.csv'
    process = start_cfplan('study', *STUDY, '-o', path, '--workers', 1)
    _wait_for_rows(path, 1, process)
    children = _workers_of(process)
    assert children
    process.kill()
    process.wait()
    _, alive = psutil.wait_procs(children, timeout=30.0)
    assert not alive


def test_complete_study_is_described_again_and_drawn(
    cfplan: Cfplan, undisturbed: Path, tmp_path: Path
) -> None:
    figure, parquet = tmp_path / 'new' / 'study.png', tmp_path / 'new' / 'study.parquet'
    result = cfplan('study', *STUDY, '-o', undisturbed, '--figure', figure, '--parquet', parquet)
    assert result.exit_code == 0
    assert '12 of 12 times, 100% (76% to 100%' in result.output.replace('\n', ' ')
    assert 'friction' in result.output
    assert 'mass-error' in result.output
    assert all(len(line) <= 80 or str(tmp_path) in line for line in result.output.splitlines())
    with Image.open(figure) as image:
        assert image.width > 500


def test_parquet_file_has_the_rows_of_the_log(
    cfplan: Cfplan, undisturbed: Path, tmp_path: Path
) -> None:
    table = pytest.importorskip('pyarrow.parquet')
    path = tmp_path / 'study.parquet'
    assert cfplan('study', *STUDY, '-o', undisturbed, '--parquet', path).exit_code == 0
    rows = table.read_table(path).to_pylist()
    lines = undisturbed.read_text(encoding='utf-8').splitlines()
    assert list(rows[0]) == lines[0].split(',')
    written = [['' if v is None else str(v) for v in row.values()] for row in rows]
    assert written == [line.split(',') for line in lines[1:]]


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        (('--vary', 'frction=0'), "--vary: got the parameter 'frction', expected one of prefer,"),
        (('--vary', 'friction=11'), 'friction: got 11.0, expected 0 to 10'),
        (('--figure', 'f.jpg'), '--figure: got f.jpg, expected a name in .png, .pdf, .svg'),
        (('--samples', '0'), '0 is not in the range'),
        (('--scheduler', 'tcp://a:1', '--workers', '2'), '--workers: got 2 beside --scheduler'),
    ],
)
def test_impossible_study_is_refused_before_it_starts(
    cfplan: Cfplan, tmp_path: Path, arguments: tuple[str, ...], message: str
) -> None:
    path = tmp_path / 'study.csv'
    result = cfplan('study', H020, '-o', path, *arguments)
    assert result.exit_code == 2
    assert message in ' '.join(result.output.split()).replace('│ ', '')
    assert not path.exists()


def test_wrong_problem_is_refused_with_all_findings(
    cfplan: Cfplan, broken_file: Path, tmp_path: Path
) -> None:
    result = cfplan('study', broken_file, '-o', tmp_path / 'study.csv')
    assert result.exit_code == 2
    assert '2 findings' in result.output


def test_missing_dask_is_named_before_anything_is_written(
    cfplan: Cfplan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, 'distributed', None)
    result = cfplan('study', H020, '-o', tmp_path / 'study.csv')
    assert result.exit_code == 2
    assert "pip install 'cfplan_ros[study]'" in result.output
    assert not (tmp_path / 'study.csv').exists()
