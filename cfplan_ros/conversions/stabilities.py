"""Stability classes as the constants of messages."""

from __future__ import annotations

from cfplan_msgs.msg import PlanSegment

NUMBERS = {
    # A grasp that is passed through in an instant has no class.
    '': 0,
    'form_closure': int(PlanSegment.FORM_CLOSURE),
    'force_closure': int(PlanSegment.FORCE_CLOSURE),
    'second_order': int(PlanSegment.SECOND_ORDER),
}
"""Constant of ``cfplan_msgs/msg/PlanSegment`` by the planner's name."""

NAMES = {number: name for name, number in NUMBERS.items()}
"""The planner's name by the constant."""
