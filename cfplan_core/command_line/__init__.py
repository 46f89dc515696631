"""The command ``cfplan``: check a problem, plan, verify a plan, animate it.

Exit status of every command: 2 for invalid input or usage, 130 after Ctrl-C, 141 if the reader
of the output has gone; 0 and the other numbers are each command's own.
"""

from __future__ import annotations

import os
import sys

INTERRUPTED = 130


def main() -> None:
    """Run the command line of the process; the entry point of ``cfplan``."""
    try:
        from cfplan_core.command_line.application import application

        application(prog_name='cfplan')
    except KeyboardInterrupt:
        # While modules are still being imported there is nothing to cancel and nothing to flush.
        os.write(sys.stderr.fileno(), b'cfplan: interrupted\n')
        sys.exit(INTERRUPTED)
