"""The records of a study as a Parquet file, for data frames."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from cfplan_core.errors import CfplanError
from cfplan_core.study.parameters import PARAMETERS
from cfplan_core.study.record import MEASURES, Record


def import_pyarrow() -> ModuleType:
    """Import the library of Parquet files.

    Raises:
        CfplanError: It is not installed.
    """
    try:
        import pyarrow.parquet
    except ImportError as error:
        raise CfplanError(
            f'Parquet files need pyarrow: {error}; install it with '
            "pip install 'cfplan_ros[study]', or pip install pyarrow"
        ) from error
    module: ModuleType = pyarrow
    return module


def write_parquet(records: Sequence[Record], path: Path) -> None:
    """Write records, with the columns of the log and a type for each.

    Args:
        records: In any order; they are written in that of their parameters.
        path: Of the file; what was there is replaced once the new file is whole.

    Raises:
        CfplanError: pyarrow is not installed.
        OSError: The file cannot be written.
    """
    arrow = import_pyarrow()
    rows = sorted(records, key=lambda record: record.order)
    columns: dict[str, tuple[Any, list[Any]]] = {
        'key': (arrow.string(), [r.key for r in rows]),
        'problem': (arrow.string(), [r.problem for r in rows]),
    }
    for name, parameter in PARAMETERS.items():
        number = arrow.int64() if parameter.number is int else arrow.float64()
        kind = arrow.string() if parameter.choices else number
        columns[name] = (kind, [r.value(name) for r in rows])
    columns['seed'] = (arrow.int64(), [r.seed for r in rows])
    columns['sample'] = (arrow.int64(), [r.sample for r in rows])
    columns['verdict'] = (arrow.string(), [r.verdict.value for r in rows])
    for k, name in enumerate(MEASURES):
        columns[name] = (arrow.float64(), [r.measures[k] for r in rows])
    columns['lost'] = (arrow.string(), [r.lost for r in rows])
    columns['reason'] = (arrow.string(), [r.reason for r in rows])
    table = arrow.table({n: arrow.array(v, type=kind) for n, (kind, v) in columns.items()})
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f'.{path.name}.{os.getpid()}.tmp')
    try:
        arrow.parquet.write_table(table, temporary)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
