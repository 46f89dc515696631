"""Makes complete files of those whose writer died."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

from cfplan_core.errors import CfplanError
from cfplan_ros.recording.intact import NotMcapError
from cfplan_ros.recording.rewriting import Contents, Preview, missing_preview, rewrite
from cfplan_ros.recording.run_file import PART, failure_reason, lock, same_file, sync_directory
from cfplan_ros.recording.wording import counted

_UNREADABLE = '.unreadable'


class InUseError(CfplanError):
    """A recording is still being written."""


@dataclass(frozen=True)
class Recovery:
    """What came of a recovery.

    Attributes:
        path: The complete file; None if there was nothing to do.
        complete: True if the file was complete already.
        kept: Messages that can be read in the file.
        lost: Messages that the file says it held, and that cannot be read.
        added: Messages of the preview that were added.
        dropped: Length of what is torn off at the end, bytes.
        problems: What else went wrong, e.g. why there is no preview.
    """

    path: Path | None
    complete: bool
    kept: int
    lost: int = 0
    added: int = 0
    dropped: int = 0
    problems: tuple[str, ...] = ()


def recover(path: Path, output: Path | None = None, preview: Preview | None = None) -> Recovery:
    """Write a complete file with all that is intact of one that is cut short or damaged.

    Args:
        path: A ``.part`` file, or any MCAP file.
        output: Where the complete file goes, and `path` stays; missing directories are created.
            A file that is complete already is copied there. None for where the writer would
            have put it: a ``.part`` becomes that file (a copy of it, ending in ``.unreadable``,
            stays if more than its end is damaged), and of another file ``x.mcap`` the complete
            one is ``x_recovered.mcap``; nothing is written if that file is complete already.
        preview: Gives what viewers are shown; of a file with a plan, what it lacks is added.

    Raises:
        InUseError: The file's writer is alive.
        NotMcapError: The file is no MCAP file, or holds no message.
        CfplanError: The output is there already.
        OSError: A file cannot be read, or the complete one, which the error names, cannot be
            written; neither of the two has changed then.
    """
    with path.open('rb') as file:
        # Where the file system has no locks, whoever asks has to know.
        if lock(file.fileno()) is False or not same_file(path, file.fileno()):
            raise InUseError(f'{path}: a planner is still writing this file')
        return _recover(file, path, output, preview)


def recover_left_over(
    directory: Path, preview: Preview | None, log: Callable[[str], object]
) -> list[Path]:
    """Complete every run in a directory whose writer died.

    A file that holds no message is set aside: its name ends in ``.unreadable`` from then on.

    Args:
        directory: May be missing.
        preview: As for `recover`.
        log: Takes a line on every file that was not in use.

    Returns:
        The complete files.
    """
    completed: list[Path] = []
    for path in sorted(directory.glob(f'run_*.mcap{PART}')):
        try:
            with path.open('rb') as file:
                locked = lock(file.fileno())
                if locked is None:
                    log(f'{path}: left alone, as no lock tells here whether it is in use')
                elif locked and same_file(path, file.fileno()):
                    recovery = _recover(file, path, None, preview)
                    log(summary(path, recovery))
                    completed.extend([recovery.path] if recovery.path else [])
        except NotMcapError as error:
            log(f'{error}; {_set_aside(path)}')
        except CfplanError as error:
            log(str(error))
        except OSError as error:
            log(f'not recovered: {failure_reason(error, path)}')
        # One file, whatever it holds, must not cost the others.
        except Exception as error:
            log(f'{path}: not recovered: {type(error).__name__}: {error}')
    return completed


def summary(path: Path, recovery: Recovery) -> str:
    """Say in a line what came of a recovery."""
    if recovery.complete and not recovery.added:
        outcome = f'complete file: {recovery.path}' if recovery.path else 'nothing to recover'
        return f'{path}: is complete, with {counted(recovery.kept)}; {outcome}'
    kept = counted(recovery.kept)
    if recovery.lost:
        kept = f'{recovery.kept} of {counted(recovery.kept + recovery.lost)}'
    parts = [f'{path}: kept {kept}']
    if recovery.lost:
        parts.append(f'lost {recovery.lost}')
    if recovery.added:
        parts.append(f'added {counted(recovery.added)} of the preview')
    if recovery.dropped:
        parts.append(f'dropped the last {recovery.dropped} bytes, which are torn')
    return '; '.join([', '.join(parts), *recovery.problems, f'complete file: {recovery.path}'])


def _recover(file: BinaryIO, path: Path, output: Path | None, preview: Preview | None) -> Recovery:
    contents = Contents(file, path)
    extent = contents.extent
    if extent.kept == 0:
        raise NotMcapError(f'{path}: holds no complete message')
    in_place = output is None and path.name.endswith(PART)
    if extent.complete and output is None and not in_place:
        return Recovery(None, True, extent.kept)
    target = output or _target(path)
    if target.exists():
        raise CfplanError(f'{target}: is there already, expected the name of a new file')
    target.parent.mkdir(parents=True, exist_ok=True)
    if extent.complete and not in_place:
        _put(lambda out: _copy(file, out), target, None)
        return Recovery(target, True, extent.kept)

    problems = []
    if extent.damage:
        problems.append(f'damaged: {", ".join(extent.damage)}')
        if in_place:
            problems.append(f'the damaged file is kept as {_unreadable(path).name}')
    added: list[tuple[int, str, Any]] = []
    if preview is not None:
        try:
            added = missing_preview(contents, preview)
        # Whatever is wrong with a plan must not cost its record.
        except Exception as error:
            problems.append(f'no preview added: {type(error).__name__}: {error}')
    recovery = Recovery(
        target,
        extent.complete,
        extent.kept,
        max(extent.written - extent.kept, 0),
        len(added),
        extent.dropped,
        tuple(problems),
    )
    note = {
        'kept_messages': str(recovery.kept),
        'lost_messages': str(recovery.lost),
        'added_messages': str(recovery.added),
        'dropped_bytes': str(recovery.dropped),
    }
    replaced = path if in_place and not extent.damage else None
    _put(lambda out: rewrite(contents, added, note, out), target, replaced)
    if in_place and extent.damage:
        _set_aside(path)
    return recovery


def _copy(file: BinaryIO, out: BinaryIO) -> None:
    file.seek(0)
    shutil.copyfileobj(file, out)


def _put(write: Callable[[BinaryIO], None], target: Path, replaced: Path | None) -> None:
    """Write the complete file under another name first, then move it to its place."""
    temporary = target.with_name(f'{target.name}.tmp')
    try:
        with temporary.open('wb') as out:
            write(out)
            out.flush()
            os.fsync(out.fileno())
        if replaced is not None:
            # Over the torn file first: there is one of the two at any instant, never both.
            os.replace(temporary, replaced)
            temporary = replaced
        os.replace(temporary, target)
    except OSError as error:
        if temporary != replaced:
            with suppress(OSError):
                temporary.unlink()
        # The user knows the file by the name that it should have got.
        raise OSError(error.errno, error.strerror, str(target)) from error
    sync_directory(target.parent)


def _target(path: Path) -> Path:
    if path.name.endswith(PART):
        return path.with_name(path.name.removesuffix(PART))
    return path.with_name(f'{path.stem}_recovered{path.suffix}')


def _unreadable(path: Path) -> Path:
    return path.with_name(path.name.removesuffix(PART) + _UNREADABLE)


def _set_aside(path: Path) -> str:
    """Rename a file that cannot be read, or not all of it, so that it is not looked at again."""
    target = _unreadable(path)
    try:
        if path.stat().st_size == 0:
            path.unlink()
            return 'removed'
        os.replace(path, target)
    except OSError as error:
        return f'left where it is: {failure_reason(error, path)}'
    return f'now {target.name}'
