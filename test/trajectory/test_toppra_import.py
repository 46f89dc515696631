"""toppra is imported without what it draws with, and its absence is named."""

from __future__ import annotations

import subprocess
import sys

import pytest

from cfplan_core import CfplanError
from cfplan_core.trajectory.parameterization import import_toppra

_IMPORT = """
import sys
from cfplan_core.trajectory.parameterization import import_toppra
import_toppra()
assert 'matplotlib.pyplot' not in sys.modules
"""


def _run(script: str) -> None:
    subprocess.run([sys.executable, '-c', script], check=True)


def test_drawing_is_not_imported() -> None:
    _run(_IMPORT)


@pytest.mark.parametrize('first', ['toppra.algorithm.algorithm.plt', 'matplotlib.pyplot'])
def test_drawing_works_for_others_who_use_toppra(first: str) -> None:
    _run(
        f'{_IMPORT}import toppra, matplotlib.pyplot\n'
        f'drawn_with = {first}.figure\n'
        'assert toppra.algorithm.algorithm.plt.figure is matplotlib.pyplot.figure is drawn_with\n'
    )


def test_missing_toppra_is_named_with_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, 'toppra.algorithm', None)
    import_toppra.cache_clear()
    with pytest.raises(CfplanError, match='pip install toppra'):
        import_toppra()
