"""From checked data to a problem."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cfplan_core.model.faults import Document, Path
from cfplan_core.model.hand import Finger, Hand, Joint, Link
from cfplan_core.model.problem import Goal, Grasp, ManipulatedObject, Problem, Tolerance


class _Unsound(Exception):
    """A value without which there is no problem is missing or wrong."""


def build_problem(document: Document) -> Problem | None:
    """Build a problem from all that is sound in its data.

    Bodies, gravity and the start must be sound. Any other value that is not, and on which no
    contact and no stability depends, is replaced by a neutral one, so that the grasps can be
    checked although, say, a velocity limit is missing: no limits for a joint, 1 rad/s, 1 N·m,
    an object of 1 kg, massless links, no friction, and a goal without its unsound parts.

    Args:
        document: A problem with all its faults.

    Returns:
        The problem, or None if too much is wrong.
    """
    try:
        hand = _hand(document)
        start = document.get('start', 'joints')
        if start is None:
            return None
        return Problem(
            name=document.get('name') or 'unnamed',
            gravity=np.array(_needed(document, 'gravity'), dtype=np.float64),
            hand=hand,
            object=_object(document),
            friction=_number(document, 0.0, 'contact', 'friction'),
            start=Grasp(
                object_pose=_needed(document, 'start', 'object_pose'),
                joints=np.array([start[name] for name in hand.joint_names], dtype=np.float64),
            ),
            goal=_goal(document, hand),
        )
    except _Unsound:
        return None


def _hand(document: Document) -> Hand:
    if document.faulty('hand', 'palm'):
        raise _Unsound
    palm = tuple(
        np.array(_needed(document, 'hand', 'palm', k, 'vertices'), dtype=np.float64)
        for k in document.indices('hand', 'palm')
    )
    fingers = tuple(
        _finger(document, ('hand', 'fingers', i)) for i in document.indices('hand', 'fingers')
    )
    if not fingers:
        raise _Unsound
    return Hand(palm, fingers)


def _finger(document: Document, path: Path) -> Finger:
    joints = [(*path, 'joints', k) for k in document.indices(*path, 'joints')]
    links = [(*path, 'links', k) for k in document.indices(*path, 'links')]
    if not joints or len(joints) != len(links):
        raise _Unsound
    return Finger(
        name=_needed(document, *path, 'name'),
        base=np.array(_needed(document, *path, 'base'), dtype=np.float64),
        base_angle=float(_needed(document, *path, 'base_angle')),
        joints=tuple(_joint(document, joint) for joint in joints),
        links=tuple(
            Link(
                name=_needed(document, *link, 'name'),
                length=float(_needed(document, *link, 'length')),
                vertices=np.array(_needed(document, *link, 'vertices'), dtype=np.float64),
                mass=_number(document, 0.0, *link, 'mass'),
            )
            for link in links
        ),
    )


def _joint(document: Document, path: Path) -> Joint:
    lower, upper = document.get(*path, 'limits') or (-math.inf, math.inf)
    acceleration = document.get(*path, 'acceleration_limit')
    return Joint(
        name=_needed(document, *path, 'name'),
        lower=float(lower),
        upper=float(upper),
        velocity_limit=_number(document, 1.0, *path, 'velocity_limit'),
        effort_limit=_number(document, 1.0, *path, 'effort_limit'),
        acceleration_limit=None if acceleration is None else float(acceleration),
    )


def _object(document: Document) -> ManipulatedObject:
    if document.faulty('object', 'center_of_mass'):
        raise _Unsound
    center = document.get('object', 'center_of_mass')
    return ManipulatedObject(
        vertices=np.array(_needed(document, 'object', 'vertices'), dtype=np.float64),
        mass=_number(document, 1.0, 'object', 'mass'),
        **({} if center is None else {'center_of_mass': np.array(center, dtype=np.float64)}),
    )


def _goal(document: Document, hand: Hand) -> Goal:
    pose = document.get('goal', 'object_pose')
    angles = document.get('goal', 'joints') or {}
    joints = {name: float(angles[name]) for name in hand.joint_names if name in angles}
    contacts = document.get('goal', 'contacts')
    # Beside a pose they are faults, see `content_faults`.
    position, orientation = (
        document.get('goal', key) if pose is None else None for key in ('position', 'orientation')
    )
    return Goal(
        object_pose=None if pose is None else np.array(pose, dtype=np.float64),
        joints=joints or None,
        contacts=None if contacts is None else tuple(contacts),
        tolerance=Tolerance(
            **{
                key: float(value)
                for key in ('position', 'angle', 'joints')
                if (value := document.get('goal', 'tolerance', key)) is not None
            }
        ),
        position=None if position is None else np.array(position, dtype=np.float64),
        orientation=None if orientation is None else float(orientation),
        exact_contacts=bool(document.get('goal', 'exact_contacts') and contacts),
    )


def _needed(document: Document, *path: str | int) -> Any:
    value = document.get(*path)
    if value is None:
        raise _Unsound
    return value


def _number(document: Document, neutral: float, *path: str | int) -> float:
    value = document.get(*path)
    return neutral if value is None else float(value)
