"""Files that a command is to write, checked before it works for them."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from cfplan_core.errors import CfplanError

PICTURES = ('.png', '.pdf', '.svg')
"""Formats of figures."""


def check_outputs(outputs: Mapping[str, Path | None], inputs: Sequence[Path | None]) -> None:
    """Refuse files that would overwrite an input or each other, or that nobody can write.

    Missing directories are created.

    Args:
        outputs: Options and the files that they name; None where an option was not given.
        inputs: Files that are read.

    Raises:
        CfplanError: One of the outputs is such a file.
    """
    taken = {path.resolve(): 'a file that is read' for path in inputs if path is not None}
    for option, path in outputs.items():
        if path is None:
            continue
        place = path.resolve()
        if place in taken:
            raise CfplanError(f'{option}: got {path}, {taken[place]}; expected another file')
        taken[place] = f'the file of {option}'
        if path.is_dir():
            raise CfplanError(f'{option}: got the folder {path}, expected a file')
        try:
            place.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise CfplanError(f'{option}: cannot write {path}: {error}') from None
        if not os.access(path if path.exists() else place.parent, os.W_OK):
            raise CfplanError(f'{option}: cannot write {path}: permission denied')


def check_suffix(option: str, path: Path | None, suffixes: tuple[str, ...]) -> None:
    """Refuse a file whose name does not say a format that can be written.

    Args:
        option: Names the file.
        path: Of it; None where the option was not given.
        suffixes: In lower case, with their dots.

    Raises:
        CfplanError: The name ends otherwise.
    """
    if path is not None and path.suffix.lower() not in suffixes:
        raise CfplanError(f'{option}: got {path}, expected a name in {", ".join(suffixes)}')
