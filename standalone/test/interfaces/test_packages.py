import importlib
import os
import subprocess
import sys
from fnmatch import fnmatch
from pathlib import Path

import pytest

from ament_index_python.packages import (
    PackageNotFoundError,
    get_package_prefix,
    get_package_share_directory,
    get_package_share_path,
)
from ros_standalone.interfaces import interface_names, load, package_names
from ros_standalone.interfaces.catalog import DEFINITIONS_PATH

_MODULES = [
    (package, kind)
    for package in package_names()
    for kind in ('msg', 'srv')
    if interface_names(package, kind)
]


@pytest.mark.parametrize(('package', 'kind'), _MODULES)
def test_every_interface_is_in_the_module_of_its_package(package: str, kind: str) -> None:
    module = importlib.import_module(f'{package}.{kind}')
    assert module.__all__ == dir(module) == list(interface_names(package, kind))
    for name in module.__all__:
        assert getattr(module, name) is load(f'{package}/{kind}/{name}')


def test_a_name_that_a_module_does_not_have_cannot_be_imported() -> None:
    with pytest.raises(ImportError, match=r"cannot import name 'Strin' from 'std_msgs.msg'"):
        from std_msgs.msg import Strin  # noqa: F401


def test_importing_a_message_imports_nothing_heavy() -> None:
    code = (
        'import sys\n'
        'from std_msgs.msg import String\n'
        'String(data="x")\n'
        'print(*{"numpy", "rosbags", "cyclonedds", "yaml", "rclpy"} & sys.modules.keys())'
    )
    run = subprocess.run(
        [sys.executable, '-c', code],
        env={**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        timeout=30,
        check=True,
    )
    assert run.stdout.strip() == ''


def test_every_definition_is_package_data() -> None:
    root = Path(DEFINITIONS_PATH)
    files = [path.relative_to(root).as_posix() for path in root.glob('*/*/*') if path.is_file()]
    assert 'cfplan_msgs/srv/PlanManipulation.srv' in files
    stray = [
        name
        for name in files
        if not (fnmatch(name, '*/msg/*.msg') or fnmatch(name, '*/srv/*.srv'))
    ]
    assert stray == []


def test_the_share_directory_of_an_interface_package_has_its_files() -> None:
    assert (get_package_share_path('cfplan_msgs') / 'srv' / 'PlanManipulation.srv').is_file()
    assert os.path.isdir(os.path.join(get_package_share_directory('std_msgs'), 'msg'))


def test_a_package_under_the_prefix_path_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    index = tmp_path / 'share' / 'ament_index' / 'resource_index' / 'packages'
    index.mkdir(parents=True)
    (index / 'some_package').touch()
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path))
    assert get_package_prefix('some_package') == str(tmp_path)
    assert get_package_share_path('some_package', print_warning=False) == (
        tmp_path / 'share' / 'some_package'
    )


def test_a_share_directory_that_does_not_exist_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    index = tmp_path / 'share' / 'ament_index' / 'resource_index' / 'packages'
    index.mkdir(parents=True)
    (index / 'some_package').touch()
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path))
    get_package_share_directory('some_package')
    assert 'Share directory for some_package' in capsys.readouterr().err


def test_an_unknown_package_is_named() -> None:
    with pytest.raises(PackageNotFoundError, match="package 'no_package' not found, searching"):
        get_package_share_directory('no_package')


def test_a_name_that_no_package_can_have_is_refused() -> None:
    with pytest.raises(ValueError, match=r"'\.\./x' is not a valid package name"):
        get_package_prefix('../x')
