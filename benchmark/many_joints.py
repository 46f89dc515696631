"""How planning time grows with the joints of a hand: a table and a figure.

`python benchmark/many_joints.py` from the project's folder plans every problem of
config/problems/many_joints with several seeds, each time in a process of its own, prints a table
in Markdown and draws docs/many_joints.png; docs/many-joints.md has the outcome.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
PROBLEMS = ROOT / 'config' / 'problems' / 'many_joints'

# Processor time is what the search takes also where other programs run; memory is the peak.
PLAN = """
import json, resource, sys, time
from pathlib import Path
from cfplan_core import PlanOptions, load_problem, plan
problem = load_problem(sys.argv[1])
began = time.process_time()
result = plan(problem, PlanOptions(seed=int(sys.argv[2]), time_budget=float(sys.argv[3])))
seconds = time.process_time() - began
status = Path('/proc/self/status')
if status.exists():
    line = next(row for row in status.read_text().splitlines() if row.startswith('VmHWM'))
    memory = 1024 * int(line.split()[1])
else:
    scale = 1 if sys.platform == 'darwin' else 1024
    memory = scale * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(json.dumps([len(problem.hand.joints), result.solved, seconds, memory, len(result.segments)]))
"""


@dataclass(frozen=True)
class Run:
    """One search: times in s, memory in bytes."""

    joints: int
    solved: bool
    seconds: float
    memory: int
    segments: int


def main() -> None:
    """Plan, print the table and draw the figure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--seeds', type=int, default=5, help='searches of each problem')
    parser.add_argument('--time-budget', type=float, default=600.0, help='seconds of each search')
    parser.add_argument('--figure', type=Path, default=ROOT / 'docs' / 'many_joints.png')
    options = parser.parse_args()
    print('| problem | joints | solved | median, s | longest, s | memory, MB | segments |')
    print('|---|---|---|---|---|---|---|')
    runs: dict[str, list[Run]] = {}
    for path in sorted(PROBLEMS.glob('*.yaml'), key=_joints):
        runs[path.stem] = [_run(path, seed, options.time_budget) for seed in range(options.seeds)]
        print(_row(path.stem, runs[path.stem]), flush=True)
    _draw(runs, options.figure)


def _joints(path: Path) -> tuple[int, str]:
    return path.read_text().count('effort_limit:'), path.stem


def _run(path: Path, seed: int, budget: float) -> Run:
    command = [sys.executable, '-c', PLAN, str(path), str(seed), str(budget)]
    ran = subprocess.run(command, capture_output=True, text=True, check=True)
    return Run(*json.loads(ran.stdout))


def _row(name: str, runs: list[Run]) -> str:
    solved = [run for run in runs if run.solved]
    seconds = [run.seconds for run in runs]
    segments = sorted(run.segments for run in solved)
    cells = [
        name.replace('_', ' '),
        str(runs[0].joints),
        f'{len(solved)} of {len(runs)}',
        f'{statistics.median(seconds):.1f}',
        f'{max(seconds):.1f}',
        f'{max(run.memory for run in runs) / 1e6:.0f}',
        f'{segments[0]} to {segments[-1]}' if segments else '-',
    ]
    return f'| {" | ".join(cells)} |'


def power(runs: dict[str, list[Run]]) -> tuple[float, float]:
    """Fit median time = a nᵇ over the problems with n joints, by least squares of logarithms."""
    joints = np.log([of[0].joints for of in runs.values()])
    seconds = np.log([statistics.median(run.seconds for run in of) for of in runs.values()])
    exponent, offset = np.polyfit(joints, seconds, 1)
    return float(np.exp(offset)), float(exponent)


def _draw(runs: dict[str, list[Run]], path: Path) -> None:
    import matplotlib

    matplotlib.use('Agg')
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(6.4, 4.2), layout='constrained')
    joints = np.array([of[0].joints for of in runs.values()])
    medians = np.array([statistics.median(run.seconds for run in of) for of in runs.values()])
    for of in runs.values():
        for solved, marker in ((True, '.'), (False, 'x')):
            seconds = [run.seconds for run in of if run.solved is solved]
            axes.plot([of[0].joints] * len(seconds), seconds, marker, color='0.55', zorder=1)
    axes.plot(joints, medians, 'o', color='C0', label='median of the seeds')
    scale, exponent = power(runs)
    line = np.linspace(joints.min() * 0.9, joints.max() * 1.1, 50)
    axes.plot(line, scale * line**exponent, '-', color='C0', label=f'fit: $n^{{{exponent:.1f}}}$')
    middle = np.exp(np.log(medians / joints**2.0).mean())
    axes.plot(line, middle * line**2.0, ':', color='0.3', label='$n^2$')
    labelled: set[int] = set()
    for name, of in runs.items():
        side = 1 if of[0].joints in labelled else -1
        labelled.add(of[0].joints)
        axes.annotate(
            name.replace('_', ' ').replace('fingers ', 'fingers\n'),
            (of[0].joints, statistics.median(run.seconds for run in of)),
            xytext=(8 * side, 0),
            textcoords='offset points',
            ha='left' if side > 0 else 'right',
            va='center',
            fontsize=7,
        )
    axes.set(xscale='log', yscale='log', xlabel='joints', ylabel='planning time, s')
    axes.set_xticks(sorted(set(joints.tolist())), [str(n) for n in sorted(set(joints.tolist()))])
    axes.minorticks_off()
    axes.margins(x=0.15, y=0.15)
    axes.legend(frameon=False, loc='upper left')
    figure.savefig(path, dpi=150)


if __name__ == '__main__':
    main()
