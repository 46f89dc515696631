"""Print, as Markdown tables, what each preference gives on the example problems.

`python benchmark/preferences.py` from the project's folder; docs/optimality.md has the outcome.
"""

from __future__ import annotations

import time
from pathlib import Path

from cfplan_core import (
    PlanOptions,
    PlanResult,
    Preference,
    Problem,
    load_problem,
    plan,
    plan_margin,
    verify_plan,
)
from cfplan_core.trajectory.plan_margin import plan_ratios

PROBLEMS = Path(__file__).parents[1] / 'config' / 'problems'
# The problems of one joint for each of two fingers: others need a time budget.
NAMES = [
    *('h013', 'h020', 'h045', 'h1004', 'h1181', 'h120', 'h122', 'h205', 'h447'),
    'trinkle_hunter_1991',
]
# Those of a configuration, and those of a motion.
TERMS = ('force', 'hold', 'stiffness', 'torque', 'limits')
OF_MOTIONS = ('friction', 'clearance')


# A plan this near the bound, as a part of it, is as good as any.
PROOF = 0.02


def main() -> None:
    """Plan each problem in each way; print a row for each plan, then one for each problem."""
    print('| problem | preference | segments | contacts | length | needed force | margin | s |')
    print('|---|---|---|---|---|---|---|---|')
    compared = []
    for name in NAMES:
        problem = load_problem(PROBLEMS / f'{name}.yaml')
        results = {}
        for prefer in Preference:
            began = time.process_time()
            result = plan(problem, PlanOptions(prefer=prefer))
            elapsed = time.process_time() - began
            if not verify_plan(problem, result).ok:
                raise SystemExit(f'{name}: the plan preferred as {prefer.value} does not verify')
            margin = plan_margin(problem, result)
            print(_row(name, prefer, result, margin, elapsed), flush=True)
            results[prefer] = result
        compared.append(_compared(problem, results[Preference.FIRST], results[Preference.ROBUST]))
    print()
    print('| problem | first | robust | of any plan | at start, goal | ratio | contacts | worst |')
    print('|---|---|---|---|---|---|---|---|')
    print('\n'.join(compared))


def _compared(problem: Problem, first: PlanResult, robust: PlanResult) -> str:
    """What a more robust plan wins, and what no plan can."""
    assert robust.margin is not None
    assert robust.margin_bound is not None
    rated = plan_ratios(problem, robust)
    ends = min(
        float(getattr(segment, name)[frame])
        for name in TERMS
        for segment, frame in ((rated[0], 0), (rated[-1], -1))
    )
    before = plan_margin(problem, first)
    worst, term = min(
        (
            float(getattr(segment, name).min()),
            f'{name}, {", ".join(part.contacts)}'.replace('|', '\\|'),
        )
        for segment, part in zip(rated, robust.segments, strict=True)
        for name in (*TERMS, *OF_MOTIONS)
    )
    best = robust.margin >= (1.0 - PROOF) * robust.margin_bound
    cells = [
        problem.name,
        f'{before:.3f}',
        f'{robust.margin:.3f}',
        f'{robust.margin_bound:.3f}{"" if best else " (not attained)"}',
        f'{ends:.3f}',
        f'{robust.margin / before:.1f}',
        str(min(len(segment.contacts) for segment in robust.segments)),
        f'{term} ({worst:.3f})',
    ]
    return f'| {" | ".join(cells)} |'


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
