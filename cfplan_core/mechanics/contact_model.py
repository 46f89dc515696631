"""The protocol between planner and mechanics.

A contact model sees only gap gradients: an array of shape (s, k, 3 + n) for k contacts in s
configurations, whose first three columns are the wrench directions wᵀ and whose others are jᵀ
(see `cfplan_core.contact.gaps`). Lengths are in units of the object's size, forces of its weight.
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple, Protocol

from cfplan_core.geometry.polygon import FloatArray


class Stability(str, Enum):
    """How a grasp holds its object."""

    UNSTABLE = 'unstable'
    FORCE_CLOSURE = 'force_closure'
    FORM_CLOSURE = 'form_closure'


class Margins(NamedTuple):
    """Continuous functions, each of shape (s,), that are positive where a property holds.

    Attributes:
        stable: First-order stability (force or form closure).
        form_closure: Form closure.
    """

    stable: FloatArray
    form_closure: FloatArray


class Motion(NamedTuple):
    """The object's reaction to a joint velocity.

    Attributes:
        object_velocity: Shape (3,), rate of (x, y, φ) of the centre of mass.
        gap_rates: Shape (k,), zero for contacts that are kept, positive for those that break.
        unique: False if other object velocities are as good.
    """

    object_velocity: FloatArray
    gap_rates: FloatArray
    unique: bool


class ContactModel(Protocol):
    """What the planner needs to know of mechanics."""

    @property
    def reversible(self) -> bool:
        """True if a path may be followed in both directions."""

    def margins(self, gradients: FloatArray) -> Margins:
        """Judge the stability of contact formations; `gradients` of shape (s, k, 3 + n)."""

    def torque_limits(self, gradients: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Lower and upper actuator torques that keep all contacts, each of shape (s, n).

        Infinite where unbounded, NaN where no equilibrium exists. The links' weight is not
        included.
        """

    def motion(self, gradients: FloatArray, joint_velocity: FloatArray) -> Motion:
        """Predict the object's velocity; `gradients` of shape (k, 3 + n), velocity (n,).

        Raises:
            JammedError: No object velocity keeps every gap non-negative.
        """
