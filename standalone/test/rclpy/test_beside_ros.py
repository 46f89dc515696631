from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import rclpy
from rclpy._beside_ros import find_real_rclpy

OWN = str(Path(rclpy.__file__).parent)


def compiled(folder: Path) -> Path:
    package = folder / 'rclpy'
    package.mkdir(parents=True)
    (package / '__init__.py').touch()
    (package / '_rclpy_pybind11.cpython-312-x86_64-linux-gnu.so').touch()
    return package


def sourced(prefix: Path) -> Path:
    share = prefix / 'share' / 'rclpy'
    share.mkdir(parents=True)
    (share / 'package.xml').touch()
    return share


def test_a_compiled_rclpy_on_the_path_is_found(tmp_path):
    package = compiled(tmp_path)
    assert find_real_rclpy(OWN, [str(tmp_path)], {}) == str(package)


def test_a_sourced_rclpy_is_found(tmp_path):
    share = sourced(tmp_path / 'ros')
    prefixes = os.pathsep.join((str(tmp_path / 'overlay'), str(tmp_path / 'ros')))
    assert find_real_rclpy(OWN, [], {'AMENT_PREFIX_PATH': prefixes}) == str(share)


@pytest.mark.parametrize('prefixes', ['', '/nowhere'])
def test_nothing_is_found_where_there_is_no_ros(prefixes):
    assert find_real_rclpy(OWN, sys.path, {'AMENT_PREFIX_PATH': prefixes}) is None


@pytest.mark.parametrize('how', ['sourced', 'on the path'])
def test_the_import_is_refused_with_a_way_out(tmp_path, how):
    paths = [entry for entry in sys.path if entry]
    environment = {**os.environ, 'AMENT_PREFIX_PATH': ''}
    if how == 'sourced':
        sourced(tmp_path)
        environment['AMENT_PREFIX_PATH'] = str(tmp_path)
    else:
        compiled(tmp_path)
        paths.append(str(tmp_path))
    environment['PYTHONPATH'] = os.pathsep.join([str(Path(OWN).parent), *paths])
    run = subprocess.run(
        [sys.executable, '-c', 'import rclpy'], env=environment, capture_output=True, text=True
    )
    assert run.returncode == 1
    assert 'ImportError: the standalone rclpy' in run.stderr
    assert str(tmp_path) in run.stderr
    assert 'pip uninstall cfplan-standalone' in run.stderr
