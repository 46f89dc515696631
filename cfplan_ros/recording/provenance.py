"""What the metadata record ``cfplan`` of a run says: enough to run it again."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from datetime import datetime, timezone
from functools import lru_cache
from pathlib import Path
from typing import Any

import cfplan_core

RECORD = 'cfplan'
FORMAT = 'cfplan/run/1'


def provenance(
    node_name: str, start_time_ns: int, metadata: Mapping[str, object]
) -> dict[str, str]:
    """Put together the metadata record of a run.

    Args:
        node_name: Fully qualified name of the recording node.
        start_time_ns: Start of the run in the node's time, ns since the epoch.
        metadata: What the caller knows: ``problem`` (a mapping in the format
            ``cfplan/problem/1``), ``options``, ``parameters``. Text is kept as it is, anything
            else becomes JSON.
    """
    return {
        'format': FORMAT,
        'version': cfplan_core.__version__,
        'git_commit': git_commit(),
        'node': node_name,
        'start_time_ns': str(start_time_ns),
        'recorded_at': datetime.now(timezone.utc).isoformat(timespec='milliseconds'),
        **{
            name: value if isinstance(value, str) else json.dumps(_plain(value))
            for name, value in metadata.items()
        },
    }


@lru_cache(maxsize=1)
def git_commit() -> str:
    """Commit of the checked out repository that cfplan runs from; empty for an installed one."""
    return commit_of(Path(cfplan_core.__file__).resolve().parents[1] / '.git')


def commit_of(git: Path) -> str:
    """Read the commit that a repository has checked out, without calling git.

    Args:
        git: A repository's ``.git``, the directory or a worktree's file; may be missing.

    Returns:
        40 hexadecimal digits, or nothing if there is no such repository.
    """
    try:
        if git.is_file():
            git = git.parent / _value_of(git, 'gitdir: ')
        reference = _value_of(git / 'HEAD', 'ref: ')
        if not reference.startswith('refs/'):
            return reference
        shared = git / 'commondir'
        common = git / shared.read_text(encoding='utf-8').strip() if shared.exists() else git
        for place in (git, common):
            if (place / reference).is_file():
                return _value_of(place / reference, '')
        packed = (common / 'packed-refs').read_text(encoding='utf-8').splitlines()
    except (OSError, UnicodeDecodeError):
        return ''
    return next((line[:40] for line in packed if line[41:] == reference), '')


def _value_of(path: Path, key: str) -> str:
    return path.read_text(encoding='utf-8').strip().removeprefix(key)


def _plain(value: object) -> Any:
    """Turn mappings, sequences, arrays and numbers into what JSON knows."""
    if hasattr(value, 'tolist'):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): _plain(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value if value is None or isinstance(value, (bool, int, float, str)) else str(value)
