from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest


def live(what, pace, count):
    """Run a function of lifetimes.py so often; returns what was in use before and after."""
    program = str(Path(__file__).with_name('lifetimes.py'))
    run = subprocess.run(
        [sys.executable, program, what, pace, str(count)],
        capture_output=True,
        text=True,
        timeout=60.0,
        env={**os.environ, 'PYTHONPATH': os.pathsep.join(filter(None, sys.path))},
    )
    assert (run.returncode, run.stderr) == (0, '')
    return json.loads(run.stdout)


def test_init_and_shutdown_leave_nothing_behind():
    before, after = live('use_once', 'busy', 50)
    assert after['descriptors'] <= before['descriptors']
    assert after['threads'] <= before['threads']
    assert after['memory'] < before['memory'] + 5.0


@pytest.mark.parametrize('pace', ['busy', 'idle'])
@pytest.mark.parametrize('what', ['a_context', 'an_executor'])
@pytest.mark.parametrize('who', ['a_thread', 'a_pool'])
def test_what_spins_ends_when_another_thread_shuts_it_down(pace, what, who):
    before, after = live(f'shut_down_{what}_that_{who}_spins', pace, 25)
    assert after['descriptors'] <= before['descriptors']
    assert after['threads'] <= before['threads']
