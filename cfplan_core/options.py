"""What a caller asks of a plan, besides that it solves the problem."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from cfplan_core.geometry.polygon import is_flat, signed_area
from cfplan_core.option_checks import (
    is_above_zero,
    is_finite,
    is_names,
    is_number,
    is_pair,
    is_sequence_of,
    is_whole,
    require,
)

RESOLUTION = 0.05
"""Spacing of the grid of joint angles that regions are filled over unless asked otherwise, rad."""

MOST_JOINTS = 2
"""Hands of which so many joints move are explored completely, with more the search samples."""

ACCELERATION = 10.0
"""Acceleration limit of joints for which the problem states none, rad/s²."""

INERTIA = 0.05
"""Share of the weight that inertial forces may have unless asked otherwise."""

SQUEEZE = 5.0
"""Largest contact force of nominal torques unless asked otherwise, weights of the object."""


class Preference(str, Enum):
    """Which of several plans is the best; `docs/optimality.md` says how each is measured."""

    FIRST = 'first'
    FEWEST_SEGMENTS = 'fewest-segments'
    SHORTEST = 'shortest'
    ROBUST = 'robust'


@dataclass(frozen=True)
class TrajectoryOptions:
    """How a path becomes a trajectory.

    Attributes:
        squeeze: Largest contact force, in weights of the object, that the nominal torques press
            with where that is a choice: in form closure they could press ever harder. Where the
            contacts need more than two thirds of it, half as much again as they need.
        inertia: Largest inertial force of the object, and of each link with mass, as a share of
            its weight, and likewise the largest inertial moment as a share of weight times size.
        event_distance: How near to a contact event, along the joints' path, motion is slow, rad.
        event_speed: Share of the velocity limits that joints may use there.
    """

    squeeze: float = SQUEEZE
    inertia: float = INERTIA
    event_distance: float = 0.05
    event_speed: float = 0.25

    def __post_init__(self) -> None:
        require(is_above_zero(self.inertia), 'inertia', self.inertia, 'a share above zero')
        distance, speed = self.event_distance, self.event_speed
        slow = is_finite(distance) and distance >= 0.0
        require(slow, 'event_distance', distance, 'rad, not negative')
        share = is_number(speed) and 0.0 < speed <= 1.0
        require(share, 'event_speed', speed, 'above 0, at most 1')
        require(is_above_zero(self.squeeze), 'squeeze', self.squeeze, 'weights above zero')


@dataclass(frozen=True)
class PlanOptions:
    """Limits of a search, and of the plans that it may find.

    Attributes:
        time_budget: Seconds, or None for no limit.
        max_nodes: Nodes of both trees together, or None for no limit.
        resolution: Spacing of the grid of joint angles, rad, over which contact formations of
            dimension 2 are explored; for hands of two joints. For alternatives, and first of all
            with constraints, they are explored along rays instead.
        max_needed_force: Largest force, in weights of the object, that the contacts may need to
            hold it in any frame of the plan, or None for no limit.
        max_contacts: Largest number of contacts in any configuration that is passed through, also
            in an instant, or None for no limit. A vertex on a vertex counts as two.
        forbidden: Contact formations, as names of contacts: nowhere may all contacts of one of
            them touch at once.
        required: Contact formations: for each, the plan passes through one that contains it.
        held_joints: Names of joints that do not move.
        stay_within: Corners (x, y) of a convex polygon, m, that the object stays inside.
        second_order: Whether two contacts may hold the object where they do so to second order: at
            a strict minimum of its energy.
        prefer: Which plan to choose; unless it is the first one found, the search goes on until no
            better one can exist or a budget is exhausted.
        alternatives: Number of plans wanted, with different sequences of contact formations.
        trajectory: How the path becomes a trajectory.
        seed: Of the generator that searches of hands with more than two joints draw from; the
            same seed gives the same plan.
    """

    time_budget: float | None = None
    max_nodes: int | None = None
    resolution: float = RESOLUTION
    max_needed_force: float | None = None
    max_contacts: int | None = None
    forbidden: tuple[tuple[str, ...], ...] = ()
    required: tuple[tuple[str, ...], ...] = ()
    held_joints: tuple[str, ...] = ()
    stay_within: tuple[tuple[float, float], ...] | None = None
    second_order: bool = True
    prefer: Preference = Preference.FIRST
    alternatives: int = 1
    trajectory: TrajectoryOptions = TrajectoryOptions()
    seed: int = 0

    @property
    def optimal(self) -> bool:
        """True if the first plan found is not enough."""
        chosen = self.prefer is not Preference.FIRST
        return chosen or self.alternatives > 1 or bool(self.required)

    def __post_init__(self) -> None:
        budget, force = self.time_budget, self.max_needed_force
        seconds = budget is None or (is_number(budget) and budget > 0.0)
        require(seconds, 'time_budget', budget, 'seconds above zero')
        weights = force is None or is_above_zero(force)
        require(weights, 'max_needed_force', force, 'weights above zero')
        for field in ('max_nodes', 'max_contacts', 'alternatives'):
            value = getattr(self, field)
            absent = value is None and field != 'alternatives'
            number = absent or (is_whole(value) and value > 0)
            require(number, field, value, 'a whole number above zero')
        fine = is_number(self.resolution) and 1e-3 <= self.resolution <= 1.0
        require(fine, 'resolution', self.resolution, '0.001 to 1 rad')
        seed = is_whole(self.seed) and 0 <= self.seed < 2**32
        require(seed, 'seed', self.seed, 'a whole number from 0 to 2³² − 1')
        for field in ('forbidden', 'required'):
            value = getattr(self, field)
            require(
                is_sequence_of(lambda names: bool(names) and is_names(names), value),
                field,
                value,
                'contact formations, each a sequence of at least one name of a contact',
            )
        held = self.held_joints
        require(is_names(held), 'held_joints', held, 'a sequence of names of joints')
        second_order = isinstance(self.second_order, bool)
        require(second_order, 'second_order', self.second_order, 'True or False')
        timing = isinstance(self.trajectory, TrajectoryOptions)
        require(timing, 'trajectory', self.trajectory, 'TrajectoryOptions')
        choices = [choice.value for choice in Preference]
        known = isinstance(self.prefer, str) and self.prefer in choices
        require(known, 'prefer', self.prefer, f'one of {", ".join(choices)}')
        object.__setattr__(self, 'prefer', Preference(self.prefer))
        if self.stay_within is not None:
            _refuse_no_region(self.stay_within)


def _refuse_no_region(corners: tuple[tuple[float, float], ...]) -> None:
    """Refuse what is not a convex polygon, counter-clockwise."""
    expected = 'at least three corners (x, y) of a convex polygon, counter-clockwise'
    pairs = is_sequence_of(is_pair, corners) and len(corners) >= 3
    require(pairs, 'stay_within', corners, expected)
    polygon = np.array(corners, dtype=float)
    area = not is_flat(polygon) and signed_area(polygon) > 0.0
    require(area, 'stay_within', corners, expected)
    edges = np.roll(polygon, -1, axis=0) - polygon
    after = np.roll(edges, -1, axis=0)
    turns = edges[:, 0] * after[:, 1] - edges[:, 1] * after[:, 0]
    # A star's turns are all to the left as well, but they add up to more than one.
    angles = np.arctan2(turns, (edges * after).sum(axis=1))
    convex = bool((turns >= 0.0).all()) and angles.sum() <= 2.0 * np.pi + 1e-6
    require(convex, 'stay_within', corners, expected)
