"""What a verification measured: one row per check, one entry per failure."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from cfplan_core.verification.checks import CHECKS


class Failure(NamedTuple):
    """One thing that is wrong with a plan.

    Attributes:
        frame: Index of the frame; None for the plan as a whole. What is wrong between two frames
            carries the index of the second.
        check: Name of the check.
        message: What was found and what was expected.
    """

    frame: int | None
    check: str
    message: str


@dataclass(frozen=True)
class Check:
    """What one check found over the whole plan.

    Attributes:
        name: As in `CHECKS`.
        description: What is checked, for a table.
        count: How often it was applied; 0 if it did not apply or could not be.
        failed: How often it failed.
        worst: The value nearest to the limit or farthest beyond it; nan if the count is 0.
        worst_frame: Where that was; None for the plan as a whole.
        limit: What the value must not exceed, or must reach if `at_least`.
        unit: Of value and limit; empty for a plain number.
        at_least: True if the limit is a smallest value.
    """

    name: str
    description: str
    count: int
    failed: int
    worst: float
    worst_frame: int | None
    limit: float
    unit: str
    at_least: bool

    @property
    def ok(self) -> bool:
        """True if nothing failed."""
        return self.failed == 0


@dataclass(frozen=True)
class VerificationReport:
    """The verdict on a plan.

    Attributes:
        problem: Name of the problem.
        frames: Number of frames of the plan.
        checks: Every check, in the order of `CHECKS`.
        failures: Everything that is wrong, the plan as a whole first, then by frame.
    """

    problem: str
    frames: int
    checks: tuple[Check, ...]
    failures: tuple[Failure, ...]

    @property
    def ok(self) -> bool:
        """True if the plan is certified."""
        return not self.failures

    @property
    def first_failure(self) -> Failure | None:
        """The first thing that is wrong, or None."""
        return self.failures[0] if self.failures else None

    def check(self, name: str) -> Check:
        """Return the check of this name.

        Raises:
            KeyError: There is none.
        """
        for check in self.checks:
            if check.name == name:
                return check
        raise KeyError(f'{name!r} is not one of {", ".join(check.name for check in self.checks)}')


class Recorder:
    """Collects measurements while a plan is checked."""

    def __init__(self) -> None:
        self._count = dict.fromkeys(CHECKS, 0)
        self._failed = dict.fromkeys(CHECKS, 0)
        self._worst: dict[str, tuple[float, int | None]] = {}
        self._failures: list[Failure] = []

    def measure(self, check: str, value: float, frame: int | None, what: str) -> bool:
        """Hold a value against the limit of a check.

        Args:
            check: Name in `CHECKS`.
            value: In the unit of the check; nan fails.
            frame: Where; None for the plan as a whole.
            what: Says what the value is, for the message.

        Returns:
            True if the value is within the limit.
        """
        rule = CHECKS[check]
        fits = rule.holds(value)
        self._note(check, value, frame)
        if not fits:
            bound = 'at least' if rule.at_least else 'at most'
            unit = f' {rule.unit}' if rule.unit else ''
            self._fail(
                check,
                frame,
                f'{what} is {value:.6g}{unit}, expected {bound} {rule.limit:.6g}{unit}',
            )
        return fits

    def require(self, check: str, holds: bool, frame: int | None, message: str) -> bool:
        """Record a yes-or-no check; its value is 0 or 1, its limit 0.

        Args:
            check: Name in `CHECKS`.
            holds: The outcome, returned as it is.
            frame: Where; None for the plan as a whole.
            message: What was found and what was expected, used if it does not hold.
        """
        self._note(check, 0.0 if holds else 1.0, frame)
        if not holds:
            self._fail(check, frame, message)
        return holds

    def report(self, problem: str, frames: int) -> VerificationReport:
        """Close the record."""
        order = {name: k for k, name in enumerate(CHECKS)}
        failures = sorted(
            self._failures,
            key=lambda f: (-1 if f.frame is None else f.frame, order[f.check]),
        )
        checks = []
        for name, rule in CHECKS.items():
            worst, worst_frame = self._worst.get(name, (math.nan, None))
            checks.append(
                Check(
                    name=name,
                    description=rule.description,
                    count=self._count[name],
                    failed=self._failed[name],
                    worst=worst,
                    worst_frame=worst_frame,
                    limit=rule.limit,
                    unit=rule.unit,
                    at_least=rule.at_least,
                )
            )
        return VerificationReport(problem, frames, tuple(checks), tuple(failures))

    def _note(self, check: str, value: float, frame: int | None) -> None:
        self._count[check] += 1
        so_far = self._worst.get(check)
        if so_far is None or CHECKS[check].is_worse(value, so_far[0]):
            self._worst[check] = (value, frame)

    def _fail(self, check: str, frame: int | None, message: str) -> None:
        self._failed[check] += 1
        self._failures.append(Failure(frame, check, message))
