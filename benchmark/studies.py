"""Print how long a study of 200 runs takes with one worker and with more.

    python benchmark/studies.py [WORKERS]

The ten problems of one joint for each of two fingers, two coefficients of friction, ten worlds.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from cfplan_core import load_problem
from cfplan_core.study.cluster import available_workers, run_study
from cfplan_core.study.design import StudyRun, design_study
from cfplan_core.study.log import StudyLog
from cfplan_core.study.parameters import parse_variations
from cfplan_core.study.record import Record

PROBLEMS = Path(__file__).parents[1] / 'config' / 'problems'
NAMES = [
    *('h013', 'h020', 'h045', 'h1004', 'h1181', 'h120', 'h122', 'h205', 'h447'),
    'trinkle_hunter_1991',
]
VARIED = ('friction=0,0.05', 'mass-error=0:0.2', 'joint-noise=0:0.5')
SAMPLES = 10


def seconds(runs: tuple[StudyRun, ...], workers: int) -> tuple[float, float]:
    """Time a study, with and without the start of the workers."""
    ends: list[float] = []

    def note(_: Record) -> None:
        ends.append(time.perf_counter())

    with tempfile.TemporaryDirectory() as folder, StudyLog(Path(folder) / 'study.csv') as log:
        began = time.perf_counter()
        run_study(runs, log, workers=workers, done=note)
        return time.perf_counter() - began, ends[-1] - ends[0]


def main() -> None:
    most = int(sys.argv[1]) if len(sys.argv) > 1 else available_workers()
    problems = [load_problem(PROBLEMS / f'{name}.yaml') for name in NAMES]
    runs = design_study(problems, parse_variations(VARIED), SAMPLES, 0)
    alone = seconds(runs, 1)
    many = seconds(runs, most)
    print(f'| {len(runs)} runs | 1 worker | {most} workers | times faster |')
    print('|---|---|---|---|')
    labels = ('in all', 'from the first run to the last')
    for label, one, more in zip(labels, alone, many, strict=True):
        print(f'| {label} | {one:.1f} s | {more:.1f} s | {one / more:.2f} |')


# Workers import this module.
if __name__ == '__main__':
    main()
