"""A last look at frames before they are given away, with the planner's own means.

A search that samples decides on many configurations by linear estimates, and frames lie between
those that it has looked at. So all that a plan promises is looked at once more, frame by frame:
that the contacts named touch and no others, that nothing overlaps, that every segment is held in
the class that it claims, by torques within the joints' efforts, and that motion is smooth. The
certificate of a plan is `cfplan_core.verification`, which shares nothing with the planner; this
is what keeps the planner from handing out what would not pass there. Limits are those of that
package with some reserve.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from cfplan_core.contact.elements import parse_contact
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.gaps import gap_gradients, gaps, wedge_lifts
from cfplan_core.contact.system import BoolArray, ContactSystem, IntArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.geometry.separation import penetration_depth
from cfplan_core.mechanics.contact_model import ContactModel, Stability
from cfplan_core.model import Grasp
from cfplan_core.planning.efforts import within_efforts
from cfplan_core.planning.manifold import independent_rows, project, tangent_basis
from cfplan_core.trajectory.frames import Frames
from cfplan_core.trajectory.plan_result import Segment

# In m: a contact that is named touches, one that is not is farther apart but beside an event.
_TOUCHING = 5e-7
_APART = 1.5e-6
_JUST_APART = 2e-8
# In m: depth of overlap in a frame, and in object sizes half-way between two.
_DEEP = 5e-7
_DEEP_BETWEEN = 8e-4
# Form-closure margin up to which a grasp may be called one of force closure.
_HAIR = 5e-5
_LARGEST_STEP = 0.05
# Part of a step by which the configuration half-way may be off the contacts.
_BEND = 0.2


def flaw(system: ContactSystem, model: ContactModel, frames: Frames) -> str | None:
    """Say what is wrong with a plan.

    Args:
        system: Compiled problem, with all joints.
        model: Judges stability.
        frames: The plan.

    Returns:
        What was promised and does not hold, the first that is found; None if all holds.
    """
    grasps = zip(frames.object_poses, frames.joints, strict=True)
    z = np.array([system.configuration(Grasp(pose, joints)) for pose, joints in grasps])
    if (z[:, 3:] < system.lower - 1e-9).any() or (z[:, 3:] > system.upper + 1e-9).any():
        return 'a joint would be beyond its limit'
    if _overlap(system, z, _DEEP):
        return 'bodies would overlap'
    ends = {segment.first_frame for segment in frames.segments}
    ends.add(len(z) - 1)
    touched = {frame: set(_near(system, z[frame], _APART).tolist()) for frame in sorted(ends)}
    for segment in frames.segments:
        part = z[segment.first_frame : segment.last_frame + 1]
        events = touched[segment.first_frame], touched[segment.last_frame]
        found = _segment_flaw(system, model, segment, part, events)
        if found is not None:
            return found
    return None


def _segment_flaw(
    system: ContactSystem,
    model: ContactModel,
    segment: Segment,
    z: FloatArray,
    events: tuple[set[int], set[int]],
) -> str | None:
    """Say what is wrong with a segment's frames, shape (s, 3 + n).

    Args:
        system: Compiled problem.
        model: Judges stability.
        segment: Contacts and class.
        z: The frames.
        events: What touches at its first and at its last frame.
    """
    pairs = sorted(system.pair(parse_contact(name)) for name in segment.contacts)
    formation = Formation(tuple(pairs))
    if _distance(system, z, formation.array).max() * system.size > _TOUCHING:
        return 'a contact would not touch'
    if not within_efforts(system, model, formation, z).all():
        return 'a joint would exceed its effort limit'
    inside = z[1:-1]
    if len(z) > 1:
        steps = np.diff(z, axis=0)
        shift = np.linalg.norm(steps[:, :2], axis=1)
        if max(float(np.abs(steps[:, 2:]).max()), float(shift.max())) > _LARGEST_STEP:
            return 'a step would be too long'
        middles, bend = _middles(system, formation, z)
        if not bend <= _BEND:
            return 'motion would leap'
        if _overlap(system, middles, _DEEP_BETWEEN * system.size):
            return 'bodies would overlap between two frames'
        if len(z) == 2:
            inside = middles
            if (events[0] & events[1]) - set(formation.pairs):
                return 'an unnamed contact would touch'
    for index, configuration in enumerate(inside):
        beside = events[0] if index == 0 else set()
        beside = beside | events[1] if index == len(inside) - 1 else beside
        near = _near(system, configuration, _APART)
        others = np.array([int(p) for p in near if int(p) not in formation], dtype=np.intp)
        if any(int(p) not in beside for p in others):
            return 'an unnamed contact would touch'
        if len(others) and set(others.tolist()) & set(
            _near(system, configuration, _JUST_APART).tolist()
        ):
            return 'an unnamed contact would touch'
    return _held(system, model, segment, formation, inside)


def _held(
    system: ContactSystem,
    model: ContactModel,
    segment: Segment,
    formation: Formation,
    inside: FloatArray,
) -> str | None:
    """Say whether configurations inside a segment, shape (s, 3 + n), are held as it claims."""
    if not len(inside):
        return None
    placed = system.place(inside)
    margins = model.margins(gap_gradients(system, placed, formation.array))
    if not (margins.stable > 0.0).all():
        return 'stability would be lost'
    closed = margins.form_closure
    form = segment.stability == Stability.FORM_CLOSURE.value
    if not (closed > 0.0 if form else closed < _HAIR).all():
        return 'the stability class would change'
    vertices = placed.vertices[:, system.pair_vertex[formation.array]] * system.size
    body = system.pair_body[formation.array]
    same = np.triu(body[:, None] == body, 1)
    distances = np.abs(vertices[:, :, None] - vertices[:, None, :])[:, same]
    return 'two contacts would coincide' if (distances < _APART).any() else None


def _distance(system: ContactSystem, z: FloatArray, pairs: IntArray) -> FloatArray:
    """Distances, shape (s, k), of vertices from edges, in object sizes."""
    gap, offset = gaps(system, system.place(z), pairs)
    beyond = np.maximum(np.maximum(-offset, offset - system.pair_length[pairs]), 0.0)
    return np.asarray(np.hypot(gap, beyond))


def _near(system: ContactSystem, z: FloatArray, tolerance: float) -> IntArray:
    """Contacts whose vertex, from outside, is nearer to the edge than a tolerance in m."""
    near = tolerance / system.size
    everything: IntArray = np.arange(system.contact_count)
    pairs: IntArray = np.flatnonzero(_distance(system, z[None], everything)[0] <= near)
    placed = system.place(z[None])
    behind, before = (lift[0] for lift in wedge_lifts(system, placed, pairs))
    vertex = system.pair_vertex[pairs]
    dip = behind * system.edge_length[vertex]
    dip = np.minimum(dip, before * system.edge_length[system.previous_vertex[vertex]])
    return np.asarray(pairs[dip >= -2.0 * max(tolerance, _APART) / system.size])


def _overlap(system: ContactSystem, z: FloatArray, deep: float) -> bool:
    """Tell whether bodies that may not reach deeper, in m, into each other in some z."""
    vertices = system.place(z).vertices * system.size
    first = system.first_vertex
    bodies = np.split(np.arange(len(system.body_of)), first[1:])
    outlines = np.stack([vertices.real, vertices.imag], axis=-1)
    low = np.stack([outlines[:, body].min(axis=1) for body in bodies], axis=1)
    high = np.stack([outlines[:, body].max(axis=1) for body in bodies], axis=1)
    one, other = system.body_of[system.pair_vertex], system.body_of[system.pair_edge]
    apart = np.unique(np.sort(np.stack([one, other], axis=1), axis=1), axis=0)
    for a, b in apart:
        reach = np.minimum(high[:, a] - low[:, b], high[:, b] - low[:, a])
        meet: BoolArray = np.asarray((reach > deep).all(axis=-1))
        for k in np.flatnonzero(meet):
            if penetration_depth(outlines[k, bodies[a]], outlines[k, bodies[b]]) > deep:
                return True
    return False


def _middles(
    system: ContactSystem, formation: Formation, z: FloatArray
) -> tuple[FloatArray, float]:
    """Configurations half-way between frames, on the contacts, and how far they had to go there.

    Args:
        system: Compiled problem.
        formation: The contacts.
        z: Shape (s, 3 + n).

    Returns:
        Shape (s - 1, 3 + n), and the largest way by the length of the step; nan if one was lost.
    """
    found, bend = [], 0.0
    for before, after in pairwise(z):
        middle = 0.5 * (before + after)
        gradients = gap_gradients(system, system.place(middle[None]), formation.array)[0]
        rows = list(independent_rows(gradients))
        basis = tangent_basis(gradients[rows])
        projected = project(system, formation.array[rows], middle, basis, middle[None])
        way = float(np.linalg.norm(projected.points[0] - middle))
        length = max(float(np.linalg.norm(after - before)), 1e-6)
        bend = max(bend, way / length) if projected.converged[0] else np.nan
        if not projected.converged[0]:
            return z[:-1], bend
        found.append(projected.points[0])
    return np.array(found), bend
