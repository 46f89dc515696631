"""``cfplan check``: what a problem file contains, or everything that is wrong with it."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

from cfplan_core.command_line.console import INVALID_INPUT, answers, new_table, print_findings
from cfplan_core.command_line.inputs import examine
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.model import Goal, Grasp, Problem


@click.command(short_help='Say what a problem file contains, or what is wrong with it.')
@click.argument('file', type=click.Path(path_type=Path))
def check(file: Path) -> int:
    """Say what the problem FILE contains: bodies, joints, start and goal contact formations.

    If anything is wrong, list all of it instead, each with file, field, value and what was
    expected.

    Exit status: 0 valid, 2 not.
    """
    examined = examine(file)
    console = answers()
    if examined.problem is None or examined.findings:
        print_findings(examined.findings, console)
        return INVALID_INPUT
    problem = examined.problem
    console.print(
        f'{problem.name}: gravity ({problem.gravity[0]:g}, {problem.gravity[1]:g}) m/s², '
        f'friction {problem.friction:g}',
        soft_wrap=True,
    )
    console.print(_bodies(problem), _joints(problem))
    _print_grasp('Start', problem, problem.start, console)
    goal = problem.goal.grasp(problem.hand)
    if goal is not None and not problem.goal.tolerance.wide:
        _print_grasp('Goal', problem, goal, console)
    else:
        _print_partial_goal(problem.goal, console)
    return 0


def _bodies(problem: Problem) -> Table:
    table = new_table('Bodies', 'Body', 'Vertices', 'Mass (kg)')
    obj = problem.object
    table.add_row('object', str(len(obj.vertices)), f'{obj.mass:g}')
    for name, vertices in zip(problem.hand.body_names, problem.hand.palm, strict=False):
        table.add_row(name, str(len(vertices)), 'fixed')
    for finger in problem.hand.fingers:
        for link in finger.links:
            mass = f'{link.mass:g}' if link.mass else 'massless'
            table.add_row(f'{finger.name}.{link.name}', str(len(link.vertices)), mass)
    return table


def _joints(problem: Problem) -> Table:
    table = new_table('Joints', 'Joint', 'Limits (rad)', 'Speed (rad/s)', 'Torque (N·m)')
    for joint in problem.hand.joints:
        table.add_row(
            joint.name,
            f'{joint.lower:.4g} to {joint.upper:.4g}',
            f'{joint.velocity_limit:g}',
            f'{joint.effort_limit:g}',
        )
    return table


def _print_grasp(title: str, problem: Problem, grasp: Grasp, console: Console) -> None:
    from cfplan_core.planning.grasp_check import describe_grasp

    described = describe_grasp(problem, grasp)
    angles = zip(problem.hand.joint_names, grasp.joints, strict=True)
    console.print(_formation(f'{title} contact formation', described.contacts))
    console.print(
        f'{described.stability.replace("_", " ")}, dimension {described.dimension} '
        '(independent motions that keep these contacts)\n'
        f'{_pose(grasp.object_pose)}\n{_angles(angles)}\n'
    )


def _print_partial_goal(goal: Goal, console: Console) -> None:
    """Print a goal that leaves something open: its formation is not known before planning."""
    console.print('The goal is given in part; the rest is free')
    tolerance = goal.tolerance
    if goal.contacts:
        title = 'Goal contact formation' if goal.exact_contacts else 'Goal contacts, or more'
        console.print(_formation(title, goal.contacts))
    if goal.object_position is not None:
        x, y = goal.object_position
        console.print(f'object at ({x:.4g}, {y:.4g}) m, within {tolerance.position:g} m')
    if goal.object_angle is not None:
        console.print(f'object at {goal.object_angle:.4g} rad, within {tolerance.angle:g} rad')
    if goal.joints:
        console.print(f'{_angles(goal.joints.items())}, within {tolerance.joints:g} rad')


def _pose(object_pose: FloatArray) -> str:
    x, y, angle = object_pose
    return f'object at ({x:.4g}, {y:.4g}) m, {angle:.4g} rad'


def _angles(joints: Iterable[tuple[str, float]]) -> str:
    return 'joints ' + ', '.join(f'{name} {angle:.4g} rad' for name, angle in joints)


def _formation(title: str, contacts: Iterable[str]) -> Table:
    """A contact formation in the form of Table 1 of Trinkle & Hunter (1991)."""
    table = new_table(title, 'Object element', 'Body', 'Hand element')
    for contact in contacts:
        table.add_row(*table_1_row(contact))
    return table


def table_1_row(contact: str) -> tuple[str, str, str]:
    """Split a contact's name into object element, link and hand element.

    Args:
        contact: As in files, e.g. ``object.v1|palm.0.e3``.

    Returns:
        As in Table 1 of the paper, e.g. ``('vertex 1', 'palm.0', 'edge 3')``.
    """
    on_object, on_hand = contact.split('|')
    link, _, element = on_hand.rpartition('.')
    return _element(on_object.rpartition('.')[2]), link, _element(element)


def _element(short: str) -> str:
    return f'{"vertex" if short[0] == "v" else "edge"} {short[1:]}'
