"""Goals in part that no configuration fulfils, seen from the bodies that they place.

A goal places the palm, the object if it gives position and angle, and the links of which it gives
all joints up to theirs. Within the tolerances no point of such a body can move farther than a
bound: where two of them overlap deeper than both bounds together, or a contact wanted between
them is farther apart, nothing needs to be searched.
"""

from __future__ import annotations

import math

import numpy as np

from cfplan_core.contact.elements import parse_contact
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.geometry.separation import penetration_depth
from cfplan_core.model import Goal, Problem
from cfplan_core.planning.grasp_check import TOUCHING, separate_bodies

# Outline of a body where the goal places it, shape (v, 2), and how far, in m, a point may move.
_Placed = tuple[FloatArray, float]


def why_impossible(problem: Problem, goal: Goal) -> str:
    """Say with numbers why nothing is within a goal's tolerances; empty if something may be."""
    placed = _placed(problem, goal)
    bodies = [('object', body) for body in placed if body != 'object']
    for pair in (*bodies, *separate_bodies(problem)):
        if not all(body in placed for body in pair):
            continue
        (a, slack_a), (b, slack_b) = (placed[body] for body in pair)
        depth, slack = penetration_depth(a, b), slack_a + slack_b
        if depth > slack + TOUCHING:
            return f'at the goal {pair[0]} and {pair[1]} overlap by {depth:.3g} m{_less(slack)}'
    for name in goal.contacts or ():
        contact = parse_contact(name)
        if not all(body in placed for body in ('object', contact.body)):
            continue
        (outline, slack_a), (hand, slack_b) = placed['object'], placed[contact.body]
        owner, other = (outline, hand) if contact.object_vertex else (hand, outline)
        ends = other[contact.edge], other[(contact.edge + 1) % len(other)]
        apart, slack = _distance(owner[contact.vertex], *ends), slack_a + slack_b
        if apart > slack + TOUCHING:
            return f'at the goal {name} is {apart:.3g} m apart{_less(slack)}'
    return ''


def _placed(problem: Problem, goal: Goal) -> dict[str, _Placed]:
    """Bodies that a goal places, by name."""
    hand, tolerance = problem.hand, goal.tolerance
    angles = goal.joints or {}
    joints = np.array([angles.get(name, 0.0) for name in hand.joint_names])
    outlines = hand.world_vertices(joints)
    placed = {f'palm.{k}': (vertices, 0.0) for k, vertices in enumerate(hand.palm)}
    for finger in hand.fingers:
        for k, link in enumerate(finger.links):
            if finger.joints[k].name not in angles:
                break
            # A turn about the joint of link i moves the point of link k that is farthest from it.
            own = float(np.linalg.norm(link.vertices, axis=1).max())
            reach = [
                sum(before.length for before in finger.links[i:k]) + own for i in range(k + 1)
            ]
            name = f'{finger.name}.{link.name}'
            placed[name] = (outlines[name], tolerance.joints * sum(reach))
    if goal.object_position is not None and goal.object_angle is not None:
        body = problem.object
        pose = np.append(goal.object_position, goal.object_angle)
        reach_of_object = float(np.linalg.norm(body.vertices, axis=1).max())
        turn = 2.0 * math.sin(0.5 * min(tolerance.angle, math.pi)) * reach_of_object
        placed['object'] = (body.world_vertices(pose), tolerance.position + turn)
    return placed


def _distance(point: FloatArray, start: FloatArray, end: FloatArray) -> float:
    """Distance of a point from a line segment."""
    along = end - start
    fraction = float(np.clip((point - start) @ along / (along @ along), 0.0, 1.0))
    return float(np.linalg.norm(point - start - fraction * along))


def _less(slack: float) -> str:
    return f', of which the tolerances can make up {slack:.3g} m'
