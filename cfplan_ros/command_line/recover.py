"""``cfplan recover``: make a complete file of a recording that was cut short or damaged."""

from __future__ import annotations

from pathlib import Path

import click

from cfplan_core.command_line.console import answers
from cfplan_ros.command_line.runtime import needs_rclpy


@click.command(short_help='Complete a recording that was cut short or damaged.')
@click.argument('file', type=click.Path(path_type=Path))
@click.option(
    '-o',
    '--output',
    type=click.Path(dir_okay=False, path_type=Path),
    metavar='OUT',
    help='Write the complete file here and leave FILE as it is; missing directories are created.',
)
def recover(file: Path, output: Path | None) -> int:
    """Write a complete file, with an index, of all that is intact in FILE.

    FILE is a .part file of a planner that was killed, or any MCAP file that is cut short or
    damaged; how many messages were kept and how many lost is printed. A .part becomes the file
    that it would have become; of another file x.mcap the complete one is x_recovered.mcap. What
    viewers need (markers and the plan played in time) is computed from the recorded plan and
    added where it is missing. Without -o nothing is written of a file that is complete already.

    Exit status: 0 there is a complete file now, 2 nothing can be recovered, or FILE is in use.
    """
    with needs_rclpy():
        from cfplan_ros.planning_service import pictures
        from cfplan_ros.recording import recovery

    result = recovery.recover(file, output, pictures)
    answers().print(recovery.summary(file, result), soft_wrap=True)
    return 0
