"""Search in contact formations of any dimension: two trees of configurations, pushed on purpose.

Hands with many joints have contact formations of many dimensions, of which no complete picture can
be drawn. Two trees grow from the start and the goal. In turns a tree is pushed from one of its
configurations along a drive: towards the other tree, towards its object's pose alone, to put a
free link onto the object, to move single joints or whole fingers, to hold the object better. As
motion is reversible the trees join where a push from one reaches a configuration of the other.

The choice of drives is drawn from a generator with a fixed seed: same problem, same answer.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise

import numpy as np

from cfplan_core.contact.detection import touching
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.system import IntArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import Stability
from cfplan_core.planning.drives import Drive, ToConfiguration
from cfplan_core.planning.force_drive import ToForce
from cfplan_core.planning.goal_contacts import contact_drive
from cfplan_core.planning.goal_test import GoalTest
from cfplan_core.planning.joining import Joining, SamePieces
from cfplan_core.planning.milestones import Growth, Milestone, Stretch
from cfplan_core.planning.pieces import Region
from cfplan_core.planning.placing import placements
from cfplan_core.planning.pushing import Pusher
from cfplan_core.planning.regrasping import Regrasping
from cfplan_core.planning.roadmap import Roadmap
from cfplan_core.planning.search import Leg, Node, Tree
from cfplan_core.planning.tracing import classify
from cfplan_core.planning.transitions import TOUCH, surroundings

# How much a joint counts beside the object's pose where distances are compared.
_JOINT = 0.1
# How much farther away a configuration counts for every push from it.
_TRIED = 0.15
# Joined if a push ends this near to a configuration of the other tree.
_MET = 1e-7
# Drives, for each joint, after which the search begins anew with other luck, and how many more
# those are next time.
_PATIENCE = 60.0
_GROWTH_OF_PATIENCE = 1.5
# Poses of the object, in radians and object sizes, that count as the same.
_SAME_POSE = 1e-8
# Part of the drives to a pose that are to an angle alone.
_TURNS = 0.5
# Fingers are moved one by one where the object's poses differ by no more than this.
_GAIT = 0.5
# How much farther away a configuration counts for every body that touches in one only.
_OTHER_BODY = 0.15


# Detours of a path that are looked for a shorter way.
_MOST_SHORTCUTS = 60

Motion = Sequence[tuple[Stretch, FloatArray]]
# A configuration of a path, and the motion that leads to it from the one before.
Stop = tuple[Milestone, Motion]


class Expedition:
    """Two trees of configurations; only the initial one if the goal is not a whole grasp.

    Attributes:
        trees: The initial and the goal tree of contact formations.
        meeting: Index of the piece where they joined or the goal was found, or None.
        drives: How many drives were pushed along.
    """

    def __init__(
        self,
        roadmap: Roadmap,
        start: FloatArray,
        goal: FloatArray | GoalTest,
        grown: Callable[[int, int], None] = lambda initial, goal: None,
        seed: int | Sequence[int] = 0,
        most_drives: int = 20000,
    ) -> None:
        """Root the trees.

        Args:
            roadmap: Counts what is found.
            start: Stable configuration, shape (3 + n,).
            goal: Stable configuration, shape (3 + n,), or a test for one.
            grown: Called with the trees' numbers of nodes before one is added; may raise.
            seed: Of the generator that drives are drawn from.
            most_drives: After so many the search gives up.
        """
        self._roadmap = roadmap
        self._system = roadmap.system
        self._grown = grown
        self._rng = np.random.default_rng(seed)
        self._most_drives = most_drives
        self.drives = 0
        self._test = goal if isinstance(goal, GoalTest) else None
        refusal = roadmap.constraints.refusal
        self._pusher = Pusher(roadmap.tracer, roadmap.failures, self._region_of, refusal)
        self._regrasping = Regrasping(
            self._system,
            roadmap.model,
            self._pusher,
            start,
            start if isinstance(goal, GoalTest) else goal,
            self._rng,
            roadmap.tracer.checkpoint,
        )
        self._roots = [start] if isinstance(goal, GoalTest) else [start, goal]
        self._seed = seed
        self._growths: list[Growth] = []
        self._begin()
        self._met: tuple[Milestone, Milestone] | None = None
        self._scale = np.ones(self._system.dof)
        self._scale[3:] = _JOINT

    def _begin(self) -> None:
        """Begin with trees of one configuration."""
        self._joining = Joining(self._roadmap.tracer, self._region_of, self._seed)
        self._growths = [Growth() for _ in self._roots]
        for growth, root in zip(self._growths, self._roots, strict=True):
            milestone = Milestone(root, surroundings(self._system, root), None, ())
            growth.add(milestone, self._bodies(milestone))

    @property
    def trees(self) -> tuple[Tree, Tree]:
        """The CF-trees, for pictures and statistics."""
        same = self._joining.same
        trees = [_cf_tree(growth, same) for growth in self._growths]
        if len(trees) < 2:
            trees.append(Tree(trees[0].root))
        if self._met is not None and self.meeting is not None:
            last = self._roadmap.pieces[self.meeting]
            if last.index not in trees[1].index_of:
                trees[1].add(Node(last, 0 if trees[1].nodes else None, self._met[0].z, 1))
        return trees[0], trees[1]

    @property
    def meeting(self) -> int | None:
        """See the class; a piece that the initial tree reached last."""
        if self._met is None or not self._met[0].stretches:
            return None
        return self._joining.same.of(self._met[0].stretches[-1].region).index

    def run(self) -> bool:
        """Grow until the trees meet (true) or the drives are used up (false)."""
        if self._arrived(0, self._growths[0].milestones[0]):
            return True
        turn = 0
        patience = _PATIENCE * self._system.joint_count
        restart = patience
        while self._met is None and self.drives < self._most_drives:
            if self.drives >= restart:
                patience *= _GROWTH_OF_PATIENCE
                restart = self.drives + patience
                self._begin()
            side = turn % len(self._growths)
            turn += 1
            growth = self._growths[side]
            begin, drive, on_edges = self._choose(side)
            begin.tries += 1
            for reached in self._push(begin, drive, on_edges):
                self._add(side, reached)
                if self._arrived(side, reached):
                    return True
            newest = growth.milestones[-1]
            if newest is not begin and self._connect(side, newest):
                return True
        return self._met is not None

    def _push(self, begin: Milestone, drive: Drive, on_edges: bool) -> Iterator[Milestone]:
        self.drives += 1
        yield from self._pusher.push(begin, drive, on_edges)
        self._roadmap.attempts = self._pusher.attempts

    def _add(self, side: int, reached: Milestone) -> None:
        counts = [len(growth.milestones) for growth in self._growths] + [0]
        counts[side] += 1
        self._grown(counts[0], counts[1])
        self._growths[side].add(reached, self._bodies(reached))
        self._joining.add(side, reached)

    def _bodies(self, milestone: Milestone) -> tuple[int, ...]:
        """Bodies of the hand that touch the object."""
        return tuple(sorted(set(self._system.pair_body[milestone.around.pairs].tolist())))

    def _arrived(self, side: int, reached: Milestone) -> bool:
        """Tell whether a configuration fulfils the goal or is one of the other tree."""
        if self._test is not None:
            if self._test.fits(reached.z) and self._test.has_contacts(reached.around.pairs):
                self._met = (reached, reached)
                return True
            return False
        other = self._growths[1 - side]
        off = np.abs(other.table - reached.z).max(axis=1)
        nearest = int(np.argmin(off))
        if off[nearest] <= _MET:
            pair = (reached, other.milestones[nearest])
        else:
            joined = self._joining.join(side, reached)
            if joined is None:
                return False
            self._add(side, joined[0])
            pair = joined
        self._met = pair if side == 0 else (pair[1], pair[0])
        return True

    def _connect(self, side: int, new: Milestone) -> bool:
        """Go from a new configuration to one of the other tree, all the way."""
        if len(self._growths) < 2:
            return False
        target = self._partner(side, new)
        at = new
        drives: list[Drive] = self._gait(target)
        if not self._regrasping.useful:
            drives.insert(0, self._towards(target))
        for drive in drives:
            on_edges = bool(self._rng.random() < 0.5)
            for reached in self._push(at, drive, on_edges):
                self._add(side, reached)
                if self._arrived(side, reached):
                    return True
                at = reached
            if float(np.abs(at.z - target.z)[:3].max()) > _GAIT:
                break
            if float(np.abs(at.z - target.z)[:3].max()) < _SAME_POSE:
                return self._regrasp(side, at, target)
        return False

    def _regrasp(self, side: int, begin: Milestone, target: Milestone) -> bool:
        """Change the fingers' places to those of a configuration of the other tree."""
        chain, _ = self._regrasping.join(begin, target)
        for reached in chain:
            self._add(side, reached)
        return bool(chain) and self._arrived(side, chain[-1])

    def _partner(self, side: int, new: Milestone) -> Milestone:
        """Configuration of the other tree that a new one may be joined to most easily."""
        other = self._growths[1 - side]
        off = np.linalg.norm((other.table - new.z) * self._scale, axis=1)
        off += self._mismatch(other, self._bodies(new))
        return other.milestones[int(np.argmin(off))]

    def _mismatch(self, growth: Growth, bodies: tuple[int, ...]) -> FloatArray:
        """How much farther away milestones, shape (m,), count as other bodies touch there."""
        far = np.empty(len(growth.milestones))
        for others, indices in growth.by_bodies.items():
            far[indices] = _OTHER_BODY * len(set(others) ^ set(bodies))
        return far

    def _gait(self, target: Milestone) -> list[Drive]:
        """Drives to a configuration one after the other: the object, each finger, all."""
        system = self._system
        pairs = frozenset(int(pair) for pair in target.around.pairs)
        drives: list[Drive] = [ToConfiguration(target.z, _pose_weights(system.dof), pairs)]
        fingers = self._fingers()
        for finger in self._rng.permutation(len(fingers)):
            weights = _pose_weights(system.dof)
            weights[fingers[int(finger)]] = 1.0
            drives.append(ToConfiguration(target.z, weights, pairs))
        return [*drives, self._towards(target)]

    def _towards(self, target: Milestone) -> ToConfiguration:
        weights = np.ones(self._system.dof)
        weights[3:] = 0.3
        return ToConfiguration(
            target.z, weights, frozenset(int(pair) for pair in target.around.pairs)
        )

    def _choose(self, side: int) -> tuple[Milestone, Drive, bool]:
        """Draw a configuration of a tree and a drive from it."""
        rng = self._rng
        growth = self._growths[side]
        on_edges = bool(rng.random() < 0.5)
        free = None if rng.random() < 0.5 else frozenset[int]()
        kind = rng.random()
        system = self._system
        if kind < 0.35:
            if len(self._growths) > 1:
                other = self._growths[1 - side]
                number = 0 if rng.random() < 0.5 else int(rng.integers(len(other.milestones)))
                target = other.milestones[number]
                begin = self._nearest(growth, target.z, self._scale)
                if kind < 0.15:
                    return begin, self._towards(target), on_edges
                wanted = target.z
            else:
                assert self._test is not None
                wanted = np.zeros(system.dof)
                wanted[self._test.region.columns] = self._test.region.wanted
                weights = np.zeros(system.dof)
                weights[self._test.region.columns] = 1.0
                begin = self._nearest(growth, wanted, weights * self._scale)
                if kind < 0.25 or not self._test.region.count:
                    contact = contact_drive(system, self._test, begin, rng)
                    if contact is not None:
                        return begin, contact, True
                return begin, ToConfiguration(wanted, weights, free), on_edges
            return begin, ToConfiguration(wanted, _pose_weights(system.dof), free), on_edges
        begin = self._promising(side)
        if kind < 0.5:
            wanted = begin.z.copy()
            roots = [growth.table[0] for growth in self._growths]
            between = roots[0] + rng.random() * (roots[-1] - roots[0])
            wanted[:3] = between[:3] + rng.normal(size=3) * [0.2, 0.2, 0.3]
            weights = _pose_weights(system.dof)
            if rng.random() < _TURNS:
                weights[:2] = 0.0
            begin = self._nearest(growth, wanted, weights)
            return begin, ToConfiguration(wanted, weights, free), on_edges
        if kind < 0.8:
            drive = placements(system, begin, rng)
            if drive is not None:
                return begin, drive, True
            if len(begin.around.pairs) > 2:
                return begin, self._unloading(begin), True
        wanted = begin.z.copy()
        fingers = self._fingers()
        columns = fingers[int(rng.integers(len(fingers)))]
        if rng.random() < 0.4:
            columns = columns[[int(rng.integers(len(columns)))]]
        wanted[columns] += rng.normal(size=len(columns)) * 0.6
        wanted[3:] = np.clip(wanted[3:], system.lower, system.upper)
        weights = np.zeros(system.dof)
        weights[columns] = 1.0
        if rng.random() < 0.5:
            weights[:3] = 1.0
        return begin, ToConfiguration(wanted, weights, free), on_edges

    def _unloading(self, begin: Milestone) -> ToForce:
        """Draw a contact that touches, to be let go, from one where no link is free to touch."""
        pairs = tuple(int(pair) for pair in begin.around.pairs)
        pair = pairs[int(self._rng.integers(len(pairs)))]
        system, model = self._system, self._roadmap.model
        return ToForce(system, model, system.load, Formation(pairs), pair)

    def _fingers(self) -> list[IntArray]:
        """Columns of z of each finger's joints; not of fingers all of whose joints are held."""
        return [3 + joints for joints in self._system.finger_joints if len(joints)]

    def _nearest(self, growth: Growth, wanted: FloatArray, scale: FloatArray) -> Milestone:
        off = np.linalg.norm((growth.table - wanted) * scale, axis=1)
        tries = np.array([milestone.tries for milestone in growth.milestones])
        return growth.milestones[int(np.argmin(off + _TRIED * tries))]

    def _promising(self, side: int) -> Milestone:
        """Draw a configuration, rather one near the other tree's root and seldom tried."""
        growth = self._growths[side]
        if len(self._growths) > 1:
            wanted, scale = self._growths[1 - side].table[0], self._scale
        else:
            assert self._test is not None
            wanted, scale = np.zeros(self._system.dof), np.zeros(self._system.dof)
            wanted[self._test.region.columns] = self._test.region.wanted
            scale[self._test.region.columns] = 1.0
        kinds = list(growth.by_bodies.values())
        chosen = kinds[int(self._rng.integers(len(kinds)))]
        off = np.linalg.norm((growth.table[chosen] - wanted) * scale, axis=1)
        off += _TRIED * np.array([growth.milestones[index].tries for index in chosen])
        order = np.argsort(off, kind='stable')
        rank = min(int(self._rng.exponential(0.15 * len(order))), len(order) - 1)
        return growth.milestones[chosen[int(order[rank])]]

    def _region_of(
        self, known: list[Region], formation: Formation, stability: Stability
    ) -> Region:
        for region in known:
            if region.formation == formation and region.stability is stability:
                return region
        roadmap = self._roadmap
        anchor = np.zeros((1, self._system.dof))
        region = Region(len(roadmap.pieces), formation, stability, 2, anchor, (), [])
        roadmap.pieces.append(region)
        known.append(region)
        return region

    def path(self, shorten: bool = True) -> list[Leg]:
        """Legs from start to goal; only after `run` returned true.

        Args:
            shorten: False to leave detours as they are.
        """
        assert self._met is not None
        initial = Growth.chain(self._met[0])
        stops: list[Stop] = [(initial[0], ())]
        stops += [(stop, _forwards(stop)) for stop in initial[1:]]
        if self._test is None:
            goal = Growth.chain(self._met[1])[::-1]
            for before, stop in pairwise(goal):
                stops.append((stop, _backwards(before)))
        stops = self._shortened(stops) if shorten else stops
        pieces = [piece for _, motion in stops for piece in motion]
        return self._legs(pieces)

    def _shortened(self, stops: list[Stop]) -> list[Stop]:
        """Replace detours by pushes from a stop of a path straight to a later one."""
        pushes = 0
        first = 0
        while first < len(stops) - 2:
            for last in range(len(stops) - 1, first + 1, -1):
                if pushes == _MOST_SHORTCUTS:
                    return stops
                way = stops[first + 1 : last + 1]
                begin, end = stops[first][0], stops[last][0]
                if _length(way) < 1.2 * float(np.abs(end.z - begin.z).max()):
                    continue
                pushes += 1
                *inner, arrived = [begin, *self._pusher.push(begin, self._towards(end), True)]
                if not inner or np.abs(arrived.z - end.z).max() > _MET:
                    continue
                found: list[Stop] = [(stop, _forwards(stop)) for stop in (*inner[1:], arrived)]
                found[-1] = (end, found[-1][1])
                if _length(found) < 0.95 * _length(way):
                    stops = [*stops[: first + 1], *found, *stops[last + 1 :]]
                    break
            first += 1
        return stops

    def _legs(self, pieces: list[tuple[Stretch, FloatArray]]) -> list[Leg]:
        """Make successive motions share their point, and one of those where nothing happens."""
        if not pieces:
            root = self._growths[0].milestones[0]
            formation = Formation(tuple(int(pair) for pair in root.around.pairs))
            stability = classify(self._roadmap.model.margins(root.around.gradients[None]))
            region = self._region_of(root.entered, formation, stability)
            return [Leg(region.index, formation, stability, root.z[None])]
        legs: list[Leg] = []
        for stretch, points in pieces:
            if legs:
                before = legs[-1]
                points = np.concatenate([before.points[-1:], points[1:]])
                alike = before.formation == stretch.formation
                alike = alike and before.stability is stretch.stability
                touched = tuple(touching(self._system, points[0], TOUCH).tolist())
                if alike and touched == stretch.formation.pairs:
                    points = np.concatenate([before.points, points[1:]])
                    legs.pop()
            region = stretch.region
            legs.append(Leg(region.index, stretch.formation, stretch.stability, points))
        return legs


def _pose_weights(dof: int) -> FloatArray:
    """Weights, shape (3 + n,), of the object's pose alone."""
    weights = np.zeros(dof)
    weights[:3] = 1.0
    return weights


def _forwards(stop: Milestone) -> Motion:
    """Motion to a milestone from its parent."""
    return [(stretch, stretch.points) for stretch in stop.stretches]


def _backwards(stop: Milestone) -> Motion:
    """Motion from a milestone to its parent."""
    return [(stretch, stretch.points[::-1]) for stretch in reversed(stop.stretches)]


def _length(stops: Sequence[Stop]) -> float:
    """Length of the motions to stops, in radians and object sizes."""
    return sum(
        float(np.abs(np.diff(points, axis=0)).max(axis=1).sum())
        for _, motion in stops
        for _, points in motion
    )


def _cf_tree(growth: Growth, same: SamePieces) -> Tree:
    """Regions of a tree in the order of discovery, each below that it was entered from."""
    root = growth.milestones[0]
    tree = Tree(root.z)
    for milestone in growth.milestones[1:]:
        assert milestone.parent is not None
        above = (
            same.of(milestone.parent.stretches[-1].region) if milestone.parent.stretches else None
        )
        for stretch in milestone.stretches:
            region = same.of(stretch.region)
            if region.index not in tree.index_of:
                parent = tree.index_of.get(above.index) if above is not None else None
                if parent is None and tree.nodes:
                    parent = 0
                depth = 0 if parent is None else tree.nodes[parent].depth + 1
                entry = None if parent is None else stretch.points[0]
                tree.add(Node(region, parent, entry, depth))
            above = region
    return tree
