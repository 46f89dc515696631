"""Which vertex touches which edge: distances from shapely."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
import shapely

from cfplan_core.verification.checks import TOUCH
from cfplan_core.verification.mechanism import FloatArray, Mechanism, Scene

NAME = re.compile(r'object\.([ve])(\d+)\|(.+)\.([ve])(\d+)')


@dataclass(frozen=True)
class Pair:
    """An elemental contact.

    Attributes:
        name: As in the plan.
        body: Name of the hand's body.
        on_object: True if the vertex is the object's and the edge the hand's.
        vertex: Index of the vertex.
        edge: Index of the edge, which runs to the next vertex.
    """

    name: str
    body: str
    on_object: bool
    vertex: int
    edge: int


@dataclass(frozen=True)
class Touch:
    """A pair in a scene.

    Attributes:
        point: The vertex, complex, m.
        normal: Unit normal of the edge, from the hand into the object, complex.
        gap: Distance from the edge's line, m; negative if the vertex is on the inner side.
        distance: From the edge, which ends at its vertices, m.
        depth: How far the vertex's body reaches to the inner side of the edge's line beside the
            vertex, m: 0 for a contact from outside; the whole of an adjacent edge counts.
        salient: True if the vertex is convex, so that it can touch an edge.
    """

    point: complex
    normal: complex
    gap: float
    distance: float
    depth: float
    salient: bool


def parse_pair(name: str, mechanism: Mechanism) -> Pair:
    """Resolve a contact's name.

    Raises:
        ValueError: It is malformed, or names a body, vertex or edge that does not exist.
    """
    match = NAME.fullmatch(name)
    if match is None or match[1] == match[4]:
        raise ValueError(f'contact {name!r}: expected object.vK|BODY.eJ or object.eK|BODY.vJ')
    body = match[3]
    if body not in mechanism.bodies:
        raise ValueError(f'contact {name!r}: body {body!r} is not one of {list(mechanism.bodies)}')
    ours, theirs = int(match[2]), int(match[5])
    on_object = match[1] == 'v'
    for owner, index, count in (
        ('object', ours, len(mechanism.problem.object.vertices)),
        (body, theirs, len(mechanism.bodies[body].outline)),
    ):
        if index >= count:
            raise ValueError(f'contact {name!r}: {owner} has elements 0 to {count - 1} only')
    if on_object:
        return Pair(name, body, True, ours, theirs)
    return Pair(name, body, False, theirs, ours)


def locate(pair: Pair, scene: Scene) -> Touch:
    """Measure a pair in a scene."""
    hand = scene.outlines[pair.body]
    owner, other = (scene.object, hand) if pair.on_object else (hand, scene.object)
    a, b = other[pair.edge], other[(pair.edge + 1) % len(other)]
    point = owner[pair.vertex]
    before, after = owner[pair.vertex - 1], owner[(pair.vertex + 1) % len(owner)]
    along = (b - a) / np.hypot(*(b - a))
    outward = np.array([along[1], -along[0]])
    incoming, outgoing = point - before, after - point
    turn = incoming[0] * outgoing[1] - incoming[1] * outgoing[0]
    into_object = outward if pair.on_object else -outward
    return Touch(
        point=complex(*point),
        normal=complex(*into_object),
        gap=float(outward @ (point - a)),
        distance=float(shapely.distance(shapely.Point(point), shapely.LineString([a, b]))),
        depth=max(0.0, float(-outward @ -incoming), float(-outward @ outgoing)),
        salient=bool(turn > 1e-9 * np.hypot(*incoming) * np.hypot(*outgoing)),
    )


def touching_pairs(mechanism: Mechanism, scene: Scene) -> dict[str, tuple[Pair, Touch]]:
    """Find every pair that touches from outside.

    Returns:
        Contact name to pair and its place.
    """
    found = {}
    for body, outline in scene.outlines.items():
        for on_object, owner, other in (
            (True, scene.object, outline),
            (False, outline, scene.object),
        ):
            for vertex, edge in _near(owner, other):
                ours, theirs = (
                    (f'v{vertex}', f'e{edge}') if on_object else (f'e{edge}', f'v{vertex}')
                )
                pair = Pair(f'object.{ours}|{body}.{theirs}', body, on_object, vertex, edge)
                touch = locate(pair, scene)
                if touch.salient and touch.depth <= 2.0 * TOUCH:
                    found[pair.name] = (pair, touch)
    return found


def _near(points: FloatArray, outline: FloatArray) -> list[tuple[int, int]]:
    """Pairs (point, edge of the outline) that are at most `TOUCH` apart."""
    spots = shapely.points(points)
    ring = shapely.linearrings(outline)
    candidates = np.flatnonzero(shapely.dwithin(spots, ring, TOUCH))
    if len(candidates) == 0:
        return []
    edges = shapely.linestrings(np.stack([outline, np.roll(outline, -1, axis=0)], axis=1))
    rows, columns = np.nonzero(shapely.dwithin(spots[candidates][:, None], edges[None, :], TOUCH))
    return [(int(candidates[row]), int(column)) for row, column in zip(rows, columns, strict=True)]
