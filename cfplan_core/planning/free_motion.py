"""Move one finger through free space while all else is at rest.

Two trees of the finger's joint angles grow towards each other (RRT-Connect, Kuffner & LaValle,
ICRA 2000), from just off the contacts that it leaves to just off those that it makes. Samples are
tested for clearance only; whoever follows the way has the last word.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cfplan_core.contact.gaps import gap_gradients
from cfplan_core.contact.system import BoolArray, ContactSystem, IntArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.clearance import Clearance

# Distance kept from everything on the way, in object sizes.
_KEPT = 0.004
# A finger is lifted off its contacts by one of these, in object sizes.
_LIFTS = (0.06, 0.02, 0.008)
# Longest step of a tree, and distance of samples that are tested, in rad.
_STEP = 0.6
_SAMPLED = 0.03
_SHORTCUTS = 12


class FreeMotion:
    """Ways of one finger's joints through free space."""

    def __init__(
        self,
        system: ContactSystem,
        joints: IntArray,
        checkpoint: Callable[[], None] = lambda: None,
    ) -> None:
        """Prepare.

        Args:
            system: Compiled problem.
            joints: Indices of the finger's joints.
            checkpoint: Called again and again; may raise to interrupt.
        """
        self._checkpoint = checkpoint
        self._system = system
        self.joints = joints
        self._alone = Clearance(system, joints, alone=True)
        self.columns: IntArray = 3 + joints
        self._clearance = Clearance(system, joints)
        self._lower, self._upper = system.lower[joints], system.upper[joints]

    def way(
        self,
        z: FloatArray,
        left: IntArray,
        end: FloatArray,
        made: IntArray,
        rng: np.random.Generator,
        most: int,
    ) -> FloatArray | None:
        """Find a way.

        Args:
            z: Where the finger begins and everything else stays, shape (3 + n,).
            left: Contacts of the finger at z.
            end: Shape (3 + n,); only the finger's joints may differ from z.
            made: Contacts of the finger there.
            rng: To draw from.
            most: Number of samples after which to give up.

        Returns:
            Configurations to go to one after the other in straight lines, the last of them the
            end, shape (w, 3 + n); None if none was found.
        """
        begin = self._lifted(z, left, rng)
        last = self._lifted(end, made, rng)
        if begin is None or last is None:
            return None
        angles = self._connected(z, begin[self.columns], last[self.columns], rng, most)
        if angles is None:
            return None
        angles = self._shortened(z, angles, rng)
        way = np.tile(z, (len(angles) + 1, 1))
        way[:-1, self.columns] = angles
        way[-1, self.columns] = end[self.columns]
        first = 1 if not len(left) else 0
        return way[first:] if len(made) else np.delete(way, -2, axis=0)[first:]

    def alone(self, z: FloatArray) -> BoolArray:
        """Which configurations, shape (s, 3 + n), keep clear of all but other fingers."""
        return np.asarray(self._alone.distances(z).min(axis=1, initial=np.inf) > _KEPT)

    def _lifted(
        self, z: FloatArray, pairs: IntArray, rng: np.random.Generator
    ) -> FloatArray | None:
        """Where the finger is just off its contacts, by the least motion that leads there."""
        if not len(pairs):
            return z if self._free(z[None])[0] else None
        system = self._system
        rows = gap_gradients(system, system.place(z[None]), pairs)[0][:, self.columns]
        away = np.linalg.lstsq(rows, np.ones(len(pairs)), rcond=1e-6)[0]
        if not (rows @ away > 0.5).all():
            return None
        for turn in range(6):
            sideways = rng.normal(size=len(away)) * 0.5 * np.linalg.norm(away) * min(turn, 1)
            direction = away + sideways
            if not (rows @ direction > 0.3).all():
                continue
            for lift in _LIFTS:
                lifted = z.copy()
                lifted[self.columns] = np.clip(
                    z[self.columns] + lift * direction, self._lower, self._upper
                )
                if self._free(lifted[None])[0]:
                    return lifted
        return None

    def _free(self, z: FloatArray) -> BoolArray:
        """Which configurations, shape (s, 3 + n), keep clear of everything, shape (s,)."""
        return np.asarray(self._clearance.distances(z).min(axis=1, initial=np.inf) > _KEPT)

    def _reached(self, z: FloatArray, begin: FloatArray, end: FloatArray) -> FloatArray:
        """Farthest angles on a straight line from free ones that are free up to there."""
        count = max(1, int(np.ceil(np.abs(end - begin).max() / _SAMPLED)))
        places = np.arange(1, count + 1)[:, None] / count
        samples = np.tile(z, (count, 1))
        samples[:, self.columns] = begin + places * (end - begin)
        free = self._free(samples)
        good = count if free.all() else int(np.argmin(free))
        return samples[good - 1, self.columns] if good else begin

    def _connected(
        self,
        z: FloatArray,
        begin: FloatArray,
        end: FloatArray,
        rng: np.random.Generator,
        most: int,
    ) -> FloatArray | None:
        """Grow two trees of angles until they meet."""
        trees = [begin[None], end[None]]
        parents: list[list[int]] = [[-1], [-1]]

        def extend(side: int, wanted: FloatArray, step: float) -> bool:
            tree = trees[side]
            near = int(np.argmin(np.abs(tree - wanted).max(axis=1)))
            apart = wanted - tree[near]
            length = float(np.abs(apart).max())
            goal = wanted if length <= step else tree[near] + apart * (step / length)
            new = self._reached(z, tree[near], goal)
            if np.abs(new - tree[near]).max() < 1e-9:
                return False
            trees[side] = np.concatenate([tree, new[None]])
            parents[side].append(near)
            return bool(np.array_equal(new, wanted))

        side = 0
        met = extend(0, end, np.inf)
        samples = 0
        while not met and samples < most:
            samples += 1
            self._checkpoint()
            wanted = rng.uniform(self._lower, self._upper)
            extend(side, wanted, _STEP)
            met = extend(1 - side, trees[side][-1], np.inf)
            side = side if met else 1 - side
        if not met:
            return None
        joined = len(trees[0]) - 1, len(trees[1]) - 1
        if np.array_equal(trees[0][-1], end):
            joined = joined[0], 0
        halves = []
        for tree, parent, at in zip(trees, parents, joined, strict=True):
            chain = [at]
            while parent[chain[-1]] >= 0:
                chain.append(parent[chain[-1]])
            halves.append(tree[chain])
        if not np.array_equal(halves[0][0], halves[1][0]):
            return None
        return np.concatenate([halves[0][::-1], halves[1][1:]])

    def _shortened(
        self, z: FloatArray, angles: FloatArray, rng: np.random.Generator
    ) -> FloatArray:
        """Leave out angles between two that a straight line joins."""
        for _ in range(_SHORTCUTS):
            if len(angles) < 3:
                break
            first, last = np.sort(rng.choice(len(angles), size=2, replace=False))
            if last - first < 2:
                continue
            if np.array_equal(self._reached(z, angles[first], angles[last]), angles[last]):
                angles = np.delete(angles, np.arange(first + 1, last), axis=0)
        return angles
