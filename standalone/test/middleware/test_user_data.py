from __future__ import annotations

from ros_standalone.middleware.user_data import dotted_hex, pack_user_data, parse_user_data


def test_pairs_are_written_as_ros_writes_them():
    pairs = {'serviceid': '1.10', 'typehash': 'RIHS01_ab'}
    assert pack_user_data(pairs) == b'serviceid=1.10;typehash=RIHS01_ab;'


def test_empty_value_is_left_out():
    assert pack_user_data({'typehash': ''}) == b''


def test_pairs_come_back():
    pairs = {'enclave': '/a/b', 'typehash': 'RIHS01_ab'}
    assert parse_user_data(pack_user_data(pairs)) == pairs


def test_foreign_user_data_is_passed_over():
    assert parse_user_data(b'\xff\x00nonsense;=x;enclave=/;') == {'enclave': '/'}


def test_identifier_is_written_without_leading_zeros():
    assert dotted_hex(bytes((1, 16, 0, 255))) == '1.10.0.ff'
