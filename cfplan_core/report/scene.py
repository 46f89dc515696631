"""What there is to draw: where contacts are, which frames tell a plan, how far the view goes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cfplan_core.contact.elements import ElementalContact, parse_contact
from cfplan_core.errors import CfplanError
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.model import Grasp, Problem
from cfplan_core.trajectory.plan_result import PlanResult, Segment


def elements(contact: ElementalContact) -> tuple[str, str]:
    """Element of the object and element of the hand in words, as in the paper's Table 1."""
    vertex, edge = f'vertex {contact.vertex}', f'edge {contact.edge}'
    return (vertex, edge) if contact.object_vertex else (edge, vertex)


@dataclass(frozen=True, eq=False)
class ContactMark:
    """A contact in the world.

    Attributes:
        name: Of the elemental contact.
        point: Shape (2,), m.
        normal: Shape (2,), unit, from the hand into the object.
    """

    name: str
    point: FloatArray
    normal: FloatArray


def contact_marks(
    problem: Problem, grasp: Grasp, contacts: Iterable[str]
) -> tuple[ContactMark, ...]:
    """Place contacts in the world.

    Args:
        problem: Hand and object.
        grasp: Where they are.
        contacts: Names.

    Raises:
        CfplanError: A name is malformed, or names a body or an element that does not exist.
    """
    bodies = problem.hand.world_vertices(grasp.joints)
    object_vertices = problem.object.world_vertices(grasp.object_pose)
    marks = []
    for name in contacts:
        contact = parse_contact(name)
        hand_vertices = bodies.get(contact.body)
        if hand_vertices is None:
            raise CfplanError(
                f'contact {name}: body must be one of {", ".join(bodies)}, got {contact.body}'
            )
        on_object, on_hand = (contact.vertex, contact.edge)[:: 1 if contact.object_vertex else -1]
        for what, index, vertices in (
            ('object', on_object, object_vertices),
            (contact.body, on_hand, hand_vertices),
        ):
            if index >= len(vertices):
                raise CfplanError(
                    f'contact {name}: {what} has elements 0 to {len(vertices) - 1}, got {index}'
                )
        if contact.object_vertex:
            point = object_vertices[contact.vertex]
            normal = outward_normal(hand_vertices, contact.edge)
        else:
            point = hand_vertices[contact.vertex]
            normal = -outward_normal(object_vertices, contact.edge)
        marks.append(ContactMark(name, point, normal))
    return tuple(marks)


def outward_normal(vertices: FloatArray, edge: int) -> FloatArray:
    """Unit normal of an edge of a counter-clockwise polygon, shape (2,)."""
    x, y = vertices[(edge + 1) % len(vertices)] - vertices[edge]
    return np.asarray(np.array([y, -x]) / np.hypot(x, y))


def short_body_names(problem: Problem) -> dict[str, str]:
    """Bodies by the shortest name that is still unique: ``palm``, ``left``, ``left.tip``."""
    hand = problem.hand
    short = {
        f'palm.{k}': 'palm' if len(hand.palm) == 1 else f'palm.{k}' for k in range(len(hand.palm))
    }
    for finger in hand.fingers:
        for link in finger.links:
            name = f'{finger.name}.{link.name}'
            short[name] = finger.name if len(finger.links) == 1 else name
    return short


def check_belongs(problem: Problem, result: PlanResult) -> None:
    """Refuse a result that is of another problem.

    Raises:
        CfplanError: The names of the problem or of the joints differ.
    """
    if result.problem != problem.name:
        raise CfplanError(f'plan must be of problem {problem.name}, is of {result.problem}')
    if result.solved and result.joint_names != problem.hand.joint_names:
        raise CfplanError(
            f'plan must have the joints {", ".join(problem.hand.joint_names)} in this order, '
            f'has {", ".join(result.joint_names)}'
        )


def plan_grasps(result: PlanResult) -> tuple[Grasp, ...]:
    """Every frame of a plan as a grasp."""
    return tuple(
        Grasp(pose, joints)
        for pose, joints in zip(result.object_poses, result.joints, strict=True)
    )


def segment_at(segments: Sequence[Segment], frame: int) -> int:
    """Index of the segment that a frame is in; at a shared frame the later one."""
    return max(k for k, segment in enumerate(segments) if segment.first_frame <= frame)


def frame_contacts(segments: Sequence[Segment], frame: int) -> tuple[str, ...]:
    """Contacts that touch in a frame: at a shared frame those of both segments."""
    names: dict[str, None] = {}
    for segment in segments:
        if segment.first_frame <= frame <= segment.last_frame:
            names |= dict.fromkeys(segment.contacts)
    return tuple(names)


def story_frames(segments: Sequence[Segment], most: int = 16) -> tuple[int, ...]:
    """Choose frames that tell a plan: the ends of the segments, and some between.

    Args:
        segments: Of a plan, at least one.
        most: Largest number of frames; the ends are chosen even if there are more of them.

    Returns:
        Increasing frame numbers: about three to a segment, the widest gaps halved first.
    """
    chosen = sorted({s.first_frame for s in segments} | {s.last_frame for s in segments})
    while len(chosen) < min(most, 3 * len(segments) + 1):
        width, minus_first = max(((b - a, -a) for a, b in pairwise(chosen)), default=(0, 0))
        if width < 2:
            break
        chosen.append(width // 2 - minus_first)
        chosen.sort()
    return tuple(chosen)


@dataclass(frozen=True)
class View:
    """A rectangle of the world, m."""

    left: float
    right: float
    bottom: float
    top: float

    @property
    def width(self) -> float:
        """Horizontal extent, m."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """Vertical extent, m."""
        return self.top - self.bottom


def view_of(problem: Problem, grasps: Sequence[Grasp], margin: float = 0.06) -> View:
    """Fit a view to the hand's links and the object.

    Palm bodies count if they are not much larger than what the links and the object need; a long
    table is cut off instead.

    Args:
        problem: Hand and object.
        grasps: All that must be in view; at least one.
        margin: Free space around, as a part of the larger extent.
    """
    points = []
    for grasp in grasps:
        bodies = problem.hand.world_vertices(grasp.joints)
        points += [v for name, v in bodies.items() if not name.startswith('palm.')]
        points.append(problem.object.world_vertices(grasp.object_pose))
    low = np.min([p.min(axis=0) for p in points], axis=0)
    high = np.max([p.max(axis=0) for p in points], axis=0)
    reach = 0.25 * (high - low).max()
    for vertices in problem.hand.palm:
        palm_low, palm_high = vertices.min(axis=0), vertices.max(axis=0)
        if np.all(palm_low > low - reach) and np.all(palm_high < high + reach):
            low, high = np.minimum(low, palm_low), np.maximum(high, palm_high)
    pad = margin * (high - low).max()
    return View(low[0] - pad, high[0] + pad, low[1] - pad, high[1] + pad)


def scale_length(view: View) -> float:
    """Length of a scale bar: 1, 2 or 5 times a power of ten, at most a fifth of the width, m."""
    target = view.width / 5.0
    power = 10.0 ** np.floor(np.log10(target))
    return float(max(step * power for step in (1.0, 2.0, 5.0) if step * power <= target))
