"""What is asked of a plan besides the problem, as message and back."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, fields
from enum import Enum
from typing import Any

from cfplan_msgs.msg import PlanOptions as OptionsMessage
from geometry_msgs.msg import Point

from cfplan_core.errors import CfplanError, Finding
from cfplan_core.options import PlanOptions, TrajectoryOptions
from cfplan_ros.conversions.contacts import contact_names, formation_message
from cfplan_ros.conversions.request_fields import REQUEST
from cfplan_ros.conversions.setup import Setup

MOST_ITEMS = 1000
"""Of formations, contacts of one, joints, or corners."""

OUT_OF_PLANE = 1e-9
"""m that the z of a corner may differ from zero."""

_LISTS = ('forbidden', 'required', 'held_joints', 'stay_within')


def constraint_values(message: OptionsMessage, setup: Setup) -> dict[str, Any]:
    """Read all but the limits of the search, as values of `PlanOptions` by field.

    Args:
        message: As it came.
        setup: Has what a message leaves to the planner.
    """
    return {
        'prefer': message.prefer or setup.default_preference,
        'alternatives': int(message.alternatives) or 1,
        'resolution': float(message.resolution) or setup.default_resolution,
        'max_needed_force': float(message.max_needed_force) or None,
        'max_contacts': int(message.max_contacts) or None,
        'forbidden': tuple(contact_names(formation) for formation in message.forbidden),
        'required': tuple(contact_names(formation) for formation in message.required),
        'held_joints': tuple(message.held_joints),
        'stay_within': tuple((float(p.x), float(p.y)) for p in message.stay_within) or None,
        'second_order': not message.no_second_order,
        'seed': int(message.seed),
    }


def trajectory_values(message: OptionsMessage) -> dict[str, Any]:
    """Read how the path is to become a trajectory, as values of `TrajectoryOptions` by field."""
    default = TrajectoryOptions()
    return {
        field.name: float(getattr(message, field.name)) or getattr(default, field.name)
        for field in fields(default)
    }


def option_findings(message: OptionsMessage, setup: Setup) -> Iterator[Finding]:
    """Find what is wrong with options by themselves, each with its field."""
    crowded = False
    for name in _LISTS:
        count = len(getattr(message, name))
        if count > MOST_ITEMS:
            crowded = True
            yield _finding(name, f'{count} of them', f'at most {MOST_ITEMS}')
    for name in ('forbidden', 'required'):
        for k, formation in enumerate(getattr(message, name)[:MOST_ITEMS]):
            count = len(formation.contacts)
            if count > MOST_ITEMS:
                crowded = True
                yield _finding(f'{name}[{k}]', f'{count} contacts', f'at most {MOST_ITEMS}')
    if crowded:
        return
    for k, point in enumerate(message.stay_within):
        if not abs(point.z) <= OUT_OF_PLANE:
            plane = '0: bodies move in the plane z = 0'
            yield _finding(f'stay_within[{k}].z', f'{float(point.z)!r}', plane)
    kinds: tuple[tuple[Callable[..., object], dict[str, Any]], ...] = (
        (PlanOptions, constraint_values(message, setup)),
        (TrajectoryOptions, trajectory_values(message)),
    )
    for kind, values in kinds:
        for name, value in values.items():
            try:
                kind(**{name: value})
            except CfplanError as error:
                got, _, expected = str(error).partition(', expected ')
                yield _finding(name, got.partition('got ')[2], expected)


def constraint_message(options: PlanOptions) -> OptionsMessage:
    """Return options as message, without the limits of the search and the tolerances."""
    trajectory = options.trajectory
    # In a message zero leaves the distance to the planner: the whole speed is as good as none.
    anywhere = trajectory.event_distance == 0.0
    return OptionsMessage(
        squeeze=float(trajectory.squeeze),
        inertia=float(trajectory.inertia),
        event_distance=float(trajectory.event_distance),
        event_speed=1.0 if anywhere else float(trajectory.event_speed),
        prefer=options.prefer.value,
        alternatives=options.alternatives,
        resolution=float(options.resolution),
        max_needed_force=float(options.max_needed_force or 0.0),
        max_contacts=options.max_contacts or 0,
        no_second_order=not options.second_order,
        seed=options.seed,
        forbidden=[formation_message(names) for names in options.forbidden],
        required=[formation_message(names) for names in options.required],
        held_joints=list(options.held_joints),
        stay_within=[Point(x=float(x), y=float(y), z=0.0) for x, y in options.stay_within or ()],
    )


def options_mapping(options: PlanOptions) -> dict[str, Any]:
    """Return options as plain data, by field."""
    values = {field.name: getattr(options, field.name) for field in fields(options)}
    values['trajectory'] = asdict(options.trajectory)
    return {
        name: value.value if isinstance(value, Enum) else value for name, value in values.items()
    }


def _finding(field: str, value: str, expected: str) -> Finding:
    return Finding(REQUEST, f'options.{field}', value, expected)
