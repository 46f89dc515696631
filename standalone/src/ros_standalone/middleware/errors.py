"""What the middleware raises."""

from __future__ import annotations


class MiddlewareError(RuntimeError):
    """Cyclone DDS refused an operation; the text says which one and why."""


class ClosedError(MiddlewareError):
    """A participant, writer, reader, server or client was used after it was closed."""


class ConfigurationError(MiddlewareError):
    """An environment variable holds what it cannot; the text names it, its value and the range."""
