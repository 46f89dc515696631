"""The files around the code agree with each other."""

from __future__ import annotations

import re
import subprocess
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

import cfplan_core

ROOT = Path(__file__).parents[1]


def _requirements() -> set[str]:
    """Names of the packages that setup.py asks for, extras included."""
    text = (ROOT / 'setup.py').read_text(encoding='utf-8')
    asked = text[text.index('install_requires') : text.index('entry_points')]
    return {name.lower() for name in re.findall(r"'([A-Za-z-]+)(?:>=[\d.]+)?'", asked)} - {
        'study',
        'test',
        'lint',
    }


def _pins() -> list[str]:
    lines = (ROOT / 'constraints.txt').read_text(encoding='utf-8').splitlines()
    return [line for line in lines if line and not line.startswith('#')]


def test_version_is_the_same_everywhere() -> None:
    package = ElementTree.parse(ROOT / 'package.xml').getroot()
    assert package.findtext('version') == cfplan_core.__version__
    setup = (ROOT / 'setup.py').read_text(encoding='utf-8')
    assert f"version='{cfplan_core.__version__}'" in setup


def test_every_requirement_is_pinned() -> None:
    pinned = {pin.partition('==')[0].lower() for pin in _pins()}
    assert _requirements() <= pinned


@pytest.mark.parametrize('pin', _pins())
def test_pin_is_a_name_a_version_and_at_most_a_marker(pin: str) -> None:
    marker = r"; (python_version (<|>=|==) '3\.\d+'|sys_platform == 'win32')"
    assert re.fullmatch(rf'[a-z0-9-]+==[0-9.]+({marker})?', pin)


def test_make_help_lists_every_target() -> None:
    makefile = (ROOT / 'Makefile').read_text(encoding='utf-8')
    phony = re.search(r'^\.PHONY: (.+)$', makefile, re.MULTILINE)
    assert phony is not None
    helped = subprocess.run(
        ['make', '--no-print-directory', 'help'],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert re.findall(r'make (\w+)', helped) == phony[1].split()
