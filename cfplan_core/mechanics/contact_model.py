"""The protocol between planner and mechanics.

A contact model sees only gap gradients: an array of shape (s, k, 3 + n) for k contacts in s
configurations, whose first three columns are the wrench directions wᵀ and whose others are jᵀ
(see `cfplan_core.contact.gaps`). Lengths are in units of the object's size, forces of its weight.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from typing import NamedTuple, Protocol

from cfplan_core.contact.disturbance import Disturbance
from cfplan_core.contact.system import BoolArray
from cfplan_core.geometry.polygon import FloatArray


class Stability(str, Enum):
    """How a grasp holds its object."""

    UNSTABLE = 'unstable'
    FORCE_CLOSURE = 'force_closure'
    FORM_CLOSURE = 'form_closure'
    SECOND_ORDER = 'second_order'


class Margins(NamedTuple):
    """Functions of the configuration: how far it is from losing or winning stability.

    The margins may be followed to the place where they change their sign, and form closure is
    never without stability.

    Attributes:
        stable: Shape (s,), positive where there is stability.
        form_closure: Shape (s,), positive where there is form closure.
        signs: Shape (s, m): along a path on which they stay the same so do both verdicts of
            first order.
        second_order: True if the stability is only of second order.
    """

    stable: FloatArray
    form_closure: FloatArray
    signs: BoolArray
    second_order: bool = False


class Motion(NamedTuple):
    """The object's reaction to a joint velocity.

    Attributes:
        object_velocity: Shape (3,), rate of (x, y, φ) of the centre of mass.
        gap_rates: Shape (k,), zero for contacts that are kept, positive for those that break.
        unique: False if other object velocities, however near, are as good.
    """

    object_velocity: FloatArray
    gap_rates: FloatArray
    unique: bool


class Holding(NamedTuple):
    """A stretch of motion inside one contact formation, to be held by actuators.

    Attributes:
        gradients: Shape (s, k, 3 + n).
        disturbance: What errors do to these.
        lower: Shape (s, n), smallest torques that are possible, without the links' weight.
        upper: Shape (s, n), largest ones.
    """

    gradients: FloatArray
    disturbance: Disturbance
    lower: FloatArray
    upper: FloatArray


class Actuation(NamedTuple):
    """A way in which actuators can hold the object along a stretch.

    Attributes:
        effort: Indices of the joints to be controlled in torque, in order; the others are held in
            position.
        torques: Shape (s, n), without the links' weight.
        margin: By which errors tell when a contact is lost, in units of the model: to compare
            ways to hold the same stretch.
    """

    effort: tuple[int, ...]
    torques: FloatArray
    margin: float


class ContactModel(Protocol):
    """What the planner needs to know of mechanics."""

    @property
    def reversible(self) -> bool:
        """True if a path may be followed in both directions."""

    @property
    def second_order(self) -> bool:
        """True if stability of second order counts."""

    def margins(self, gradients: FloatArray) -> Margins:
        """Judge first-order stability of contact formations; `gradients` (s, k, 3 + n)."""

    def second_order_margins(self, gradients: FloatArray, rates: FloatArray) -> Margins:
        """Judge the stability of two contacts, which is of second order at best.

        Args:
            gradients: Shape (s, 2, 3 + n).
            rates: Shape (s, 2, 3, 3 + n), of the wrench directions (`wrench_rates`).
        """

    def torque_limits(self, gradients: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Lower and upper actuator torques that keep all contacts, each of shape (s, n).

        Infinite where unbounded; NaN where no equilibrium exists or where three and more wrenches
        have a rank below 3, so that the contacts alone do not hold the object. The links' weight
        is not included.
        """

    def holds_within(
        self, gradients: FloatArray, lower: FloatArray, upper: FloatArray
    ) -> BoolArray:
        """Tell where torques between limits, each of shape (s, n), keep all contacts; shape (s,).

        Unlike `torque_limits` this asks for all joints at once.
        """

    def actuations(
        self, stretches: Sequence[Holding], squeeze: float
    ) -> tuple[tuple[Actuation, ...], ...]:
        """Say how actuators can hold stretches of motion, each inside one contact formation.

        With contact forces of at most `squeeze` weights where the contacts leave a choice. For
        each stretch at least one way, the best first.
        """

    def needed_forces(self, gradients: FloatArray) -> FloatArray:
        """Smallest F with an equilibrium in which no contact force exceeds F; shape (s,).

        In weights of the object; infinite where no equilibrium exists.
        """

    def motion(self, gradients: FloatArray, joint_velocity: FloatArray) -> Motion:
        """Predict the object's velocity; `gradients` of shape (k, 3 + n), velocity (n,).

        Meaningful where the contacts can balance the load: without an equilibrium the object
        falls ever faster, and what is returned is only one of the velocities possible.

        Raises:
            JammedError: No object velocity keeps every gap non-negative, or the wrenches have a
                rank below 3 and do not determine the motion.
        """
