"""Turn a path through contact formations into the frames and segments of a plan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cfplan_core.contact.detection import touching
from cfplan_core.contact.gaps import gap_gradients
from cfplan_core.contact.system import BoolArray, ContactSystem
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import ContactModel, Stability
from cfplan_core.options import ACCELERATION, TrajectoryOptions
from cfplan_core.planning.bounds import Bound
from cfplan_core.planning.efforts import within_efforts
from cfplan_core.planning.equations import equation_gradients, formation_rows
from cfplan_core.planning.manifold import formation_equations, project, settle_in
from cfplan_core.planning.search import Leg
from cfplan_core.planning.stability_classes import split_by_class
from cfplan_core.planning.tracing import STABILITY_MARGIN, Tracer
from cfplan_core.planning.transitions import TOUCH
from cfplan_core.trajectory.inertia import moving_masses
from cfplan_core.trajectory.plan_result import Segment
from cfplan_core.trajectory.segment_ends import contact_events
from cfplan_core.trajectory.timing import frame_times, rest_frames
from cfplan_core.trajectory.torque_profile import TorqueProfile

# Largest change between frames of a joint or of the object's angle, in rad, and of its position,
# in object sizes. The format cfplan/plan/1 allows 0.05 of each; half of that for the position
# holds also where a reader takes the object's radius for its size.
_LARGEST_TURN = 0.048
_LARGEST_SHIFT = 0.024
# Frames inside a segment nearer than this are left out.
_SMALLEST = 0.01
# Steps of a curve are at most a few times too large.
_HALVINGS = 10


@dataclass(frozen=True, eq=False)
class Frames:
    """Frames of a plan in SI units, without names; see `PlanResult` for the shapes."""

    times: FloatArray
    joints: FloatArray
    object_poses: FloatArray
    torque_lower: FloatArray
    torque_upper: FloatArray
    segments: tuple[Segment, ...]
    entry_lower: FloatArray
    entry_upper: FloatArray
    torque_nominal: FloatArray
    entry_nominal: FloatArray


def overloaded_legs(system: ContactSystem, model: ContactModel, legs: Sequence[Leg]) -> list[int]:
    """Tell which legs no torques within the joints' effort limits can hold, by index."""
    return [
        index
        for index, leg in enumerate(legs)
        if not within_efforts(system, model, leg.formation, leg.points).all()
    ]


def straying_legs(
    system: ContactSystem, legs: Sequence[Leg], bounds: Sequence[Bound]
) -> dict[int, str]:
    """Tell which legs have frames beyond a bound: their indices, each with the bound's reason."""
    straying: dict[int, str] = {}
    for index, leg in enumerate(legs if bounds else ()):
        z = _evenly(system, leg)
        gradients = gap_gradients(system, system.place(z), leg.formation.array)
        for bound in bounds:
            if not (bound.margins(z, gradients) >= 0.0).all():
                straying.setdefault(index, bound.reason)
    return straying


def grazing_legs(system: ContactSystem, legs: Sequence[Leg]) -> list[int]:
    """Tell in which legs a contact that they do not name touches all the way, by index.

    These have no frame between their ends, and it touches at both: they run along the border of
    their contact formation, by less than frames can show.
    """
    grazing = []
    for index, leg in enumerate(legs):
        ends = _evenly(system, leg)
        if len(ends) == 2:
            both = set.intersection(*(set(touching(system, z, TOUCH).tolist()) for z in ends))
            if both - set(leg.formation.pairs):
                grazing.append(index)
    return grazing


def build_frames(
    system: ContactSystem,
    model: ContactModel,
    legs: Sequence[Leg],
    options: TrajectoryOptions = TrajectoryOptions(),  # noqa: B008 - it is immutable
) -> Frames:
    """Sample a path into frames.

    A frame shared by two segments carries the torque limits of the earlier one. Times follow from
    limits of velocity and acceleration (`frame_times`).

    Args:
        system: Compiled problem.
        model: Gives the torque limits.
        legs: From start to goal, each beginning where the one before ends.
        options: Of the torque profile and of the times.
    """
    profile = TorqueProfile(system, model, options.squeeze)
    tracer = Tracer(system, model)
    points: list[FloatArray] = []
    lower: list[FloatArray] = []
    upper: list[FloatArray] = []
    segments: list[Segment] = []
    entry_lower: list[FloatArray] = []
    entry_upper: list[FloatArray] = []
    first = 0
    for leg in legs:
        for stability, z in _parts(tracer, leg, _evenly(system, leg)):
            gradients = gap_gradients(system, system.place(z), leg.formation.array)
            low, high = _torque_limits(system, model, gradients, z)
            contacts = system.contact_names(leg.formation.pairs)
            needed = float(model.needed_forces(gradients).max())
            last = first + len(z) - 1
            segments.append(Segment(contacts, stability.value, first, last, needed))
            profile.add(leg.formation, z, gradients, (low, high))
            entry_lower.append(low[0])
            entry_upper.append(high[0])
            shared = 1 if points else 0
            points.append(z[shared:])
            lower.append(low[shared:])
            upper.append(high[shared:])
            first += len(z) - 1
    z = np.concatenate(points)
    torques = profile.joined()
    return Frames(
        _times(system, z, segments, options),
        z[:, 3:],
        system.object_poses(z),
        np.concatenate(lower),
        np.concatenate(upper),
        tuple(
            replace(segment, control=control)
            for segment, control in zip(segments, torques.controls, strict=True)
        ),
        np.array(entry_lower),
        np.array(entry_upper),
        torques.torques,
        torques.entries,
    )


def _times(
    system: ContactSystem,
    z: FloatArray,
    segments: Sequence[Segment],
    options: TrajectoryOptions,
) -> FloatArray:
    """Times of the frames, which are all of the plan."""
    hand, joints = system.problem.hand.joints, z[:, 3:]
    masses, inertial = moving_masses(system, z, options.inertia)
    path = np.concatenate([joints, masses], axis=1)
    acceleration = [joint.acceleration_limit or ACCELERATION for joint in hand]
    velocity = np.full(path.shape[1], np.inf)
    velocity[: len(hand)] = [joint.velocity_limit for joint in hand]
    pace = np.where(
        _near_events(joints, segments, options.event_distance), options.event_speed, 1.0
    )
    limits = np.concatenate([acceleration, inertial])
    rests = rest_frames(joints, segments)
    return frame_times(path, len(hand), velocity, limits, rests, pace)


def _near_events(joints: FloatArray, segments: Sequence[Segment], distance: float) -> BoolArray:
    """Tell which steps come nearer than a distance along the path to a contact event, (f - 1,)."""
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(joints, axis=0), axis=1))])
    near = np.zeros(len(joints) - 1, dtype=bool)
    for event in contact_events(segments):
        apart = np.abs(way - way[event])
        near |= np.minimum(apart[1:], apart[:-1]) < distance
    return near


def _steps(system: ContactSystem, z: FloatArray) -> FloatArray:
    """Size of the step from each point to the next, shape (s - 1,), by the largest allowed."""
    turn = np.abs(np.diff(z[:, 2:], axis=0)).max(axis=1) / _LARGEST_TURN
    # The plan gives the object's frame, its mechanics the centre of mass: both move slowly.
    frame = system.object_poses(z)[:, :2] / system.size
    shift = np.maximum(
        np.linalg.norm(np.diff(frame, axis=0), axis=1),
        np.linalg.norm(np.diff(z[:, :2], axis=0), axis=1),
    )
    return np.asarray(np.maximum(turn, shift / _LARGEST_SHIFT))


def _evenly(system: ContactSystem, leg: Leg) -> FloatArray:
    """Points of a leg with steps that are neither too large nor needlessly small."""
    kept = [leg.points[0]]
    for z in leg.points[1:-1]:
        apart = float(np.abs(z - kept[-1]).max())
        if apart >= _SMALLEST and float(np.abs(z - leg.points[-1]).max()) >= _SMALLEST:
            kept.append(z)
    if len(leg.points) > 1:
        kept.append(leg.points[-1])
    points = np.array(kept)
    for _ in range(_HALVINGS):
        large = np.flatnonzero(_steps(system, points) > 1.0)
        if not len(large):
            break
        middles = _middles(system, leg, points[large], points[large + 1])
        points = np.insert(points, large + 1, middles, axis=0)
    return points


def _parts(tracer: Tracer, leg: Leg, z: FloatArray) -> list[tuple[Stability, FloatArray]]:
    """Frames of a leg by stability class: one part, but where it changes between samples."""
    inner = tracer.margins(leg.formation, z).form_closure[1:-1] > STABILITY_MARGIN
    if (inner == (leg.stability is Stability.FORM_CLOSURE)).all():
        return [(leg.stability, z)]
    return split_by_class(tracer, leg.formation, z)


def _middles(system: ContactSystem, leg: Leg, before: FloatArray, after: FloatArray) -> FloatArray:
    """Points of a formation's manifold half way between neighbours, each of shape (s, 3 + n)."""
    free = np.ptp(leg.points, axis=0) > 0.0
    free[:3] = True
    if not free.all():
        # Joints that stand still do so between points, too.
        every = formation_rows(leg.formation.array)
        return np.array([settle_in(system, z, every, free) for z in 0.5 * (before + after)])
    rows, _ = formation_equations(system, leg.formation.array, before[0])
    gradients = equation_gradients(system, before, rows)
    basis = np.linalg.svd(gradients)[2][:, len(rows) :]
    return project(system, rows, before, basis, 0.5 * (before + after)).points


def _torque_limits(
    system: ContactSystem, model: ContactModel, gradients: FloatArray, z: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Actuator torques that keep the contacts, in N·m, each of shape (s, n)."""
    lower, upper = model.torque_limits(gradients)
    weight = system.link_weight_torques(z)
    unit = system.force_unit * system.size
    return (lower + weight) * unit, (upper + weight) * unit
