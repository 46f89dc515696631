import importlib

import pytest

from rclpy import _unsupported
from rclpy.type_hash import TypeHash

TEXT = 'RIHS01_86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf'


@pytest.mark.parametrize('module', ['rclpy.action', 'rclpy.lifecycle', 'rclpy.parameter_client'])
def test_a_module_that_is_not_covered_says_so(module):
    _unsupported.explain_missing_modules()
    with pytest.raises(ImportError, match=f'{module} is not part of the standalone rclpy'):
        importlib.import_module(module)


def test_other_missing_modules_are_left_to_python():
    _unsupported.explain_missing_modules()
    with pytest.raises(ModuleNotFoundError, match="No module named 'no_such_module'"):
        importlib.import_module('no_such_module')


def test_a_name_that_is_not_covered_says_so():
    missing = _unsupported.module_getattr('rclpy.qos')
    with pytest.raises(AttributeError, match=r'rclpy\.qos\.Magic is not part of'):
        missing('Magic')


def test_a_type_hash_survives_its_text():
    assert str(TypeHash.from_text(TEXT)) == TEXT


@pytest.mark.parametrize('text', ['', 'RIHS01_12', TEXT[:-1] + 'x', 'x' + TEXT])
def test_what_is_no_hash_is_invalid(text):
    assert str(TypeHash.from_text(text)) == 'INVALID'
