"""Options of ``cfplan plan`` that say how the path becomes a trajectory."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from cfplan_core.command_line.plan_options import Command, weights

if TYPE_CHECKING:
    from cfplan_core.options import TrajectoryOptions

TRAJECTORY = ('squeeze', 'inertia', 'event_speed', 'event_distance')
"""Options that say how the path becomes a trajectory."""


def timed_plan(command: Command) -> Command:
    """Add the options of `TRAJECTORY` to a command."""
    options = [
        click.option(
            '--squeeze',
            type=float,
            callback=weights,
            metavar='F',
            help='Nominal torques press with at most F weights where that is a choice; 5 unless '
            'given.',
        ),
        click.option(
            '--inertia',
            type=float,
            metavar='SHARE',
            help='Inertial forces are at most this share of the weight; 0.05 unless given.',
        ),
        click.option(
            '--event-speed',
            type=float,
            metavar='SHARE',
            help='Near contact events joints use at most this share of their velocity limits; '
            '0.25 unless given.',
        ),
        click.option(
            '--event-distance',
            type=float,
            metavar='RAD',
            help='How near that is along the path of the joints; 0.05 rad unless given.',
        ),
    ]
    for option in reversed(options):
        command = option(command)
    return command


def trajectory_options(wanted: dict[str, Any]) -> TrajectoryOptions:
    """Take the options of `TRAJECTORY` out of all that were given.

    Raises:
        CfplanError: A value is not possible.
    """
    from cfplan_core.options import TrajectoryOptions

    given = {name: wanted.pop(name) for name in TRAJECTORY}
    return TrajectoryOptions(**{name: value for name, value in given.items() if value is not None})
