"""Hand, object, contacts and contact forces as markers.

The bodies' markers are in the bodies' own frames and locked to them, so that ``/tf`` moves them;
contacts, forces and the goal are in the world frame. Every number and namespace is the same in
each message, so that a viewer replaces what it shows.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from cfplan_msgs.msg import ManipulationPlan
from std_msgs.msg import Header
from visualization_msgs.msg import Marker, MarkerArray

from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.model import Grasp, Hand, Problem
from cfplan_core.report.scene import view_of
from cfplan_core.report.style import INK, PAPER, body_colours, stability_style
from cfplan_ros.visualization.frames import OBJECT_FRAME, link_frame
from cfplan_ros.visualization.motion import Contacts, Motion, read_motion
from cfplan_ros.visualization.shapes import (
    Sizes,
    arrow,
    colour,
    dots,
    outline,
    plate,
    removal,
    sheet,
    text,
)

_GHOST = 0.3
_FAINT = 0.45
# Forces below this part of the largest have no arrow: it would be shorter than the contact's dot.
_SHORTEST_ARROW = 0.02


def scene_markers(problem: Problem, plan: ManipulationPlan) -> MarkerArray:
    """Show a plan as a whole: the bodies, the goal, and the contacts of start and goal.

    Args:
        problem: Hand and object.
        plan: Gives also stamp and world frame; without points only the bodies are shown.

    Raises:
        CfplanError: The plan is of another hand or object.
    """
    motion, header = read_motion(problem, plan), plan.header
    markers = [Marker(header=header, action=Marker.DELETEALL)]
    markers += _body_markers(problem, header)
    if len(motion):
        markers += _goal_markers(problem, motion.grasp(len(motion) - 1), header)
        painter = ContactPainter(problem, motion)
        markers += painter.paint(motion.contacts_at(0), header, 'start_')
        markers += painter.paint(motion.contacts_at(len(motion) - 1), header, 'goal_', True)
    return MarkerArray(markers=markers)


def _bodies(hand: Hand, world_frame: str) -> list[tuple[str, str, FloatArray]]:
    """Name, frame id and vertices in that frame, shape (v, 2), m, of each body of the hand."""
    palm = [(f'palm.{k}', world_frame, vertices) for k, vertices in enumerate(hand.palm)]
    links = [
        (f'{f.name}.{link.name}', link_frame(f.name, link.name), link.vertices)
        for f in hand.fingers
        for link in f.links
    ]
    return palm + links


def _body_markers(problem: Problem, world: Header) -> list[Marker]:
    sizes = Sizes(problem.object.size)
    colours = body_colours(problem.hand)
    shapes = [('hand', *body) for body in _bodies(problem.hand, world.frame_id)]
    shapes.append(('object', 'object', OBJECT_FRAME, problem.object.vertices))
    markers = []
    numbers = dict.fromkeys(('hand', 'object'), 0)
    for ns, name, frame, vertices in shapes:
        header = Header(stamp=world.stamp, frame_id=frame)
        number = numbers[ns]
        numbers[ns] += 1
        markers.append(plate(header, ns, number, vertices, colour(colours[name]), sizes))
        line = colour(INK)
        markers.append(outline(header, f'{ns}_outline', number, vertices, line, sizes.rim, sizes))
    return markers


def _goal_markers(problem: Problem, goal: Grasp, header: Header) -> list[Marker]:
    """Object and links of the last grasp, seen through, under the bodies."""
    sizes = Sizes(problem.object.size)
    colours = body_colours(problem.hand)
    placed = {'object': problem.object.world_vertices(goal.object_pose)}
    placed |= {
        name: vertices
        for name, vertices in problem.hand.world_vertices(goal.joints).items()
        if not name.startswith('palm.')
    }
    markers = []
    for number, (name, vertices) in enumerate(placed.items()):
        ghost, line = colour(colours[name], _GHOST), colour(INK, _FAINT)
        markers.append(sheet(header, 'goal', number, vertices, ghost, sizes.behind))
        markers.append(
            outline(header, 'goal_outline', number, vertices, line, sizes.behind_rim, sizes)
        )
    return markers


class ContactPainter:
    """Draws the contacts of a plan, each always with the same number, all to one scale.

    The arrow of the plan's largest force, or of the object's weight if that is larger, is as long
    as the object.

    Args:
        problem: Hand and object.
        motion: The plan.
    """

    def __init__(self, problem: Problem, motion: Motion) -> None:
        names = sorted({name for segment in motion.segments for name in segment.contacts})
        self.numbers = {name: number for number, name in enumerate(names)}
        self._sizes = Sizes(problem.object.size)
        weight = problem.object.mass * float(np.hypot(*problem.gravity))
        self._unit_force = max(motion.largest_force, weight) or 1.0
        self._segments = motion.segments
        ends = [motion.grasp(k) for k in ((0, len(motion) - 1) if len(motion) else ())]
        if ends:
            view = view_of(problem, ends)
            self._caption_place = np.array([0.5 * (view.left + view.right), view.top])

    def paint(
        self, contacts: Contacts, header: Header, prefix: str = '', under: bool = False
    ) -> list[Marker]:
        """Draw contacts as dots and the forces on the object as arrows.

        Args:
            contacts: Of the plan that this painter is for.
            header: In the world frame.
            prefix: Of the namespaces ``contacts`` and ``forces``; with one they are faint.
            under: True to draw under the bodies instead of over them.
        """
        if not contacts.names:
            return []
        sizes, opacity = self._sizes, _FAINT if prefix else 1.0
        paper, ink = colour(PAPER, opacity), colour(INK, opacity)
        low, high = (sizes.behind_rim,) * 2 if under else (sizes.top, sizes.above)
        markers = [dots(header, f'{prefix}contacts', contacts.points, paper, low, sizes)]
        lengths = contacts.forces / self._unit_force
        ends = contacts.points + contacts.normals * (sizes.unit * lengths)[:, None]
        for k, name in enumerate(contacts.names):
            if lengths[k] > _SHORTEST_ARROW:
                number, start = self.numbers[name], contacts.points[k]
                markers.append(
                    arrow(header, f'{prefix}forces', number, start, ends[k], ink, high, sizes)
                )
        return markers

    def caption(
        self,
        contacts: Contacts,
        segment: int,
        limits: Mapping[str, tuple[float, float]],
        header: Header,
    ) -> Marker:
        """Say which segment of the plan is shown, its stability and forces, and torque limits.

        Args:
            contacts: At the instant that is shown.
            segment: Number of the segment, from zero.
            limits: Smallest and largest torque of each joint, N·m.
            header: In the world frame.
        """
        style = stability_style(self._segments[segment].stability)
        words = f'{segment + 1} of {len(self._segments)}: {style.label}'
        if np.isfinite(contacts.forces).all() and len(contacts.forces):
            words += f', forces up to {contacts.forces.max():.3g} N'
        for joint, (lower, upper) in limits.items():
            words += f'\n{joint} {_torque(lower)} to {_torque(upper)} N·m'
        return text(header, 'segment', self._caption_place, words, colour(INK), self._sizes)

    def removals(self, kept: list[Marker], header: Header) -> list[Marker]:
        """Take away every arrow of the plan, and the dots, that are not among some markers."""
        present = {(marker.ns, marker.id) for marker in kept}
        all_arrows = [('forces', number) for number in self.numbers.values()]
        return [
            removal(header, ns, number)
            for ns, number in [('contacts', 0), *all_arrows]
            if (ns, number) not in present
        ]


def _torque(value: float) -> str:
    return f'{value:.3g}' if np.isfinite(value) else 'unbounded'
