"""Change the places of fingers, one after the other, while the object is at rest.

Two grasps of one pose of the object are joined finger by finger. Each finger is where the first
grasp has it, where the other has it, parked out of the way, or at one of some other places on the
object. The shortest sequence of moves (`cfplan_core.planning.exchange`) is tried, and another one
where a finger finds no way.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np

from cfplan_core.contact.formation import Formation
from cfplan_core.contact.gaps import gap_gradients, gaps
from cfplan_core.contact.system import BoolArray, ContactSystem, IntArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import ContactModel
from cfplan_core.planning.clearance import Clearance
from cfplan_core.planning.drives import ToConfiguration
from cfplan_core.planning.exchange import Exchange, Place
from cfplan_core.planning.free_motion import FreeMotion
from cfplan_core.planning.milestones import Milestone
from cfplan_core.planning.parking import parked_postures
from cfplan_core.planning.pushing import Pusher
from cfplan_core.planning.touching_postures import TouchingPostures

# A grasp that a finger leaves to the others is stable by this much.
_HELD = 1e-3
# Samples of a finger's way, and ways that are looked for in one change of grasp.
_MOST_SAMPLES = 300
_MOST_WAYS = 24
_SAME_JOINTS = 1e-7
# Places of a finger where it is parked, and where it touches elsewhere than in both grasps.
_PARKED = 2
_ELSEWHERE = 14
# Bodies that overlap by less may be parted by rounding, in object sizes.
_OVERLAP = 1e-6


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
        checkpoint: Callable[[], None] = lambda: None,
    ) -> None:
        """Prepare.

        Args:
            system: Compiled problem.
            model: Judges stability.
            pusher: Follows motions.
            begin: Configuration that the object begins in, shape (3 + n,).
            end: Configuration that it ends in, shape (3 + n,).
            rng: To draw from.
            checkpoint: Called again and again; may raise to interrupt.
        """
        self._checkpoint = checkpoint
        self._system = system
        self._model = model
        self._pusher = pusher
        self._rng = rng
        self._motions: list[FreeMotion] = []
        self._parked: list[FloatArray] = []
        self._touching: list[TouchingPostures] = []
        # Which finger each contact is of; -1 for the palm.
        self._finger_of = np.full(system.contact_count, -1, dtype=np.intp)
        for index, joints in enumerate(joints for joints in system.finger_joints if len(joints)):
            moved = system.moves[system.pair_body[: system.contact_count]][:, joints].any(axis=1)
            self._finger_of[moved] = index
            checkpoint()
            self._motions.append(FreeMotion(system, joints, checkpoint))
            self._touching.append(TouchingPostures(system, joints))
            self._parked.append(parked_postures(system, joints, begin, end, _PARKED, rng))
        self._between = {
            (one, two): Clearance(system, first.joints, second.joints)
            for (one, first), (two, second) in combinations(enumerate(self._motions), 2)
        }

    @property
    def useful(self) -> bool:
        """True if there are fingers enough that two may hold the object while others move."""
        return len(self._motions) > 2

    def join(self, begin: Milestone, end: Milestone) -> tuple[list[Milestone], bool]:
        """Change from one grasp to another of the same pose.

        Args:
            begin: The first grasp.
            end: The other grasp.

        Returns:
            The grasps on the way, the other one last, and true; what was reached, and false, if
            the change was not found.
        """
        places = [self._places(begin, end, finger) for finger in range(len(self._motions))]
        palm = end.around.gradients[self._finger_of[end.around.pairs] < 0]

        def apart(one: int, two: int) -> BoolArray:
            return self._apart(begin.z, one, places[one], two, places[two])

        exchange = Exchange(places, palm, apart, self._holds)
        state = tuple(int(np.array_equal(own[0].angles, own[1].angles)) for own in places)
        chain: list[Milestone] = []
        at = begin
        moves = exchange.moves(state)
        for _ in range(_MOST_WAYS):
            if not moves:
                break
            finger, place = moves[0]
            reached = self._move(at, finger, places[finger][place])
            if reached:
                chain += reached
                at = reached[-1]
                state = (*state[:finger], place, *state[finger + 1 :])
                moves = moves[1:]
            else:
                exchange.blocked.add((state, finger, place))
                moves = exchange.moves(state)
        return chain, moves == []

    def _places(self, begin: Milestone, end: Milestone, finger: int) -> list[Place]:
        """Where a finger may be: as in the first grasp, the last one, parked, elsewhere."""
        self._checkpoint()
        columns = self._motions[finger].columns
        places = []
        for grasp in (begin, end):
            own = self._finger_of[grasp.around.pairs] == finger
            pairs = frozenset(grasp.around.pairs[own].tolist())
            places.append(Place(grasp.z[columns], pairs, grasp.around.gradients[own]))
        z = np.tile(begin.z, (len(self._parked[finger]), 1))
        z[:, columns] = self._parked[finger]
        free = self._motions[finger].alone(z)
        nothing = np.empty((0, self._system.dof))
        places += [Place(row[columns], frozenset(), nothing) for row in z[free]]
        around = np.array([place.angles for place in places])
        drawn = self._touching[finger].draw(begin.z, around, _ELSEWHERE, self._rng)
        for angles, pair, gradient in zip(*drawn, strict=True):
            places.append(Place(angles, frozenset({int(pair)}), gradient[None]))
        return places

    def _apart(
        self, z: FloatArray, one: int, first: list[Place], two: int, second: list[Place]
    ) -> BoolArray:
        """At which places two fingers do not overlap, shape (p, q)."""
        a, b = np.indices((len(first), len(second))).reshape(2, -1)
        points = np.tile(z, (len(a), 1))
        points[:, self._motions[one].columns] = np.array([p.angles for p in first])[a]
        points[:, self._motions[two].columns] = np.array([p.angles for p in second])[b]
        nearest = self._between[one, two].distances(points).min(axis=1, initial=np.inf)
        return np.asarray((nearest > -_OVERLAP).reshape(len(first), len(second)))

    def _move(self, at: Milestone, finger: int, place: Place) -> list[Milestone]:
        """Move one finger; nothing if there is no way."""
        motion = self._motions[finger]
        own = self._finger_of[at.around.pairs] == finger
        left = at.around.pairs[own]
        made = np.array(sorted(place.pairs), dtype=np.intp)
        goal = at.z.copy()
        goal[motion.columns] = place.angles
        goal = self._closed(goal, made, motion.columns)
        if place.pairs and place.pairs == set(left.tolist()):
            slid = self._slide(at, goal, motion.columns)
            if slid:
                return slid
        if not self._holds(at.around.gradients[~own]):
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
        touched = set(formation.pairs) | place.pairs
        return [reached] if set(reached.around.pairs.tolist()) == touched else []

    def _slide(self, at: Milestone, goal: FloatArray, columns: IntArray) -> list[Milestone]:
        """Move a finger that keeps its contacts; nothing if it does not arrive."""
        weights = np.zeros(self._system.dof)
        weights[:3] = weights[columns] = 1.0
        drive = ToConfiguration(goal, weights, frozenset[int]())
        chain = list(self._pusher.push(at, drive, True))
        arrived = bool(chain) and np.abs(chain[-1].z - goal).max() < _SAME_JOINTS
        return chain if arrived else []

    def _closed(self, z: FloatArray, pairs: IntArray, columns: IntArray) -> FloatArray:
        """Take up by some columns what rounding left of gaps."""
        if len(pairs):
            placed = self._system.place(z[None])
            rows = gap_gradients(self._system, placed, pairs)[0][:, columns]
            gap = gaps(self._system, placed, pairs).gap[0]
            z[columns] -= np.linalg.lstsq(rows, gap, rcond=1e-6)[0]
        return z

    def _holds(self, gradients: FloatArray) -> bool:
        """Tell whether contacts with gradients of shape (k, 3 + n) hold the object well."""
        self._checkpoint()
        if len(gradients) < 3:
            return False
        return bool(self._model.margins(gradients[None]).stable[0] > _HELD)
