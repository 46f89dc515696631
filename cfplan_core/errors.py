"""The exceptions of cfplan: one family; messages say what was expected, what came, and where."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


class CfplanError(Exception):
    """Base class of every error that a user of cfplan can cause."""


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong with an input.

    Attributes:
        file: Path of the file as the user gave it, or ``'<problem>'`` for data in memory.
        field: Dotted path of the field, e.g. ``hand.fingers[0].joints[0].limits``.
        value: What was found there, shortened for print.
        expected: What would have been right, with its unit; empty if the value says it all.
    """

    file: str
    field: str
    value: str
    expected: str

    def __str__(self) -> str:
        if not self.expected:
            return ': '.join(part for part in (self.file, self.field, self.value) if part)
        where = self.field or '(top level)'
        return f'{self.file}: {where}: got {self.value}, expected {self.expected}'


class InvalidProblemError(CfplanError):
    """A problem file or object breaks its format or describes an impossible grasp.

    Attributes:
        findings: Everything that is wrong, in the order of the file.
    """

    def __init__(self, findings: Sequence[Finding]) -> None:
        self.findings = tuple(findings)
        super().__init__('\n'.join(str(finding) for finding in self.findings))


class InvalidPlanError(CfplanError):
    """A plan file breaks the format ``cfplan/plan/1``."""


class JammedError(CfplanError):
    """A joint velocity admits no object velocity that keeps every gap non-negative."""
