"""The hash of an interface type, by which ROS processes know that they mean the same."""

from __future__ import annotations

import re


class TypeHash:
    """A type hash of REP-2011.

    Args:
        version: Version of the hashing; -1 for an unknown hash.
        value: The hash's 32 bytes.
    """

    _TYPE_HASH_SIZE = 32

    __slots__ = ('_value', '_version')

    def __init__(self, version: int = -1, value: bytes = bytes(_TYPE_HASH_SIZE)) -> None:
        self._version = version
        self._value = value

    @classmethod
    def from_text(cls, text: str) -> TypeHash:
        """From 'RIHS01_<64 hexadecimal digits>'; the unknown hash for any other text."""
        match = re.fullmatch(r'RIHS([0-9]{2})_([0-9a-f]{64})', text)
        return cls() if match is None else cls(int(match[1]), bytes.fromhex(match[2]))

    @property
    def version(self) -> int:
        """Version of the hashing."""
        return self._version

    @property
    def value(self) -> bytes:
        """The hash's bytes."""
        return self._value

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, TypeHash):
            return False
        return (self._version, self._value) == (other._version, other._value)

    __hash__ = None  # type: ignore[assignment]

    def __str__(self) -> str:
        if self._version <= 0 or len(self._value) != self._TYPE_HASH_SIZE:
            return 'INVALID'
        return f'RIHS{self._version:02}_{self._value.hex()}'
