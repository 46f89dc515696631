"""What can go wrong with interfaces and their bytes."""

from __future__ import annotations


class InterfaceNotFoundError(LookupError):
    """No interface of that name is installed."""


class InterfaceFormatError(ValueError):
    """An interface file cannot be read."""


class SerializationError(ValueError):
    """A message cannot be written, or bytes cannot be read, as CDR."""
