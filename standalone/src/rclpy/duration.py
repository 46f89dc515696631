"""A span of time in whole nanoseconds."""

from __future__ import annotations

import builtin_interfaces.msg
from rclpy.constants import S_TO_NS


class Duration:
    """A span between two points in time.

    Args:
        seconds: Seconds; the fraction counts.
        nanoseconds: Nanoseconds added to them; the fraction is dropped.

    Raises:
        OverflowError: If the sum does not fit 64 bits.
    """

    def __init__(self, *, seconds: float = 0, nanoseconds: float = 0) -> None:
        total = int(seconds * S_TO_NS) + int(nanoseconds)
        if not -(2**63) <= total < 2**63:
            raise OverflowError('Total nanoseconds value is too large to store in C duration.')
        self._nanoseconds = total

    @property
    def nanoseconds(self) -> int:
        """The whole span [ns]."""
        return self._nanoseconds

    def to_msg(self) -> builtin_interfaces.msg.Duration:
        """As builtin_interfaces/Duration."""
        seconds, nanoseconds = divmod(self._nanoseconds, S_TO_NS)
        return builtin_interfaces.msg.Duration(sec=seconds, nanosec=nanoseconds)

    @classmethod
    def from_msg(cls, msg: builtin_interfaces.msg.Duration) -> Duration:
        """From builtin_interfaces/Duration; anything else raises TypeError."""
        if not isinstance(msg, builtin_interfaces.msg.Duration):
            raise TypeError('Must pass a builtin_interfaces.msg.Duration object')
        return cls(seconds=msg.sec, nanoseconds=msg.nanosec)

    def __repr__(self) -> str:
        return f'Duration(nanoseconds={self._nanoseconds})'

    def __str__(self) -> str:
        if self._nanoseconds == Infinite.nanoseconds:
            return 'Infinite'
        return f'{self._nanoseconds} nanoseconds'

    def __eq__(self, other: object) -> bool:
        if isinstance(other, Duration):
            return self._nanoseconds == other.nanoseconds
        return NotImplemented

    # Equality without a hash, as in rclpy.
    __hash__ = None  # type: ignore[assignment]

    def __lt__(self, other: Duration) -> bool:
        if isinstance(other, Duration):
            return self._nanoseconds < other.nanoseconds
        return NotImplemented

    def __le__(self, other: Duration) -> bool:
        if isinstance(other, Duration):
            return self._nanoseconds <= other.nanoseconds
        return NotImplemented

    def __gt__(self, other: Duration) -> bool:
        if isinstance(other, Duration):
            return self._nanoseconds > other.nanoseconds
        return NotImplemented

    def __ge__(self, other: Duration) -> bool:
        if isinstance(other, Duration):
            return self._nanoseconds >= other.nanoseconds
        return NotImplemented


Infinite = Duration(nanoseconds=2**63 - 1)
"""Longer than anything: the middleware's infinite duration."""
