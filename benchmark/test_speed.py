"""Planning time of every example problem, peak memory of a planning process, import time.

`make bench` runs this with one thread and prints one table.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from cfplan_core import load_problem, plan

PROBLEMS = sorted((Path(__file__).parents[1] / 'config' / 'problems').glob('*.yaml'))
ROUNDS = 5

# ru_maxrss would do, but on Linux a child inherits the peak of the process that started it.
REPORT_MEMORY = """
import resource, sys
from pathlib import Path
status = Path('/proc/self/status')
if status.exists():
    line = next(row for row in status.read_text().splitlines() if row.startswith('VmHWM'))
    print(1024 * int(line.split()[1]))
else:
    scale = 1 if sys.platform == 'darwin' else 1024
    print(scale * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


@pytest.mark.parametrize('path', PROBLEMS, ids=lambda path: path.stem)
def test_planning_solves(
    path: Path, benchmark: BenchmarkFixture, record: Callable[..., None]
) -> None:
    problem = load_problem(path)
    result = benchmark.pedantic(plan, args=(problem,), rounds=ROUNDS, warmup_rounds=1)
    planning = f'from cfplan_core import load_problem, plan\nplan(load_problem({str(path)!r}))'
    (memory,) = _run(planning + REPORT_MEMORY)
    record(
        name=path.stem,
        status=result.status.value,
        segments=str(len(result.segments)),
        seconds=benchmark.stats.stats.median,
        memory=int(memory),
    )
    assert result.solved


@pytest.mark.parametrize('statement', ['import cfplan_core', 'from cfplan_core import plan'])
def test_import(statement: str, record: Callable[..., None]) -> None:
    timed = f'import time; t = time.perf_counter(); {statement}; print(time.perf_counter() - t)'
    runs = [_run(timed + REPORT_MEMORY) for _ in range(ROUNDS)]
    record(
        name=statement,
        seconds=statistics.median(float(seconds) for seconds, _ in runs),
        memory=max(int(memory) for _, memory in runs),
    )


def _run(code: str) -> list[str]:
    """Run code in a process of its own and return the lines that it prints."""
    ran = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=True)
    return ran.stdout.split()
