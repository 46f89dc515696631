"""Ways on a sheet, straight in joint space, and what they lead to.

Most are steps that are judged many at once; those that cannot be are followed exactly.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cfplan_core.contact.formation import Formation
from cfplan_core.contact.system import IntArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.events import OPEN_EVENTS, EventKind
from cfplan_core.planning.manifold import project
from cfplan_core.planning.sheet_events import locate_first
from cfplan_core.planning.sheet_steps import take_steps
from cfplan_core.planning.stability_classes import split_by_class
from cfplan_core.planning.tracing import Trace, Tracer

_ARRIVED = 1e-9
_LONGEST = 10.0
# Steps that a way is divided into where one is too long.
_PARTS = 8


@dataclass(frozen=True, eq=False)
class Walk:
    """What a way led to.

    Attributes:
        points: Shape (s, 3 + n), from its beginning.
        arrived: True if the joints have the angles wanted.
        leads_on: True if it ends at a border that other formations or classes may lie behind.
        changes_class: True if only the stability class changes there.
    """

    points: FloatArray
    arrived: bool = False
    leads_on: bool = False
    changes_class: bool = False


def walk(
    tracer: Tracer,
    formation: Formation,
    rows: IntArray,
    starts: FloatArray,
    joints: FloatArray,
) -> list[Walk]:
    """Go from configurations towards joint angles, straight in joint space.

    Args:
        tracer: Knows system and model.
        formation: The contacts.
        rows: Three of their equations that are independent for fixed joints.
        starts: Shape (m, 3 + n), stable.
        joints: Shape (m, n).
    """
    ways = _at_once(tracer, formation, rows, starts, joints)
    open_ends = [k for k, way in enumerate(ways) if way is None]
    if open_ends:
        parts = _in_parts(tracer, formation, rows, starts[open_ends], joints[open_ends])
        for k, way in zip(open_ends, parts, strict=True):
            ways[k] = way or _exactly(tracer, formation, rows, starts[k], joints[k])
    return [way for way in ways if way is not None]


def _at_once(
    tracer: Tracer,
    formation: Formation,
    rows: IntArray,
    starts: FloatArray,
    joints: FloatArray,
) -> list[Walk | None]:
    """Ways of one step each; None where that is too long."""
    taken = take_steps(tracer, formation, rows, starts, joints)
    samples = np.stack([starts, taken.middles, taken.ends], axis=1)
    met = locate_first(tracer, formation, rows, samples, taken.happenings)
    ways: list[Walk | None] = []
    for k in range(len(starts)):
        if taken.clear[k]:
            ways.append(Walk(samples[k], arrived=True))
        elif taken.lost[k]:
            ways.append(Walk(starts[k : k + 1]))
        elif met.found[k]:
            inner = samples[k, : 2 if met.late[k] else 1]
            points = np.concatenate([inner, met.z[k : k + 1]])
            ways.append(Walk(points, leads_on=bool(met.open[k])))
        else:
            ways.append(None)
    return ways


def _in_parts(
    tracer: Tracer,
    formation: Formation,
    rows: IntArray,
    starts: FloatArray,
    joints: FloatArray,
) -> list[Walk | None]:
    """Ways of some equal steps each; None where these are too long as well."""
    parts = [[start[None]] for start in starts]
    ended: list[Walk | None] = [None] * len(starts)
    going = list(range(len(starts)))
    for part in range(1, _PARTS + 1):
        if not going:
            break
        at = np.array([parts[k][-1][-1] for k in going])
        ahead = starts[going, 3:] + part / _PARTS * (joints[going] - starts[going, 3:])
        onwards = []
        for k, way in zip(going, _at_once(tracer, formation, rows, at, ahead), strict=True):
            if way is None:
                continue
            parts[k].append(way.points[1:])
            if way.arrived and part < _PARTS:
                onwards.append(k)
            else:
                ended[k] = replace(way, points=np.concatenate(parts[k]))
        going = onwards
    return ended


def _exactly(
    tracer: Tracer, formation: Formation, rows: IntArray, z: FloatArray, joints: FloatArray
) -> Walk:
    trace = towards(tracer, formation, z, joints)
    if len(trace.points) < 2:
        return Walk(trace.points, arrived=trace.kind is EventKind.TARGET)
    (_, points), *others = split_by_class(tracer, formation, trace.points)
    if others:
        return Walk(points, leads_on=True, changes_class=True)
    if trace.kind is EventKind.TARGET:
        guess = np.concatenate([points[-1, :3], joints])[None]
        found = project(tracer.system, rows, guess[0], np.eye(len(z))[3:], guess)
        return Walk(np.concatenate([points[:-1], found.points]), arrived=True)
    return Walk(points, leads_on=trace.kind in OPEN_EVENTS)


def towards(tracer: Tracer, formation: Formation, z: FloatArray, joints: FloatArray) -> Trace:
    """Follow a formation from z to where the joints have given angles."""

    def steer(at: FloatArray, basis: FloatArray) -> FloatArray | None:
        off = joints - at[3:]
        if np.abs(off).max() <= _ARRIVED:
            return None
        return np.asarray(np.linalg.lstsq(basis[:, 3:].T, off, rcond=1e-12)[0] @ basis)

    return tracer.follow(formation, z, steer, longest=_LONGEST)
