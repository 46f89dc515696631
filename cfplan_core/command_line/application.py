"""The group of commands, and what every error that a user can cause turns into."""

from __future__ import annotations

import io
import os
import sys
from importlib.metadata import EntryPoint, entry_points
from typing import Any

import click

from cfplan_core import __version__
from cfplan_core.command_line import INTERRUPTED
from cfplan_core.command_line.animate import animate
from cfplan_core.command_line.check import check
from cfplan_core.command_line.console import INVALID_INPUT, complain, complaints, print_findings
from cfplan_core.command_line.explore import explore
from cfplan_core.command_line.map import map_command
from cfplan_core.command_line.plan import plan
from cfplan_core.command_line.study import study
from cfplan_core.command_line.verify import verify
from cfplan_core.errors import CfplanError, InvalidProblemError

READER_GONE = 141

# Other modules of the installation add commands by entry points of this group.
COMMANDS = 'cfplan.commands'


class Application(click.Group):
    """A group whose commands return their exit status and may raise what a user can cause.

    Beside its own commands it has those that entry points of the group `COMMANDS` name.
    """

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Name all commands: its own first, then those of other modules."""
        own = list(self.commands)
        return own + sorted(set(_further_commands()) - set(own))

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Look a command up by its name."""
        own = super().get_command(ctx, cmd_name)
        if own is not None:
            return own
        entry = _further_commands().get(cmd_name)
        if entry is None:
            return None
        command = entry.load()
        assert isinstance(command, click.Command)
        return command

    def invoke(self, ctx: click.Context) -> Any:
        """Run the chosen command and exit with its status."""
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors='replace')
        try:
            status = super().invoke(ctx)
            sys.stdout.flush()
        except InvalidProblemError as error:
            print_findings(error.findings, complaints())
            status = INVALID_INPUT
        except CfplanError as error:
            complain(str(error))
            status = INVALID_INPUT
        except KeyboardInterrupt:
            complain('interrupted')
            status = INTERRUPTED
        except BrokenPipeError:
            _discard_output()
            status = READER_GONE
        except OSError as error:
            _discard_output()
            complain(_reason(error))
            status = INVALID_INPUT
        ctx.exit(status)


def _further_commands() -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group=COMMANDS)}


def _reason(error: OSError) -> str:
    """Say what the system refused, and for which file."""
    reason = error.strerror or str(error)
    return f'{error.filename}: {reason}' if error.filename else reason


def _discard_output() -> None:
    """Point standard output nowhere if it takes no more, or Python would complain on its exit."""
    try:
        sys.stdout.flush()
    except OSError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)


@click.group('cfplan', cls=Application, context_settings={'help_option_names': ['-h', '--help']})
@click.version_option(__version__, prog_name='cfplan', message='%(prog)s %(version)s')
def application() -> None:
    """Plan how a hand moves an object from one grasp to another.

    A plan is a sequence of contact formations, each with the motion of the joints and the
    interval that each joint torque must stay in.
    """


for command in (check, plan, verify, animate, explore, map_command, study):
    application.add_command(command)
