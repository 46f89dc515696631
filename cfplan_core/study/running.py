"""One run of a study: plan, or take the plan that is there, and execute it once."""

from __future__ import annotations

from cfplan_core.errors import CfplanError
from cfplan_core.execution.execute import Executor
from cfplan_core.execution.outcome import Outcome
from cfplan_core.execution.scene import import_mujoco
from cfplan_core.options import PlanOptions
from cfplan_core.planner import plan
from cfplan_core.study.design import StudyRun
from cfplan_core.study.parameters import execution_options, plan_options
from cfplan_core.study.record import Record, Verdict, record_of
from cfplan_core.trajectory.plan_result import PlanResult

# Plans of this process, by digest of the problem and options: most runs differ in execution only.
_PLANS: dict[tuple[str, PlanOptions], PlanResult] = {}
_MOST_PLANS = 100


def run_once(run: StudyRun) -> Record:
    """Plan and execute. Same run, same record.

    What the input is to blame for is recorded as failed, as it would fail again.

    Raises:
        CfplanError: The physics engine is not installed.
    """
    import_mujoco()
    try:
        result = _planned(run)
        if not result.solved:
            reason = f'{result.status.value}: {result.message}'
            return record_of(run, Verdict.NO_PLAN, reason=reason)
        options = execution_options(run.values, run.seed)
        outcome = Executor(run.problem, result, options).run(run.sample).outcome
    except CfplanError as error:
        return record_of(run, Verdict.FAILED, reason=str(error))
    return _executed(run, result, outcome)


def _planned(run: StudyRun) -> PlanResult:
    options = plan_options(run.values)
    known = _PLANS.get((run.digest, options))
    if known is None:
        if len(_PLANS) >= _MOST_PLANS:
            _PLANS.pop(next(iter(_PLANS)))
        known = _PLANS[run.digest, options] = plan(run.problem, options)
    return known


def _executed(run: StudyRun, result: PlanResult, outcome: Outcome) -> Record:
    measures = {
        'position_error': outcome.final_position_error,
        'angle_error': outcome.final_angle_error,
        'position_deviation': outcome.largest_position_deviation,
        'angle_deviation': outcome.largest_angle_deviation,
        'torque_excess': float(outcome.torque_excess.max()),
        'plan_duration': float(result.times[-1] - result.times[0]),
        'lost_at': outcome.lost[0].time if outcome.lost else None,
    }
    verdict = Verdict.IN_GOAL if outcome.in_goal else Verdict.MISSED
    lost = outcome.lost[0].contact if outcome.lost else ''
    return record_of(run, verdict, measures, lost)
