"""How often a plan ends in its goal grasp in worlds that are not quite the planned one."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cfplan_core.errors import CfplanError
from cfplan_core.execution.execute import Executor
from cfplan_core.execution.outcome import Outcome

# Of a normal distribution, 95 % lie within so many standard deviations.
_DEVIATIONS = 1.959963984540054


@dataclass(frozen=True)
class SuccessRate:
    """How many of a number of trials succeeded.

    Attributes:
        successes: How many did.
        trials: How many there were.
    """

    successes: int
    trials: int

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's interval: where the true rate is with a confidence of 95 %.

        E. B. Wilson, Probable inference, the law of succession, and statistical inference, 1927.
        """
        n, z2 = self.trials, _DEVIATIONS**2
        rate = self.successes / n
        middle = (rate + z2 / (2.0 * n)) / (1.0 + z2 / n)
        half = np.sqrt(rate * (1.0 - rate) / n + z2 / (4.0 * n * n)) * _DEVIATIONS / (1.0 + z2 / n)
        return max(0.0, float(middle - half)), min(1.0, float(middle + half))


@dataclass(frozen=True, eq=False)
class Trials:
    """The outcomes of many executions of one plan, in the order of their numbers."""

    outcomes: tuple[Outcome, ...]

    @property
    def success(self) -> SuccessRate:
        """How many ended in the goal grasp."""
        return SuccessRate(sum(o.in_goal for o in self.outcomes), len(self.outcomes))

    def first_losses(self) -> Counter[tuple[int, str]]:
        """Which contact, in which segment, each trial that failed lost first, with how often."""
        failed = (o.lost for o in self.outcomes if not o.in_goal)
        return Counter((lost[0].segment, lost[0].contact) for lost in failed if lost)

    def quantile(self, values: Callable[[Outcome], float], part: float) -> float:
        """What a part of the trials stay below, of some measure of an outcome."""
        return float(np.quantile([values(o) for o in self.outcomes], part))


def run_trials(
    executor: Executor, count: int, progress: Callable[[int, int], None] | None = None
) -> Trials:
    """Execute a plan in worlds 0 to `count` - 1 of the executor's seed.

    Args:
        executor: Of the plan.
        count: At least 1.
        progress: Called with the numbers of trials done and of successes.

    Raises:
        CfplanError: The count is not positive.
    """
    if count < 1:
        raise CfplanError(f'trials: got {count}, expected a number above zero')
    outcomes: list[Outcome] = []
    for trial in range(count):
        outcomes.append(executor.run(trial).outcome)
        if progress is not None:
            progress(len(outcomes), _successes(outcomes))
    return Trials(tuple(outcomes))


def _successes(outcomes: Sequence[Outcome]) -> int:
    return sum(outcome.in_goal for outcome in outcomes)
