from __future__ import annotations

import json
import subprocess
from pathlib import Path

import numpy as np

import cfplan_core
from cfplan_ros.recording.provenance import commit_of, provenance

COMMIT = '0123456789abcdef0123456789abcdef01234567'


def _repository(directory: Path) -> Path:
    git = directory / '.git'
    git.mkdir()
    (git / 'HEAD').write_text('ref: refs/heads/work\n')
    return git


def test_record_says_version_node_and_start() -> None:
    record = provenance('/planner', 17, {})
    assert record['version'] == cfplan_core.__version__
    assert (record['node'], record['start_time_ns']) == ('/planner', '17')


def test_problem_can_be_read_back_as_json() -> None:
    problem = {'start': {'joints': np.array([0.1, 0.2])}, 'name': 'p', 'limits': (1, None)}
    record = provenance('/planner', 0, {'problem': problem})
    assert json.loads(record['problem']) == {
        'start': {'joints': [0.1, 0.2]},
        'name': 'p',
        'limits': [1, None],
    }


def test_commit_of_a_branch_is_found(tmp_path: Path) -> None:
    git = _repository(tmp_path)
    (git / 'refs' / 'heads').mkdir(parents=True)
    (git / 'refs' / 'heads' / 'work').write_text(f'{COMMIT}\n')
    assert commit_of(git) == COMMIT


def test_commit_of_a_packed_branch_is_found(tmp_path: Path) -> None:
    git = _repository(tmp_path)
    (git / 'packed-refs').write_text(f'# pack-refs with: peeled\n{COMMIT} refs/heads/work\n')
    assert commit_of(git) == COMMIT


def test_commit_without_a_branch_is_found(tmp_path: Path) -> None:
    git = _repository(tmp_path)
    (git / 'HEAD').write_text(f'{COMMIT}\n')
    assert commit_of(git) == COMMIT


def test_commit_of_a_worktree_is_found(tmp_path: Path) -> None:
    git = _repository(tmp_path)
    (git / 'packed-refs').write_text(f'{COMMIT} refs/heads/other\n')
    own = git / 'worktrees' / 'w'
    own.mkdir(parents=True)
    (own / 'HEAD').write_text('ref: refs/heads/other\n')
    (own / 'commondir').write_text('../..\n')
    worktree = tmp_path / 'w'
    worktree.mkdir()
    (worktree / '.git').write_text(f'gitdir: {own}\n')
    assert commit_of(worktree / '.git') == COMMIT


def test_without_a_repository_there_is_no_commit(tmp_path: Path) -> None:
    assert commit_of(tmp_path / '.git') == ''


def test_branch_without_a_commit_has_none(tmp_path: Path) -> None:
    assert commit_of(_repository(tmp_path)) == ''


def test_commit_is_the_one_git_says(tmp_path: Path) -> None:
    root = Path(cfplan_core.__file__).resolve().parents[1]
    try:
        said = subprocess.run(
            ['git', '-C', str(root), 'rev-parse', 'HEAD'],
            capture_output=True,
            text=True,
            timeout=10,
            check=True,
        ).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        said = ''
    if (root / '.git').exists():
        assert commit_of(root / '.git') == said
