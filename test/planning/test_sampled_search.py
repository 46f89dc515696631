"""Options of plans for hands of more than two joints, and what answers without a plan say."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections import Counter
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from cfplan_core import (
    CfplanError,
    Goal,
    PlanOptions,
    PlanResult,
    Preference,
    Problem,
    Status,
    load_problem,
    plan,
    plan_margin,
    verify_plan,
)
from cfplan_core.contact.elements import parse_contact
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.held import HeldSystem
from cfplan_core.contact.system import ContactSystem
from cfplan_core.mechanics.contact_model import Stability
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.model import Grasp
from cfplan_core.planning.budget import BudgetExhaustedError
from cfplan_core.planning.drives import ToConfiguration
from cfplan_core.planning.efforts import within_efforts
from cfplan_core.planning.grasp_check import examine_problem
from cfplan_core.planning.milestones import Milestone
from cfplan_core.planning.pieces import Region
from cfplan_core.planning.pushing import Pusher, Refusal
from cfplan_core.planning.roadmap import Roadmap
from cfplan_core.planning.sampled_search import SampledSearch
from cfplan_core.planning.search import Leg
from cfplan_core.planning.tracing import Tracer
from cfplan_core.planning.transitions import surroundings

ROOT = Path(__file__).parents[2]
PATH = ROOT / 'config' / 'problems' / 'many_joints' / 'two_fingers_two_joints.yaml'
TIP = 'object.e2|right.link_2.v2'


@cache
def problem() -> Problem:
    return load_problem(PATH)


@cache
def planned(options: PlanOptions) -> PlanResult:
    return plan(problem(), options)


def certified(options: PlanOptions) -> PlanResult:
    result = planned(options)
    assert result.solved, result.message
    assert verify_plan(problem(), result).failures == ()
    return result


def worst_force(result: PlanResult) -> float:
    return max(segment.needed_force or 0.0 for segment in result.segments)


def test_seed_gives_the_same_plan_in_another_process() -> None:
    code = (
        'import sys, cfplan_core as c\n'
        'r = c.plan(c.load_problem(sys.argv[1]), c.PlanOptions(seed=1))\n'
        'print(r.joints.tobytes().hex())'
    )
    environment = os.environ | {'PYTHONHASHSEED': '77', 'PYTHONPATH': str(ROOT)}
    printed = subprocess.run(
        [sys.executable, '-c', code, str(PATH)],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    assert printed.stdout.strip() == certified(PlanOptions(seed=1)).joints.tobytes().hex()


def test_another_seed_is_another_search() -> None:
    one, other = certified(PlanOptions()), certified(PlanOptions(seed=1))
    assert one.statistics.transitions != other.statistics.transitions


@pytest.mark.parametrize('seed', [-1, -5])
def test_seed_below_zero_is_refused(seed: int) -> None:
    with pytest.raises(CfplanError, match='seed'):
        PlanOptions(seed=seed)


def tip_on_edge() -> Problem:
    """A goal that is near: the right fingertip comes to lie on an edge of the object."""
    return replace(problem(), goal=Goal(contacts=(TIP,)))


def test_constraints_hold_all_the_way() -> None:
    free = plan(tip_on_edge())
    bound = 0.9 * worst_force(free)
    reached = free.object_poses[:, 0]
    low = np.array([reached.min() - 0.045, -0.01])
    high = np.array([reached.max() + 0.045, 0.08])
    corners = ((low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1]))
    result = plan(tip_on_edge(), PlanOptions(max_needed_force=bound, stay_within=corners))
    assert result.solved, result.message
    assert verify_plan(tip_on_edge(), result).failures == ()
    assert worst_force(result) <= bound
    vertices = problem().object.vertices
    for x, y, phi in result.object_poses:
        turn = np.array([[np.cos(phi), np.sin(phi)], [-np.sin(phi), np.cos(phi)]])
        world = vertices @ turn + (x, y)
        assert (world >= low - 1e-9).all()
        assert (world <= high + 1e-9).all()


def test_pushes_end_before_what_is_refused() -> None:
    system = ContactSystem(problem())
    tracer = Tracer(system, FrictionlessModel(system.load))
    start = examine_problem(system, tracer.model).start
    assert start is not None
    root = Milestone(start.z, surroundings(system, start.z), None, ())

    def region(known: list[Region], of: Formation, stability: Stability) -> Region:
        return Region(0, of, stability, 2, start.z[None], (), [])

    def most(refusal: Refusal) -> tuple[int, int]:
        """Most contacts at the ends of random pushes, and how many got anywhere."""
        pusher = Pusher(tracer, Counter(), region, refusal)
        rng = np.random.default_rng(0)
        weights = np.ones(system.dof)
        counts = []
        for _ in range(12):
            wanted = root.z + rng.normal(size=system.dof) * 0.4
            drive = ToConfiguration(wanted, weights, None)
            counts += [len(m.around.pairs) for m in pusher.push(root, drive, False)]
        return max(counts), len(counts)

    largest, _ = most(lambda pairs, together: None)
    bounded, reached = most(lambda pairs, together: 'no' if len(pairs) >= largest else None)
    assert bounded < largest
    assert reached > 0


def test_held_joint_does_not_move() -> None:
    name = problem().hand.joint_names[1]
    shifted = Goal(object_pose=problem().start.object_pose + np.array([0.004, 0.0, 0.0]))
    wanted = replace(problem(), goal=shifted)
    result = plan(wanted, PlanOptions(held_joints=(name,)))
    assert result.solved, result.message
    assert verify_plan(wanted, result).failures == ()
    assert np.ptp(result.joints[:, 1]) == 0.0
    assert np.ptp(result.joints) > 1e-3


def test_efforts_of_held_joints_count() -> None:
    result = certified(PlanOptions())
    finger, other = problem().hand.fingers
    weak = tuple(replace(joint, effort_limit=1e-6) for joint in finger.joints)
    hand = replace(problem().hand, fingers=(replace(finger, joints=weak), other))
    system = ContactSystem(replace(problem(), hand=hand))
    # Of three contacts each one presses.
    segment = next(s for s in result.segments if len(s.contacts) == 3 and 'left' in str(s))
    frame = (segment.first_frame + segment.last_frame) // 2
    z = system.configuration(Grasp(result.object_poses[frame], result.joints[frame]))
    pairs = sorted(system.pair(parse_contact(name)) for name in segment.contacts)
    held = HeldSystem(system, [joint.name for joint in weak], z)
    model = FrictionlessModel(system.load)
    assert not within_efforts(held, model, Formation(tuple(pairs)), held.reduced(z)[None])[0]


def test_contact_that_is_not_made_yet_is_a_goal() -> None:
    result = plan(tip_on_edge())
    assert result.solved, result.message
    assert TIP not in result.segments[0].contacts
    assert verify_plan(tip_on_edge(), result).failures == ()


def test_required_formation_is_passed() -> None:
    result = certified(PlanOptions(required=((TIP,),)))
    assert any(TIP in segment.contacts for segment in result.segments)


def test_answer_without_a_plan_is_no_proof() -> None:
    result = plan(problem(), PlanOptions(max_nodes=5))
    assert result.status is Status.BUDGET_EXHAUSTED
    assert 'budget of 5 nodes' in result.message
    assert 'does not show that there is no plan' in result.message


def test_cancelled_search_says_so() -> None:
    cancel = threading.Event()
    cancel.set()
    result = plan(problem(), cancel=cancel)
    assert result.status is Status.BUDGET_EXHAUSTED
    assert 'cancelled' in result.message


def test_alternatives_differ_and_the_best_comes_first() -> None:
    options = PlanOptions(prefer=Preference.ROBUST, alternatives=2, max_nodes=300)
    best = plan(tip_on_edge(), options)
    assert best.solved, best.message
    assert 'a better one may exist' in best.message
    plans = (best, *best.alternatives)
    assert len(plans) == 2
    margins = [plan_margin(tip_on_edge(), result) for result in plans]
    assert margins == sorted(margins, reverse=True)
    sequences = {tuple(segment.contacts for segment in result.segments) for result in plans}
    assert len(sequences) == 2
    assert all(verify_plan(tip_on_edge(), result).ok for result in plans)


def test_refused_path_is_followed_by_that_of_another_seed() -> None:
    system = ContactSystem(problem())
    examined = examine_problem(system, FrictionlessModel(system.load))
    assert examined.goal is not None
    roadmap = Roadmap(system, FrictionlessModel(system.load))
    seen: list[list[Leg]] = []

    def refuse(legs: list[Leg]) -> bool:
        seen.append(list(legs))
        return len(seen) == 1

    search = SampledSearch(roadmap, examined.start.z, examined.goal.z, refuse=refuse)
    legs = next(search.paths())
    assert search.attempts == 2
    assert legs[0].points is seen[1][0].points
    assert [leg.formation for leg in seen[0]] != [leg.formation for leg in legs]


def test_search_that_runs_out_of_time_while_shortening_still_answers() -> None:
    system = ContactSystem(problem())
    model = FrictionlessModel(system.load)
    examined = examine_problem(system, model)
    assert examined.goal is not None
    stop = False

    def checkpoint() -> None:
        if stop:
            raise BudgetExhaustedError('over')

    roadmap = Roadmap(system, model, checkpoint)
    search = SampledSearch(roadmap, examined.start.z, examined.goal.z)
    expedition_path = search._path

    def path_when_over(expedition: object) -> list[Leg]:
        nonlocal stop
        stop = True
        return expedition_path(expedition)  # type: ignore[arg-type]

    search._path = path_when_over  # type: ignore[method-assign, assignment]
    legs = next(search.paths())
    np.testing.assert_allclose(legs[0].points[0], examined.start.z)
    np.testing.assert_allclose(legs[-1].points[-1], examined.goal.z, atol=1e-6)
