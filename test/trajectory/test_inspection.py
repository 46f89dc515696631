"""What the planner would not give away: frames that break one promise each."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from cfplan_core import PlanResult, Problem, load_problem, plan, verify_plan
from cfplan_core.contact.system import ContactSystem
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.trajectory.frames import Frames
from cfplan_core.trajectory.inspection import flaw
from cfplan_core.trajectory.plan_result import Segment

PROBLEMS = sorted((Path(__file__).parents[2] / 'config' / 'problems').glob('*.yaml'))


@cache
def planned(path: Path) -> tuple[Problem, PlanResult]:
    problem = load_problem(path)
    return problem, plan(problem)


def the_1991_plan() -> tuple[Problem, PlanResult]:
    return planned(next(path for path in PROBLEMS if path.stem == 'trinkle_hunter_1991'))


def found(problem: Problem, result: PlanResult) -> str | None:
    system = ContactSystem(problem)
    frames = Frames(
        result.times,
        result.joints,
        result.object_poses,
        result.torque_lower,
        result.torque_upper,
        result.segments,
        result.entry_lower,
        result.entry_upper,
        result.torque_nominal,
        result.entry_nominal,
    )
    return flaw(system, FrictionlessModel(system.load), frames)


def with_segment(result: PlanResult, index: int, segment: Segment) -> PlanResult:
    return replace(
        result, segments=(*result.segments[:index], segment, *result.segments[index + 1 :])
    )


@pytest.mark.parametrize('path', PROBLEMS, ids=lambda path: path.stem)
def test_certified_plans_have_no_flaw(path: Path) -> None:
    problem, result = planned(path)
    assert verify_plan(problem, result).ok
    assert found(problem, result) is None


def test_contact_that_is_not_named_is_seen() -> None:
    problem, result = the_1991_plan()
    segment = result.segments[0]
    hidden = with_segment(result, 0, replace(segment, contacts=segment.contacts[:-1]))
    assert not verify_plan(problem, hidden).ok
    assert found(problem, hidden) == 'an unnamed contact would touch'


def test_contact_that_does_not_touch_is_seen() -> None:
    problem, result = the_1991_plan()
    segment = result.segments[0]
    others = {name for other in result.segments for name in other.contacts} - {*segment.contacts}
    invented = with_segment(result, 0, replace(segment, contacts=(*segment.contacts, min(others))))
    assert not verify_plan(problem, invented).ok
    assert found(problem, invented) == 'a contact would not touch'


def test_wrong_class_is_seen() -> None:
    problem, result = the_1991_plan()
    index = next(
        k for k, segment in enumerate(result.segments) if segment.stability == 'force_closure'
    )
    boasting = with_segment(
        result, index, replace(result.segments[index], stability='form_closure')
    )
    assert not verify_plan(problem, boasting).ok
    assert found(problem, boasting) == 'the stability class would change'


def test_object_that_sinks_into_the_palm_is_seen() -> None:
    problem, result = the_1991_plan()
    poses = result.object_poses.copy()
    poses[1, 1] -= 2e-6
    sunk = replace(result, object_poses=poses)
    assert not verify_plan(problem, sunk).ok
    assert found(problem, sunk) == 'bodies would overlap'


def test_leap_is_seen() -> None:
    problem, result = the_1991_plan()
    segment = max(result.segments, key=lambda segment: segment.last_frame - segment.first_frame)
    kept = np.ones(len(result.times), dtype=bool)
    kept[segment.first_frame + 2 : segment.last_frame - 1] = False
    missing = int((~kept).sum())

    def moved(frame: int) -> int:
        return frame - missing if frame > segment.first_frame else frame

    leaping = replace(
        result,
        times=result.times[kept],
        joints=result.joints[kept],
        object_poses=result.object_poses[kept],
        torque_lower=result.torque_lower[kept],
        torque_upper=result.torque_upper[kept],
        segments=tuple(
            replace(s, first_frame=moved(s.first_frame), last_frame=moved(s.last_frame))
            for s in result.segments
        ),
    )
    assert not verify_plan(problem, leaping).ok
    assert found(problem, leaping) == 'a step would be too long'


def test_joint_that_is_too_weak_is_seen() -> None:
    problem, result = the_1991_plan()
    least = np.where(
        np.isfinite(result.torque_lower),
        np.maximum(np.maximum(result.torque_lower, -result.torque_upper), 0.0),
        0.0,
    ).max()
    finger = problem.hand.fingers[0]
    weak = replace(finger.joints[0], effort_limit=0.1 * float(least))
    fingers = (replace(finger, joints=(weak,)), *problem.hand.fingers[1:])
    weaker = replace(problem, hand=replace(problem.hand, fingers=fingers))
    assert not verify_plan(weaker, result).ok
    assert found(weaker, result) == 'a joint would exceed its effort limit'
