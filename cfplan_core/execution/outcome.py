"""What became of a plan: how far the object strayed, which contacts it lost, which torques."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cfplan_core.contact.elements import parse_contact
from cfplan_core.contact.gaps import gaps
from cfplan_core.contact.system import BoolArray, ContactSystem, IntArray
from cfplan_core.execution.feedforward import segment_gradients
from cfplan_core.execution.reference import Reference
from cfplan_core.execution.simulation import Run
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_forces import configurations
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.trajectory.plan_result import PlanResult

# A contact is lost where its gap is wider than this, in sizes of the object.
_OPEN = 0.01
# A contact is made where it is nearer than this and presses with more than this, in weights.
_NEAR = 0.003
_PRESSING = 0.02
# At either end of a segment this part of it does not count where torques are compared: drives
# switch there.
_TRANSIENT = 0.15


@dataclass(frozen=True)
class ContactEvent:
    """A contact that was lost although planned, or made although not.

    Attributes:
        time: s from the plan's start.
        segment: Index of the plan's segment at that time.
        contact: Name of the elemental contact.
    """

    time: float
    segment: int
    contact: str


@dataclass(frozen=True)
class Tolerance:
    """How near the object must end to its last pose in the plan: m, rad."""

    position: float
    angle: float


@dataclass(frozen=True, eq=False)
class Outcome:
    """An execution against its plan.

    Attributes:
        final_position_error: Distance of the object's centre of mass from where it should end, m.
        final_angle_error: rad.
        largest_position_deviation: Likewise on the way, from where the plan has it then, m.
        largest_angle_deviation: rad.
        in_goal: True if the object ends within the tolerance.
        tolerance: Which.
        lost: Planned contacts, each when it was first lost in each segment, in order of time.
        made: Contacts that neither the segment nor one beside it plans, when first made.
        kept: For each segment the part of its time in which all its contacts touched.
        torque_excess: Shape (n,), largest torque beyond the limits inside segments, in weights
            times sizes of the object.
        effort: Shape (n,), largest torque, N·m.
    """

    final_position_error: float
    final_angle_error: float
    largest_position_deviation: float
    largest_angle_deviation: float
    in_goal: bool
    tolerance: Tolerance
    lost: tuple[ContactEvent, ...]
    made: tuple[ContactEvent, ...]
    kept: tuple[float, ...]
    torque_excess: FloatArray
    effort: FloatArray


def assess(
    system: ContactSystem,
    planned: ContactSystem,
    result: PlanResult,
    reference: Reference,
    run: Run,
    tolerance: Tolerance,
) -> Outcome:
    """Compare an execution with its plan.

    Args:
        system: Of the world that the plan was executed in; gaps are measured there.
        planned: Of the plan's problem.
        result: The plan.
        reference: What was asked of the drives.
        run: What happened.
        tolerance: At the end.
    """
    z = configurations(planned, run.object_poses, run.joints)
    wanted = configurations(planned, reference.object_poses, reference.joints)[run.rows]
    shift = np.hypot(*(z - wanted)[:, :2].T) * planned.size
    turn = np.abs((z - wanted)[:, 2])
    segments = reference.segments[run.rows]
    touching, near = _touching(system, run)
    lost, kept = _losses(system, result, segments, run.times, touching)
    return Outcome(
        final_position_error=float(shift[-1]),
        final_angle_error=float(turn[-1]),
        largest_position_deviation=float(shift.max()),
        largest_angle_deviation=float(turn.max()),
        in_goal=bool(shift[-1] <= tolerance.position and turn[-1] <= tolerance.angle),
        tolerance=tolerance,
        lost=lost,
        made=_made(system, result, segments, run, near),
        kept=kept,
        torque_excess=_torque_excess(planned, result, segments, reference, run),
        effort=np.abs(run.torques).max(axis=0),
    )


def _touching(system: ContactSystem, run: Run) -> tuple[BoolArray, BoolArray]:
    """Tell which contacts touch within the wide and within the narrow gap, each (m, contacts)."""
    placed = system.place(configurations(system, run.object_poses, run.joints))
    everything = slice(0, system.contact_count)
    gap, offset = gaps(system, placed, everything)
    length = system.pair_length[everything]

    def within(reach: float) -> BoolArray:
        beside = (offset >= -reach) & (offset <= length + reach)
        return np.asarray((np.abs(gap) <= reach) & beside)

    return within(_OPEN), within(_NEAR)


def _losses(
    system: ContactSystem,
    result: PlanResult,
    segments: IntArray,
    times: FloatArray,
    touching: BoolArray,
) -> tuple[tuple[ContactEvent, ...], tuple[float, ...]]:
    lost, kept = [], []
    for k, segment in enumerate(result.segments):
        inside = np.flatnonzero(segments == k)
        pairs = np.array([system.pair(parse_contact(name)) for name in segment.contacts])
        holds = touching[np.ix_(inside, pairs)]
        kept.append(float(holds.all(axis=1).mean()) if len(inside) else 1.0)
        for column, name in enumerate(segment.contacts):
            open_at = np.flatnonzero(~holds[:, column])
            if len(open_at):
                lost.append(ContactEvent(float(times[inside[open_at[0]]]), k, name))
    return tuple(sorted(lost, key=lambda event: event.time)), tuple(kept)


def _made(
    system: ContactSystem,
    result: PlanResult,
    segments: IntArray,
    run: Run,
    near: BoolArray,
) -> tuple[ContactEvent, ...]:
    everything = slice(0, system.contact_count)
    vertex = system.pair_vertex[everything]
    body = system.body_of[system.pair_edge[everything]]
    pressing = near & (run.forces[:, vertex, body] > _PRESSING * system.force_unit)
    placed = system.place(configurations(system, run.object_poses, run.joints))
    points = placed.vertices[:, vertex]
    made = []
    for k in range(len(result.segments)):
        beside = result.segments[max(0, k - 1) : k + 2]
        names = dict.fromkeys(name for segment in beside for name in segment.contacts)
        known = np.array([system.pair(parse_contact(name)) for name in names], dtype=np.intp)
        inside = np.flatnonzero((segments == k) & pressing.any(axis=1))
        for p in np.flatnonzero(pressing[inside].any(axis=0)):
            # Where a vertex lies on a vertex, the same contact has several names.
            same = known[system.pair_body[known] == system.pair_body[p]]
            apart = np.abs(points[np.ix_(inside, same)] - points[inside, p, None])
            elsewhere = pressing[inside, p] & (apart > _OPEN).all(axis=1)
            if elsewhere.any():
                time = float(run.times[inside[elsewhere.argmax()]])
                made.append(ContactEvent(time, k, system.contact_names([int(p)])[0]))
    return tuple(sorted(made, key=lambda event: event.time))


def _torque_excess(
    planned: ContactSystem,
    result: PlanResult,
    segments: IntArray,
    reference: Reference,
    run: Run,
) -> FloatArray:
    model = FrictionlessModel(planned.load)
    unit = planned.force_unit * planned.size
    excess = np.zeros(run.torques.shape[1])
    clock = run.times + result.times[0]
    for k, segment in enumerate(result.segments):
        z, gradients = segment_gradients(planned, result, segment)
        lower, upper = model.torque_limits(gradients)
        weight = planned.link_weight_torques(z)
        own = result.times[segment.first_frame : segment.last_frame + 1]
        margin = _TRANSIENT * (own[-1] - own[0])
        inside = np.flatnonzero(
            (segments == k) & (clock >= own[0] + margin) & (clock <= own[-1] - margin)
        )
        if not len(inside):
            continue
        row = np.searchsorted(own, clock[inside]).clip(1, len(own) - 1)
        # Between two frames the wider of their limits: where one tends to infinity it is not
        # linear.
        low = np.fmin(lower + weight, np.inf)
        high = upper + weight
        low = np.minimum(low[row - 1], low[row])
        high = np.maximum(high[row - 1], high[row])
        torque = run.torques[inside] / unit
        beyond = np.maximum(low - torque, torque - high)
        excess = np.maximum(excess, np.nanmax(beyond, axis=0, initial=0.0))
    return excess
