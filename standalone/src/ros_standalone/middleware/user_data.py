"""The key=value pairs that ROS writes into the user data of DDS participants and endpoints."""

from __future__ import annotations

from collections.abc import Mapping


def pack_user_data(pairs: Mapping[str, str]) -> bytes:
    """The pairs as bytes, 'key=value;' one after another; empty values are left out."""
    return ''.join(f'{key}={value};' for key, value in pairs.items() if value).encode()


def parse_user_data(data: bytes) -> dict[str, str]:
    """The pairs in user data; what is not of the form 'key=value;' is passed over."""
    pairs = {}
    for item in data.decode('utf-8', 'replace').split(';'):
        key, found, value = item.partition('=')
        if found and key:
            pairs[key] = value
    return pairs


def dotted_hex(identifier: bytes) -> str:
    """An identifier as ROS writes it: bytes in hexadecimal without leading zeros, by dots."""
    return '.'.join(f'{byte:x}' for byte in identifier)
