"""Where the command line prints: answers on standard output, complaints on standard error."""

from __future__ import annotations

from collections.abc import Iterable

from rich import box
from rich.console import Console
from rich.table import Table

from cfplan_core.errors import Finding

INVALID_INPUT = 2


class _Console(Console):
    """Leaves a broken pipe to the caller, where rich would exit with the status of infeasible."""

    def on_broken_pipe(self) -> None:
        """Raise what rich has caught."""
        raise BrokenPipeError


def answers() -> Console:
    """Console for what was asked for; without colour unless it is a terminal."""
    return _Console(highlight=False, markup=False, emoji=False)


def complaints() -> Console:
    """Console for errors and progress."""
    return Console(stderr=True, highlight=False, markup=False, emoji=False)


def complain(message: str) -> None:
    """Print an error, unwrapped so that paths and values can be copied."""
    complaints().print(f'cfplan: {message}', soft_wrap=True)


def print_findings(findings: Iterable[Finding], console: Console) -> None:
    """Print findings one to a line, then their number."""
    lines = [str(finding) for finding in findings]
    for line in lines:
        console.print(line, soft_wrap=True)
    console.print(f'{len(lines)} finding{"s" if len(lines) != 1 else ""}', style='bold')


def new_table(title: str, *headings: str) -> Table:
    """Start a table in the style of the plan's tables."""
    return Table(
        *headings,
        title=title,
        title_justify='left',
        title_style='bold',
        box=box.SIMPLE_HEAD,
        pad_edge=False,
    )
