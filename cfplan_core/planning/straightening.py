"""Ways over a grid made straight, as far as the formation and a margin allow."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.mesh import Mesh
from cfplan_core.planning.mesh_search import Way
from cfplan_core.planning.pieces import Region
from cfplan_core.planning.region_motion import straight_motion
from cfplan_core.planning.roadmap import Roadmap
from cfplan_core.planning.search import Leg
from cfplan_core.planning.ways import joint_length

# Shorter by less than this, in rad, is not shorter.
_GAIN = 1e-9


def legs_of(mesh: Mesh, way: Way) -> list[Leg]:
    """Turn a way into legs, one for each piece that it moves on; one of one point if it does not.

    Args:
        mesh: That the way is on.
        way: From start to goal.
    """
    legs: list[Leg] = []
    parts: list[FloatArray] = []
    for (node, other), motion in zip(pairwise(way.nodes), way.motions, strict=True):
        if motion.piece is not None and np.abs(mesh.z[node] - mesh.z[other]).max() > 0.0:
            parts.append(motion.towards(other))
        if motion.piece is None or other == way.nodes[-1]:
            if parts:
                piece = mesh.pieces[node]
                points = np.concatenate([parts[0], *(part[1:] for part in parts[1:])])
                legs.append(Leg(piece.index, piece.formation, piece.stability, points))
            parts = []
    if not legs:
        piece, z = mesh.pieces[way.nodes[0]], mesh.z[way.nodes[0]]
        legs.append(Leg(piece.index, piece.formation, piece.stability, z[None]))
    return legs


def straightened(
    roadmap: Roadmap, legs: Sequence[Leg], good: Callable[[Leg], bool] = lambda leg: True
) -> list[Leg]:
    """Replace parts of legs in regions by straight motions where these are shorter.

    Args:
        roadmap: That the legs are on.
        legs: One after the other.
        good: Says whether a straight motion may be taken.
    """
    return [
        _straightened(roadmap, piece, leg, good)
        if isinstance(piece := roadmap.pieces[leg.piece], Region)
        else leg
        for leg in legs
    ]


def _straightened(roadmap: Roadmap, region: Region, leg: Leg, good: Callable[[Leg], bool]) -> Leg:
    """Go from each point straight to the farthest that can be reached, found by halving."""
    points = leg.points
    parts, at = [points[:1]], 0
    while at < len(points) - 1:
        ahead = len(points) - 1
        while ahead > at + 1:
            straight = straight_motion(roadmap, region, points[at], points[ahead])
            if straight is not None:
                shorter = joint_length(straight) < joint_length(points[at : ahead + 1]) - _GAIN
                if shorter and good(replace(leg, points=straight)):
                    break
            ahead = at + (ahead - at) // 2
        else:
            straight = None
        parts.append(points[at + 1 : ahead + 1] if straight is None else straight[1:])
        at = ahead
    return replace(leg, points=np.concatenate(parts))
