"""Print, as a Markdown table, what each preference gives on the example problems.

`python benchmark/preferences.py` from the project's folder; docs/optimality.md has the outcome.
"""

from __future__ import annotations

import time
from pathlib import Path

from cfplan_core import (
    PlanOptions,
    PlanResult,
    Preference,
    load_problem,
    plan,
    plan_margin,
    verify_plan,
)

PROBLEMS = Path(__file__).parents[1] / 'config' / 'problems'
# The problems of one joint for each of two fingers: others need a time budget.
NAMES = [
    *('h013', 'h020', 'h045', 'h1004', 'h1181', 'h120', 'h122', 'h205', 'h447'),
    'trinkle_hunter_1991',
]


def main() -> None:
    """Plan each problem in each way and print a row for it."""
    print('| problem | preference | segments | contacts | length | needed force | margin | s |')
    print('|---|---|---|---|---|---|---|---|')
    for name in NAMES:
        problem = load_problem(PROBLEMS / f'{name}.yaml')
        for prefer in Preference:
            began = time.perf_counter()
            result = plan(problem, PlanOptions(prefer=prefer))
            elapsed = time.perf_counter() - began
            if not verify_plan(problem, result).ok:
                raise SystemExit(f'{name}: the plan preferred as {prefer.value} does not verify')
            margin = plan_margin(problem, result)
            print(_row(name, prefer, result, margin, elapsed), flush=True)


def _row(name: str, prefer: Preference, result: PlanResult, margin: float, elapsed: float) -> str:
    counts = {len(segment.contacts) for segment in result.segments}
    cells = [
        name if prefer is Preference.FIRST else '',
        prefer.value,
        str(len(result.segments)),
        ', '.join(map(str, sorted(counts))),
        f'{result.length:.3f}',
        f'{result.needed_force:.2f}',
        f'{margin:.3f}',
        f'{elapsed:.2f}',
    ]
    return f'| {" | ".join(cells)} |'


if __name__ == '__main__':
    main()
