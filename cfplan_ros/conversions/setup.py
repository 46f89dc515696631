"""What a planner brings to every request."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from cfplan_core.model import Hand
from cfplan_core.options import RESOLUTION
from cfplan_ros.conversions.hands import build_hand, hand_digest


@dataclass(frozen=True, eq=False)
class Setup:
    """What a planner brings to every request.

    Attributes:
        hand: As under ``hand`` in a problem file, or None if it has none.
        object: As under ``object`` in a problem file, or None; for requests without one.
        gravity: x and y, m/s²; for requests without it.
        frame_id: The hand's planar frame.
        default_time_budget: Seconds for a request that names none, or None for no limit.
        maximal_time_budget: Most seconds that any request gets, or None for no limit.
        default_preference: Which plan to choose for a request that does not say, see
            `PlanOptions.prefer`.
        default_resolution: Spacing of the grid of joint angles, rad, likewise.
        friction: Coulomb coefficient of every contact.
    """

    hand: Mapping[str, Any] | None
    object: Mapping[str, Any] | None = None
    gravity: tuple[float, float] = (0.0, -9.81)
    frame_id: str = 'palm'
    default_time_budget: float | None = None
    maximal_time_budget: float | None = None
    default_preference: str = 'first'
    default_resolution: float = RESOLUTION
    friction: float = 0.0

    @cached_property
    def built_hand(self) -> Hand | None:
        """The hand; building it raises `InvalidProblemError` if its mapping is wrong."""
        return None if self.hand is None else build_hand(self.hand)

    @cached_property
    def digest(self) -> str:
        """The hand's digest; empty without a hand."""
        return '' if self.built_hand is None else hand_digest(self.built_hand)
