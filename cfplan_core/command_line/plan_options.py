"""Options of ``cfplan plan`` and ``cfplan call`` that say which plan is wanted."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeVar

import click

PREFERENCES = ('first', 'fewest-segments', 'shortest', 'robust')

Command = TypeVar('Command', bound=Callable[..., Any])


def weights(ctx: click.Context, param: click.Parameter, value: float | None) -> float | None:
    """Accept an option's number of weights of the object if contacts can press that hard."""
    if value is not None and not (math.isfinite(value) and value > 0.0):
        raise click.BadParameter(f'{value} is not a finite number of weights above zero.')
    return value


def formations(
    ctx: click.Context, param: click.Parameter, values: tuple[str, ...]
) -> tuple[tuple[str, ...], ...]:
    """Split contact formations into the names of their contacts."""
    split = tuple(tuple(name.strip() for name in value.split(',')) for value in values)
    for value, names in zip(values, split, strict=True):
        if not all(names):
            raise click.BadParameter(f'{value!r} is no list of contacts with commas between.')
    return split


def corners(
    ctx: click.Context, param: click.Parameter, value: str | None
) -> tuple[tuple[float, float], ...] | None:
    """Read corners ``x,y x,y x,y``."""
    if value is None:
        return None
    read = []
    for corner in value.split():
        try:
            x, y = (float(number) for number in corner.split(','))
        except ValueError:
            raise click.BadParameter(f'{corner!r} is no corner x,y in m.') from None
        read.append((x, y))
    return tuple(read)


def second_order_option(command: click.decorators.FC) -> click.decorators.FC:
    """Option for grasps that are stable to second order."""
    return click.option(
        '--second-order/--no-second-order',
        default=True,
        show_default=True,
        help='Whether two contacts may hold the object at a strict minimum of its energy.',
    )(command)


def resolution_option(command: click.decorators.FC) -> click.decorators.FC:
    """Option for the spacing of the grid of joint angles."""
    return click.option(
        '--resolution',
        type=click.FloatRange(0.001, 1.0),
        default=0.05,
        show_default=True,
        metavar='RAD',
        help='Spacing of the grid of joint angles that regions are explored over.',
    )(command)


def wanted_plan(command: Command) -> Command:
    """Add the options to a command."""
    options = [
        click.option(
            '--prefer',
            type=click.Choice(PREFERENCES),
            default='first',
            show_default=True,
            help='Which plan to choose; unless the first, the search goes on for better ones.',
        ),
        click.option(
            '--alternatives',
            type=click.IntRange(min=1),
            default=1,
            metavar='K',
            help='Find K plans with different sequences of contact formations, best first; those '
            'of fewest segments unless --prefer says otherwise.',
        ),
        click.option(
            '--max-needed-force',
            type=float,
            callback=weights,
            metavar='F',
            help='Nowhere may the contacts need more than F weights of the object to hold it.',
        ),
        click.option(
            '--max-contacts',
            type=click.IntRange(min=1),
            metavar='N',
            help='Pass through no configuration with more than N contacts, not for an instant.',
        ),
        click.option(
            '--forbid',
            'forbidden',
            multiple=True,
            callback=formations,
            metavar='NAME[,NAME...]',
            help='These contacts may nowhere touch all at once; may be given again.',
        ),
        click.option(
            '--require',
            'required',
            multiple=True,
            callback=formations,
            metavar='NAME[,NAME...]',
            help='Somewhere these contacts must touch all at once; may be given again.',
        ),
        click.option(
            '--hold',
            'held_joints',
            multiple=True,
            metavar='JOINT',
            help='Keep this joint still; may be given again.',
        ),
        click.option(
            '--stay-within',
            callback=corners,
            metavar="'X,Y X,Y X,Y...'",
            help='Keep the object inside this convex polygon: corners in m, counter-clockwise.',
        ),
        second_order_option,
        click.option(
            '--seed',
            type=click.IntRange(0, 2**32 - 1),
            default=0,
            metavar='N',
            help='Draw from another generator, for hands of more than two joints.',
        ),
    ]
    for option in reversed([*options, resolution_option]):
        command = option(command)
    return command
