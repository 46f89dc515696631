"""The checks of a verification, each with its limit: the one place where tolerances are set.

Frames inside a segment are held to strict limits. A segment's first and last frame are where a
contact is made or lost and a force or a class is at its limit, so there the segment's own contacts
may balance just barely (``*_at_ends``); that such a frame holds at all is a check of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

TOUCH = 1e-6
"""Distance in m below which a vertex and an edge touch."""

APART = 1e-8
"""Distance in m that an unnamed contact keeps next to the frame where it is made or lost."""

STRICT = 1e-9
"""Smallest contact force, in weights of the object, that counts as positive."""

BARELY = 1e-6
"""Contact force, in weights of the object, that rounding may hide at the end of a segment."""

HAIR = 1e-4
"""Form-closure margin up to which a grasp may also be called one of force closure."""

RANK = 1e-7
"""Singular value below which motions that keep contacts count as dependent."""

UNBOUNDED = 1e6
"""Torque, in weights times sizes of the object, above which a limit is as good as none."""


@dataclass(frozen=True)
class Rule:
    """How a check judges a value.

    Attributes:
        description: What is checked, for a table.
        limit: Largest good value, or smallest if `at_least`.
        unit: Of the value; empty for a plain number.
        at_least: True if the limit is a smallest value.
    """

    description: str
    limit: float = 0.0
    unit: str = ''
    at_least: bool = False

    def holds(self, value: float) -> bool:
        """True if the value is within the limit; nan never is."""
        return value >= self.limit if self.at_least else value <= self.limit

    def is_worse(self, value: float, than: float) -> bool:
        """True if a value is nearer to the limit, or farther beyond it, than another."""
        return value != value or (value < than if self.at_least else value > than)


CHECKS = {
    'solved': Rule('the plan is a solved one'),
    'names': Rule('problem, joints and contacts have the names of the problem'),
    'arrays': Rule('arrays have one row per frame, one column per joint, and finite numbers'),
    'time': Rule('time strictly increases'),
    'segments': Rule('segments cover all frames, neighbours share one'),
    'start': Rule('the plan begins at the start: offset / what rounding allows', 1.0),
    'goal_position': Rule('the object ends at the goal position: offset / tolerance', 1.0),
    'goal_angle': Rule(
        'the object ends at the goal angle, turns counted: offset / tolerance', 1.0
    ),
    'goal_joints': Rule('the joints end at the goal: offset / tolerance', 1.0),
    'goal_contacts': Rule('the contacts that the goal names touch', TOUCH, 'm'),
    'joint_limits': Rule('joints stay within their limits: excess', 1e-9, 'rad'),
    'joint_velocity': Rule('joint speeds / velocity limit', 1.0 + 1e-9),
    'joint_acceleration': Rule('joint accelerations / acceleration limit', 1.0 + 1e-6),
    'inertia': Rule(
        'inertial forces and moments / their share of weight, weight × size', 1.0 + 1e-6
    ),
    'joint_step': Rule('joint motion between frames', 0.05 + 1e-9, 'rad'),
    'object_step': Rule('object motion between frames / object size', 0.05 + 1e-9),
    'object_turn': Rule('object rotation between frames', 0.05 + 1e-9, 'rad'),
    'contact_gap': Rule('named contacts touch: vertex to edge', TOUCH, 'm'),
    'contact_side': Rule('named contacts touch from outside: depth', 2.0 * TOUCH, 'm'),
    'unnamed_contact': Rule('nothing else touches inside a segment'),
    'coincidence': Rule('contacts with one body are apart inside a segment', TOUCH, 'm', True),
    'penetration': Rule('the object does not penetrate the hand', TOUCH, 'm'),
    'link_overlap': Rule('links do not overlap', TOUCH, 'm'),
    'rank': Rule('wrenches span wrench space: smallest singular value', 1e-6, '', True),
    'stability': Rule(
        'every contact can press: least force inside segments, in weights', STRICT, '', True
    ),
    'stability_at_ends': Rule(
        'least force at the ends of segments, in weights', -BARELY, '', True
    ),
    'stability_class': Rule('the stability class is the one claimed'),
    'torque_limits': Rule('torque limits inside segments: relative error', 1e-6),
    'torque_limits_at_ends': Rule('torque limits at the ends of segments: relative error', 1e-5),
    'nominal_limits': Rule(
        'nominal torques are inside the torque limits: excess / (weight × size)', 1e-9
    ),
    'nominal_balance': Rule(
        'nominal torques balance the object: distance from equilibria / (weight × size)', 1e-5
    ),
    'nominal_effort': Rule('nominal torques / effort limit', 1.0 + 1e-9),
    'control': Rule(
        'held joints can be off a little without a contact lost, the others cannot move alone'
    ),
    'effort': Rule('the joints are strong enough: effort needed / effort limit', 1.0 + 1e-9),
    'between_gap': Rule('gaps half-way between frames / (lever × turn²)', 0.25),
    'between_motion': Rule('distance from half-way to the contacts / step', 0.25),
    'between_penetration': Rule('penetration half-way between frames / object size', 1e-3),
}
"""Every check by name, in the order in which they are reported."""
