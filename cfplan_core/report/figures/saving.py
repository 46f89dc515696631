"""Put pictures on disk whole: a file is either the old one or the new one."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any
from uuid import uuid4

import matplotlib
from matplotlib.figure import Figure

from cfplan_core.errors import CfplanError

FORMATS = ('png', 'pdf', 'svg')
# Text stays text (TrueType in PDF, <text> in SVG), and the same figure gives the same bytes.
_VECTOR_TEXT: dict[Any, Any] = {
    'pdf.fonttype': 42,
    'svg.fonttype': 'none',
    'svg.hashsalt': 'cfplan',
}
_WITHOUT_DATE: dict[str, dict[str, Any]] = {
    'png': {},
    'pdf': {'CreationDate': None},
    'svg': {'Date': None},
}


def save_figure(figure: Figure, path: Path) -> Path:
    """Write a figure in the format of the path's suffix, and return the path.

    Raises:
        CfplanError: The path cannot be written.
    """
    kind = path.suffix.removeprefix('.')
    with replacing(path) as temporary, matplotlib.rc_context(_VECTOR_TEXT):
        figure.savefig(temporary, format=kind, metadata=_WITHOUT_DATE[kind])
    return path


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary file beside a path, to be filled; it then takes the path's place.

    The folder is made if it does not exist. If the block fails the temporary file is removed and
    what was at the path stays.

    Args:
        path: Of the file; the temporary one has the same suffix.

    Raises:
        CfplanError: The folder or the file cannot be written.
    """
    temporary = path.with_name(f'.{path.stem}-{uuid4().hex}{path.suffix}')
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary.touch()
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        raise CfplanError(f'cannot write {path}: {error.strerror or error}') from None
    finally:
        with suppress(OSError):
            temporary.unlink()
