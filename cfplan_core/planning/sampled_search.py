"""Plans for hands of many joints: one expedition after the other, each with another seed.

An expedition finds a path or gives up; it proves nothing. What it finds is looked at before it is
given away, and if it does not hold the search goes on with the next seed. Formations that a plan
has to pass are gone to one after the other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import count, islice, permutations

import numpy as np

from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.budget import BudgetExhaustedError
from cfplan_core.planning.expedition import Expedition
from cfplan_core.planning.goal_test import GoalTest
from cfplan_core.planning.roadmap import Roadmap
from cfplan_core.planning.search import Leg, Tree

# Orders of required formations that are tried, one for each seed.
_MOST_ORDERS = 24
# So many paths in turn that cannot be used end the search.
_MOST_REFUSED = 20


class SampledSearch:
    """Searches by expeditions.

    Attributes:
        attempts: How many searches from start to goal were begun.
        drives: How many drives were pushed along, in all of them.
    """

    def __init__(
        self,
        roadmap: Roadmap,
        start: FloatArray,
        goal: FloatArray | GoalTest,
        required: Sequence[GoalTest] = (),
        seed: int = 0,
        grown: Callable[[int, int], None] = lambda initial, goal: None,
        refuse: Callable[[Sequence[Leg]], bool] = lambda legs: False,
    ) -> None:
        """Prepare.

        Args:
            roadmap: Counts what is found.
            start: Stable configuration, shape (3 + n,).
            goal: Stable configuration, shape (3 + n,), or a test for one.
            required: What some configuration on the way has to fulfil, each.
            seed: Of the first search; later ones derive theirs from it.
            grown: Called with the trees' numbers of nodes before one is added; may raise.
            refuse: Tells of a path whether it cannot be used.
        """
        self.attempts = 0
        self._roadmap = roadmap
        self._start = start
        self._goal = goal
        self._required = tuple(required)
        self._seed = seed
        self._grown = grown
        self._refuse = refuse
        self._expeditions: list[Expedition] = []
        self._spent = 0
        self._nodes = (0, 0)

    @property
    def drives(self) -> int:
        """See the class."""
        return self._spent + sum(expedition.drives for expedition in self._expeditions)

    @property
    def trees(self) -> tuple[Tree, Tree]:
        """CF-trees of the last expedition."""
        if not self._expeditions:
            return Tree(self._start), Tree(self._start)
        return self._expeditions[-1].trees

    @property
    def meeting(self) -> int | None:
        """Where the last expedition's trees met."""
        return self._expeditions[-1].meeting if self._expeditions else None

    def paths(self) -> Iterator[list[Leg]]:
        """Paths from start to goal, each by a search with another seed; there is no last one.

        Raises:
            BudgetExhaustedError: A search gave up, path after path was refused, or the checkpoint
                raised this.
        """
        refused = 0
        for attempt in count():
            self.attempts += 1
            legs = self._attempt(attempt)
            if not self._refuse(legs):
                refused = 0
                yield legs
            else:
                refused += 1
                if refused == _MOST_REFUSED:
                    raise BudgetExhaustedError(f'{refused} paths in turn could not be used')

    def _attempt(self, attempt: int) -> list[Leg]:
        """One path from start to goal."""
        self._spent = self.drives
        self._expeditions = []
        orders = list(islice(permutations(self._required), _MOST_ORDERS))
        legs: list[Leg] = []
        at = self._start
        for number, target in enumerate((*orders[attempt % len(orders)], self._goal)):
            seed = [self._seed, attempt, number] if attempt or number else self._seed
            expedition = Expedition(self._roadmap, at, target, self._counted(), seed)
            self._expeditions.append(expedition)
            if not expedition.run():
                raise BudgetExhaustedError(f'no path found by {self.drives} drives')
            legs += self._path(expedition)
            at = legs[-1].points[-1]
        return _moving(legs)

    def _counted(self) -> Callable[[int, int], None]:
        """What an expedition reports its nodes to: it counts those of all before as well."""
        before = self._nodes

        def grown(initial: int, goal: int) -> None:
            self._nodes = (before[0] + initial, before[1] + goal)
            self._grown(*self._nodes)

        return grown

    @staticmethod
    def _path(expedition: Expedition) -> list[Leg]:
        """The path found; with its detours if there is no time left to look for shorter ways."""
        try:
            return expedition.path()
        except BudgetExhaustedError:
            return expedition.path(shorten=False)


def _moving(legs: list[Leg]) -> list[Leg]:
    """Leave out legs of one point, but the only one."""
    moving = [leg for leg in legs if np.abs(leg.points - leg.points[0]).max() > 0.0]
    return moving or legs[:1]
