"""Words that messages about recordings share."""

from __future__ import annotations


def counted(number: int, thing: str = 'message') -> str:
    """Say how many there are of a thing."""
    return f'{number} {thing}{"" if number == 1 else "s"}'
