"""Change the places of fingers, one after the other, while the object is at rest.

Two grasps of one pose of the object are joined finger by finger. Each finger is where the first
grasp has it, where the other has it, or parked out of the way; of all combinations of these those
count in which no two bodies overlap and the contacts hold the object, also while a finger is on
its way. The shortest sequence of moves is tried, and another one where a finger finds no way.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator

import numpy as np

from cfplan_core.contact.formation import Formation
from cfplan_core.contact.gaps import gap_gradients, gaps
from cfplan_core.contact.system import BoolArray, ContactSystem, IntArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import ContactModel
from cfplan_core.planning.clearance import Clearance
from cfplan_core.planning.drives import ToConfiguration
from cfplan_core.planning.free_motion import FreeMotion
from cfplan_core.planning.milestones import Milestone
from cfplan_core.planning.parking import parked_postures
from cfplan_core.planning.pushing import Pusher
from cfplan_core.planning.transitions import Surroundings

# A grasp that a finger leaves to the others is stable by this much.
_HELD = 0.005
# Samples of a finger's way, and ways that are looked for in one change of grasp.
_MOST_SAMPLES = 60
_MOST_WAYS = 14
_SAME_JOINTS = 1e-7
# Parked postures of a finger.
_PARKED = 2
# Bodies that overlap by less may be parted by rounding, in object sizes.
_OVERLAP = 1e-6

# Where each finger is: 0 as in the first grasp, 1 as in the last, then its parked postures.
Places = tuple[int, ...]


class Regrasping:
    """Changes of grasp at rest."""

    def __init__(
        self,
        system: ContactSystem,
        model: ContactModel,
        pusher: Pusher,
        begin: FloatArray,
        end: FloatArray,
        rng: np.random.Generator,
    ) -> None:
        """Prepare for one system and for motions of the object between two configurations."""
        self._system = system
        self._model = model
        self._pusher = pusher
        self._rng = rng
        self._motions: list[FreeMotion] = []
        self._parked: list[FloatArray] = []
        # Which finger each contact is of; -1 for the palm.
        self._finger_of = np.full(system.contact_count, -1, dtype=np.intp)
        first = 0
        for index, finger in enumerate(system.problem.hand.fingers):
            joints = np.arange(first, first + len(finger.joints))
            first += len(joints)
            moved = system.moves[system.pair_body[: system.contact_count]][:, joints].any(axis=1)
            self._finger_of[moved] = index
            self._motions.append(FreeMotion(system, joints))
            self._parked.append(parked_postures(system, joints, begin, end, _PARKED, rng))
        self._clearance = Clearance(system, np.arange(system.joint_count))

    def possible(self, begin: Surroundings, end: Surroundings) -> bool:
        """Tell whether there is an order in which the object is held all the time.

        Args:
            begin: What touches in the first grasp; wrenches count as if its pose were the other's.
            end: What touches in the last one.
        """
        return _Exchange(self, begin, end, np.ones((3,) * len(self._motions), bool)).exists()

    def join(self, begin: Milestone, end: Milestone) -> tuple[list[Milestone], bool]:
        """Change from one grasp to another of the same pose.

        Args:
            begin: The first grasp.
            end: The other grasp.

        Returns:
            The grasps on the way, the other one last, and true; what was reached, and false, if
            the change was not found.
        """
        postures = self._postures(begin, end)
        exchange = _Exchange(self, begin.around, end.around, self._apart(begin, postures))
        chain: list[Milestone] = []
        at, ways = begin, 0
        places = tuple(int(np.array_equal(own[0], own[1])) for own in postures)
        while ways < _MOST_WAYS:
            moves = exchange.shortest(places)
            if moves is None:
                return chain, False
            if not moves:
                return chain, True
            finger, place = moves[0]
            ways += 1
            made = (begin, end)[place].around.pairs if place < 2 else np.empty(0, dtype=np.intp)
            made = made[self._finger_of[made] == finger]
            reached = self._move(at, finger, postures[finger][place], made)
            if not reached:
                exchange.blocked.add((places, finger, place))
                continue
            chain += reached
            at = reached[-1]
            places = (*places[:finger], place, *places[finger + 1 :])
        return chain, False

    def _postures(self, begin: Milestone, end: Milestone) -> list[FloatArray]:
        """Angles of each finger in the first grasp, in the last one, and parked."""
        return [
            np.concatenate([begin.z[None, m.columns], end.z[None, m.columns], parked])
            for m, parked in zip(self._motions, self._parked, strict=True)
        ]

    def _apart(self, begin: Milestone, postures: list[FloatArray]) -> BoolArray:
        """Which combinations of places leave no two bodies overlapping."""
        shape = tuple(len(own) for own in postures)
        combinations = np.indices(shape).reshape(len(shape), -1)
        z = np.tile(begin.z, (combinations.shape[1], 1))
        for motion, own, chosen in zip(self._motions, postures, combinations, strict=True):
            z[:, motion.columns] = own[chosen]
        return np.asarray((self._clearance.distances(z) > -_OVERLAP).all(axis=1).reshape(shape))

    def _move(
        self, at: Milestone, finger: int, angles: FloatArray, made: IntArray
    ) -> list[Milestone]:
        """Move one finger; nothing if there is no way."""
        system, motion = self._system, self._motions[finger]
        own = self._finger_of[at.around.pairs] == finger
        left = at.around.pairs[own]
        goal = at.z.copy()
        goal[motion.columns] = angles
        goal = self._touching(goal, made, motion.columns)
        if len(made) and set(made.tolist()) == set(left.tolist()):
            slid = self._slide(at, goal, motion.columns)
            if slid:
                return slid
        if not self.holds(at.around.gradients[~own]):
            return []
        if at.around.together[np.ix_(~own, ~own)].any():
            return []
        way = motion.way(at.z, left, goal, made, self._rng, _MOST_SAMPLES)
        if way is None:
            return []
        formation = Formation(tuple(int(pair) for pair in at.around.pairs[~own]))
        reached = self._pusher.along(at, formation, way)
        if reached is None:
            return []
        touched = set(formation.pairs) | set(made.tolist())
        return [reached] if set(reached.around.pairs.tolist()) == touched else []

    def _slide(self, at: Milestone, goal: FloatArray, columns: IntArray) -> list[Milestone]:
        """Move a finger that keeps its contacts; nothing if it does not arrive."""
        weights = np.zeros(self._system.dof)
        weights[:3] = weights[columns] = 1.0
        drive = ToConfiguration(goal, weights, frozenset[int]())
        chain = list(self._pusher.push(at, drive, True))
        arrived = bool(chain) and np.abs(chain[-1].z - goal).max() < _SAME_JOINTS
        return chain if arrived else []

    def _touching(self, z: FloatArray, pairs: IntArray, columns: IntArray) -> FloatArray:
        """Take up by some columns what rounding left of gaps."""
        if len(pairs):
            placed = self._system.place(z[None])
            rows = gap_gradients(self._system, placed, pairs)[0][:, columns]
            gap = gaps(self._system, placed, pairs).gap[0]
            z[columns] -= np.linalg.lstsq(rows, gap, rcond=1e-6)[0]
        return z

    def holds(self, gradients: FloatArray) -> bool:
        """Tell whether contacts with gradients of shape (k, 3 + n) hold the object well."""
        if len(gradients) < 3:
            return False
        return bool(self._model.margins(gradients[None]).stable[0] > _HELD)

    def rows(self, around: Surroundings) -> list[FloatArray]:
        """Gradients of the contacts of each finger, and of the palm last."""
        of = self._finger_of[around.pairs]
        return [around.gradients[of == f] for f in (*range(len(self._motions)), -1)]

    def pairs(self, around: Surroundings) -> list[frozenset[int]]:
        """Contacts of each finger."""
        of = self._finger_of[around.pairs]
        return [
            frozenset(around.pairs[of == f].tolist()) for f in range(len(self._motions))
        ]


class _Exchange:
    """The graph of where fingers may be between two grasps."""

    def __init__(
        self, regrasping: Regrasping, begin: Surroundings, end: Surroundings, apart: BoolArray
    ) -> None:
        self._regrasping = regrasping
        self._apart = apart
        first, last = regrasping.rows(begin), regrasping.rows(end)
        self._palm = last[-1]
        self._rows = list(zip(first[:-1], last[:-1], strict=True))
        same = zip(regrasping.pairs(begin), regrasping.pairs(end), strict=True)
        self._slides = [bool(before) and before == after for before, after in same]
        self._held: dict[Places, bool] = {}
        self.blocked: set[tuple[Places, int, int]] = set()

    def exists(self) -> bool:
        """Tell whether the last grasp can be reached from the first."""
        return self.shortest((0,) * len(self._rows)) is not None

    def shortest(self, begin: Places) -> list[tuple[int, int]] | None:
        """Fewest moves to the last grasp, each a finger and its new place; None if it cannot be."""
        end = (1,) * len(begin)
        before: dict[Places, tuple[Places, tuple[int, int]] | None] = {begin: None}
        waiting = deque([begin])
        while waiting and end not in before:
            places = waiting.popleft()
            for finger, place in self._moves(places):
                after = (*places[:finger], place, *places[finger + 1 :])
                if after not in before:
                    before[after] = places, (finger, place)
                    waiting.append(after)
        if end not in before:
            return None
        moves = []
        step = before[end]
        while step is not None:
            moves.append(step[1])
            step = before[step[0]]
        return moves[::-1]

    def _moves(self, places: Places) -> Iterator[tuple[int, int]]:
        """Moves of one finger that the other contacts and the room allow."""
        for finger, at in enumerate(places):
            held = self._holds_without(places, finger)
            for place in range(self._apart.shape[finger]):
                after = (*places[:finger], place, *places[finger + 1 :])
                slides = self._slides[finger] and {at, place} == {0, 1}
                if place == at or not self._apart[after] or not (held or slides):
                    continue
                if (places, finger, place) not in self.blocked:
                    yield finger, place

    def _holds_without(self, places: Places, finger: int) -> bool:
        # All parked postures hold alike, and the finger's own place does not matter.
        key = tuple(min(place, 2) for place in places)
        key = (*key[:finger], 2, *key[finger + 1 :])
        if key not in self._held:
            rows = [self._rows[f][place] for f, place in enumerate(key) if place < 2]
            self._held[key] = self._regrasping.holds(np.concatenate([self._palm, *rows]))
        return self._held[key]
