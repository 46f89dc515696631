"""``cfplan node``: start the planning node."""

from __future__ import annotations

from pathlib import Path

import click

from cfplan_ros.command_line.runtime import needs_rclpy


@click.command(
    short_help='Start the planning node.',
    context_settings={'ignore_unknown_options': True},
    epilog='Example: cfplan node problem.yaml --ros-args -p record_directory:=runs',
)
@click.argument('file', type=click.Path(path_type=Path), required=False)
@click.argument('ros_arguments', nargs=-1, type=click.UNPROCESSED, metavar='[--ros-args ...]')
def node(file: Path | None, ros_arguments: tuple[str, ...]) -> int:
    """Start the planning node and keep it running until Ctrl-C.

    FILE is a problem file: its hand, object and gravity become the node's, whatever other
    parameters say. All that follows --ros-args goes to the node as with ros2 run: remappings,
    parameters (a hand alone is given by -p hand_file:=FILE), --params-file.

    Exit status: 0 after Ctrl-C or SIGTERM, 2 invalid input or usage.
    """
    arguments = list(ros_arguments)
    if file is not None and str(file) == '--ros-args':
        file, arguments = None, ['--ros-args', *arguments]
    if arguments and arguments[0] != '--ros-args':
        raise click.UsageError(f'got {arguments[0]!r}, expected --ros-args after FILE')
    if file is not None:
        # Later values win.
        arguments = [*arguments, *(['--'] if arguments else []), *_scene_of(file)]

    with needs_rclpy():
        from cfplan_ros.planner_node import main
    return main(['cfplan', *arguments])


def _scene_of(file: Path) -> list[str]:
    """Arguments that give the node the hand, the object and the gravity of a problem file."""
    from cfplan_core.model.loading import load_problem

    gravity = ', '.join(repr(float(value)) for value in load_problem(file).gravity)
    values = {'hand_file': file, 'object_file': file, 'gravity': f'[{gravity}]'}
    settings = [word for name, value in values.items() for word in ('-p', f'{name}:={value}')]
    return ['--ros-args', *settings]
