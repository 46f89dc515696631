"""Verify a whole plan: every frame by itself, every step, the ends, by a second method."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping

from cfplan_core.errors import CfplanError
from cfplan_core.model import Problem
from cfplan_core.trajectory.plan_result import PlanResult
from cfplan_core.verification.balance_checks import (
    Hold,
    Limits,
    check_barely_stable,
    check_class,
    check_control,
    check_nominal,
    check_stable,
    check_torques,
)
from cfplan_core.verification.checks import TOUCH
from cfplan_core.verification.contact_checks import (
    check_ends_alone,
    check_inside_contacts,
    check_named_contacts,
    check_overlaps,
)
from cfplan_core.verification.dynamics import (
    QUASI_STATIC,
    check_acceleration,
    check_inertia,
)
from cfplan_core.verification.halfway import halfway
from cfplan_core.verification.mechanism import Mechanism, Scene, mechanism_of
from cfplan_core.verification.overlap import overlap_depth
from cfplan_core.verification.path import check_goal, check_limits, check_start, check_steps
from cfplan_core.verification.report import Recorder, VerificationReport
from cfplan_core.verification.structure import Stretch, check_structure
from cfplan_core.verification.touching import Pair, Touch, touching_pairs

Scenes = tuple[Scene, ...]
Events = Mapping[int, Mapping[str, tuple[Pair, Touch]]]
"""What touches, by contact name, at each frame at which a segment begins or ends."""


def verify_plan(
    problem: Problem, result: PlanResult, inertia: float = QUASI_STATIC
) -> VerificationReport:
    """Certify a plan, or say what is wrong with it.

    Nothing of the planner's geometry and mechanics is used: positions come from kinematics of
    this package's own, distances and overlaps from shapely, stability and torque limits from
    linear programs solved by HiGHS. The checks and their tolerances are in
    `cfplan_core.verification.checks`.

    A frame that two segments share is held to both: the contacts of each touch and balance the
    object, if just barely, and together they hold it. Its torque limits may be those of either.

    Args:
        problem: What the plan is for; frictionless.
        result: The plan.
        inertia: Share of the weight up to which inertial forces do not matter.

    Returns:
        The verdict, with every failure. A plan whose form is wrong is not checked further.

    Raises:
        CfplanError: The problem has friction, which this verification does not cover.
    """
    if problem.friction != 0.0:
        raise CfplanError(
            f'problem {problem.name!r}: contact.friction is {problem.friction}, expected 0: only '
            'frictionless plans can be verified'
        )
    mechanism, record = mechanism_of(problem), Recorder()
    stretches = check_structure(mechanism, result, record)
    if stretches is not None:
        scenes = tuple(map(mechanism.scene, result.object_poses, result.joints))
        check_start(mechanism, result, stretches[0], record)
        check_goal(mechanism, result, scenes[-1], record)
        check_limits(mechanism, result, record)
        check_steps(mechanism, result, scenes, record)
        check_acceleration(mechanism, result, record)
        check_inertia(mechanism, result, scenes, inertia, record)
        for frame, scene in enumerate(scenes):
            check_overlaps(mechanism, frame, scene, record)
        ends = {frame for stretch in stretches for frame in (stretch.first, stretch.last)}
        events = {frame: touching_pairs(mechanism, scenes[frame]) for frame in ends}
        for stretch in stretches:
            _check_steps(mechanism, stretch, scenes, events, record)
            control = result.segments[stretch.number - 1].control
            if control is not None:
                frames = range(stretch.first, stretch.last + 1)
                holds = [_hold(mechanism, stretch, frame, scenes[frame]) for frame in frames]
                check_control(holds, control, record)
        for frame in range(len(scenes)):
            sharing = [s for s in stretches if s.first <= frame <= s.last]
            claimed = result.torque_lower[frame], result.torque_upper[frame]
            pressing = _check_frame(mechanism, sharing, frame, scenes, claimed, events, record)
            if len(result.torque_nominal):
                check_nominal(pressing, claimed, result.torque_nominal[frame], record)
    return record.report(problem.name, len(result.times))


def _check_frame(
    mechanism: Mechanism,
    sharing: list[Stretch],
    frame: int,
    scenes: Scenes,
    claimed: Limits,
    events: Events,
    record: Recorder,
) -> Hold:
    """Check a frame; return what may press there."""
    scene = scenes[frame]
    for stretch in sharing:
        check_named_contacts(stretch, frame, scene, record)
    holds = [_hold(mechanism, stretch, frame, scene) for stretch in sharing]
    only = sharing[0]
    # The one frame of a plan that stays at its start is inside its segment.
    inside = len(sharing) == 1 and (frame not in events or only.first == only.last)
    if inside:
        near = {*events.get(frame - 1, ()), *events.get(frame + 1, ())}
        _check_inside(mechanism, only, holds[0], near, record)
    else:
        for hold in holds:
            check_barely_stable(hold, record)
            check_class(hold, False, record)
        # At a shared frame what the two segments name, at the start and the goal what touches.
        together = dict.fromkeys(pair for hold in holds for pair in hold.contacts)
        if len(holds) == 1:
            together |= {pair: None for pair, _ in events[frame].values()}
        # An instant may be held to second order only, where contacts let go and others take over.
        weakest = 'second_order' if len(holds) > 1 else only.stability
        owner = ' and '.join(hold.owner for hold in holds)
        check_stable(Hold(mechanism, frame, scene, tuple(together), owner, weakest), record)
    check_torques(holds, claimed, inside, record)
    if len(holds) == 1:
        return holds[0]
    pressing = dict.fromkeys(pair for hold in holds for pair in hold.contacts)
    owner = ' and '.join(hold.owner for hold in holds)
    return Hold(mechanism, frame, scene, tuple(pressing), owner, only.stability)


def _check_steps(
    mechanism: Mechanism, stretch: Stretch, scenes: Scenes, events: Events, record: Recorder
) -> None:
    for frame in range(stretch.first + 1, stretch.last + 1):
        balanced = stretch.stability == 'second_order' and len(stretch.contacts) == 2
        before, after = scenes[frame - 1], scenes[frame]
        middle = halfway(mechanism, before, after, stretch.contacts, balanced)
        bend = max(0.0, middle.gap - TOUCH) / (mechanism.lever * max(middle.turn, 1e-9) ** 2)
        half = 'half-way from the frame before'
        what = f'gap of {middle.gap:.3g} m {half}, divided by lever and turn squared,'
        record.measure('between_gap', bend, frame, what)
        detour = middle.detour if middle.reached else math.inf
        what = f'distance of the contacts {half}, divided by the step,'
        if not record.measure('between_motion', detour, frame, what):
            continue
        for body, outline in middle.scene.outlines.items():
            depth = overlap_depth(middle.scene.object, outline) / mechanism.size
            what = f'depth of the object in {body} {half}, divided by its size,'
            record.measure('between_penetration', depth, frame, what)
        if stretch.last == stretch.first + 1:
            # Without a frame inside the segment this is the only place to look at its inside.
            check_ends_alone(stretch, events[stretch.first], events[stretch.last], record)
            hold = _hold(mechanism, stretch, frame, middle.scene)
            near = {*events[stretch.first], *events[stretch.last]}
            _check_inside(mechanism, stretch, hold, near, record)


def _check_inside(
    mechanism: Mechanism, stretch: Stretch, hold: Hold, events: Collection[str], record: Recorder
) -> None:
    check_inside_contacts(mechanism, stretch, hold.frame, hold.scene, events, record)
    check_stable(hold, record)
    check_class(hold, True, record)


def _hold(mechanism: Mechanism, stretch: Stretch, frame: int, scene: Scene) -> Hold:
    owner = f'segment {stretch.number}'
    return Hold(mechanism, frame, scene, stretch.contacts, owner, stretch.stability)
