"""The end of a search that has not found what it looked for."""

from __future__ import annotations


class BudgetExhaustedError(Exception):
    """A search must stop; the message says why."""
