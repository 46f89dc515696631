from __future__ import annotations

import os
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import Result

from cfplan_core import __version__

Cfplan = Callable[..., Result]
Start = Callable[..., subprocess.Popen[str]]


def test_version_is_printed(cfplan: Cfplan) -> None:
    assert cfplan('--version').output == f'cfplan {__version__}\n'


@pytest.mark.parametrize('arguments', [('no-such-command',), ('plan',), ('verify', 'a')])
def test_incomplete_command_is_a_usage_error(arguments: tuple[str, ...], cfplan: Cfplan) -> None:
    result = cfplan(*arguments)
    assert result.exit_code == 2
    assert 'Usage: cfplan' in result.output


@pytest.mark.parametrize('command', ['check', 'plan', 'verify', 'animate'])
def test_missing_file_is_named(
    command: str, cfplan: Cfplan, problem_file: Path, tmp_path: Path
) -> None:
    missing = tmp_path / 'no [red]such[/] :cat: file'
    arguments = (problem_file, missing) if command == 'verify' else (missing,)
    result = cfplan(command, *arguments)
    assert result.exit_code == 2
    assert str(missing) in result.output


@pytest.mark.parametrize('command', ['check', 'plan', 'animate'])
def test_directory_in_place_of_a_file_is_refused(
    command: str, cfplan: Cfplan, tmp_path: Path
) -> None:
    assert cfplan(command, tmp_path).exit_code == 2


def test_output_into_a_pipe_has_no_colour(start_cfplan: Start, problem_file: Path) -> None:
    process = start_cfplan('plan', problem_file, stdout=subprocess.PIPE)
    output, complaint = process.communicate(timeout=20.0)
    assert process.returncode == 0
    assert '\x1b' not in output
    assert complaint == ''


def test_output_survives_a_terminal_without_unicode(
    start_cfplan: Start, problem_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('PYTHONIOENCODING', 'ascii')
    process = start_cfplan('check', problem_file, stdout=subprocess.PIPE)
    output, complaint = process.communicate(timeout=20.0)
    assert process.returncode == 0
    assert 'palm.0' in output
    assert complaint == ''


def test_reader_that_leaves_early_causes_no_complaint(
    start_cfplan: Start, problem_file: Path
) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    process = start_cfplan('check', problem_file, stdout=writing)
    os.close(writing)
    _, complaint = process.communicate(timeout=20.0)
    assert process.returncode == 141
    assert complaint == ''


@pytest.mark.skipif(not Path('/dev/full').exists(), reason='needs a device that is always full')
def test_full_disk_is_named_without_a_traceback(start_cfplan: Start, problem_file: Path) -> None:
    with Path('/dev/full').open('w') as full:
        process = start_cfplan('check', problem_file, stdout=full.fileno())
        _, complaint = process.communicate(timeout=20.0)
    assert process.returncode == 2
    assert complaint == 'cfplan: No space left on device\n'
