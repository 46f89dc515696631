"""Collects what the benchmarks measure and prints it as one table."""

from __future__ import annotations

import os
import platform
import statistics
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from rich.table import Table


@dataclass(frozen=True)
class Row:
    """One measurement: times in s, peak resident memory in bytes."""

    name: str
    seconds: float
    memory: int
    status: str = ''
    segments: str = ''


ROWS = pytest.StashKey[list[Row]]()


@pytest.fixture(scope='session')
def record(pytestconfig: pytest.Config) -> Callable[..., None]:
    rows = pytestconfig.stash.setdefault(ROWS, [])
    return lambda **values: rows.append(Row(**values))


def pytest_terminal_summary(config: pytest.Config) -> None:
    rows = config.stash.get(ROWS, [])
    if not rows:
        return
    table = Table(caption=_machine(), caption_justify='left')
    table.add_column('problem', no_wrap=True)
    table.add_column('status')
    for heading in ('segments', 'median, ms', 'memory, MB'):
        table.add_column(heading, justify='right')
    planned = [row for row in rows if row.status]
    for row in planned:
        _add(table, row)
    if planned:
        table.add_section()
        seconds = [row.seconds for row in planned]
        memory = [row.memory for row in planned]
        for name, of in (('median', statistics.median), ('largest', max)):
            _add(table, Row(name, of(seconds), int(of(memory))))
        table.add_section()
    for row in rows:
        if not row.status:
            _add(table, row)
    console = Console(highlight=False)
    console.print()
    console.print(table)


def _add(table: Table, row: Row) -> None:
    table.add_row(
        row.name, row.status, row.segments, f'{1e3 * row.seconds:.1f}', f'{row.memory / 1e6:.0f}'
    )


def _machine() -> str:
    return (
        f'{_processor()}, {os.cpu_count()} cores, one thread used; {platform.system()}, '
        f'Python {platform.python_version()}, NumPy {np.__version__}'
    )


def _processor() -> str:
    described = Path('/proc/cpuinfo')
    if described.exists():
        for line in described.read_text().splitlines():
            if line.startswith('model name'):
                return line.partition(':')[2].strip()
    return platform.processor() or platform.machine()
