"""Trees that meet inside a formation, and what that shows of its pieces."""

from __future__ import annotations

from collections import Counter
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from cfplan_core import load_problem
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.gaps import gaps
from cfplan_core.contact.system import ContactSystem
from cfplan_core.mechanics.contact_model import Stability
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.planning.drives import ToConfiguration
from cfplan_core.planning.grasp_check import examine_problem
from cfplan_core.planning.joining import Joining, SamePieces
from cfplan_core.planning.milestones import Milestone
from cfplan_core.planning.pieces import Region
from cfplan_core.planning.pushing import Pusher
from cfplan_core.planning.tracing import Tracer
from cfplan_core.planning.transitions import surroundings

PATH = (
    Path(__file__).parents[2]
    / 'config'
    / 'problems'
    / 'many_joints'
    / 'two_fingers_three_joints.yaml'
)


@cache
def tracer() -> Tracer:
    system = ContactSystem(load_problem(PATH))
    return Tracer(system, FrictionlessModel(system.load))


class Named:
    """Names every motion's region anew unless it is known."""

    def __init__(self) -> None:
        self.regions: list[Region] = []

    def __call__(self, known: list[Region], formation: Formation, stability: Stability) -> Region:
        for region in known:
            if region.formation == formation and region.stability is stability:
                return region
        region = Region(
            len(self.regions), formation, stability, 2, np.zeros((1, tracer().system.dof)), (), []
        )
        self.regions.append(region)
        return region


def pushed(pusher: Pusher, root: Milestone, seed: int) -> Milestone:
    """A milestone that a random push of all joints leads to, with the contacts of its root."""
    rng = np.random.default_rng(seed)
    weights = np.ones(tracer().system.dof)
    while True:
        wanted = root.z + rng.normal(size=len(root.z)) * 0.3
        drive = ToConfiguration(wanted, weights, frozenset())
        reached = next(pusher.push(root, drive, True, 1), None)
        if reached is not None and len(reached.stretches[0].formation) == len(root.around.pairs):
            return reached


@pytest.mark.parametrize('seed', range(3))
def test_motions_inside_one_formation_are_joined(seed: int) -> None:
    system = tracer().system
    start = examine_problem(system, tracer().model).start
    assert start is not None
    named = Named()
    pusher = Pusher(tracer(), Counter(), named)
    roots = []
    for _ in range(2):
        # Nothing is known of what both roots lie in.
        roots.append(Milestone(start.z, surroundings(system, start.z), None, ()))
    far = pushed(pusher, roots[1], 10 + seed)
    other_root = Milestone(far.z, far.around, None, ())
    new, other = pushed(pusher, roots[0], seed), pushed(pusher, other_root, 20 + seed)
    joining = Joining(tracer(), named, seed)
    joining.add(1, other)
    joined = joining.join(0, new)
    assert joined is not None
    milestone, there = joined
    assert there is other
    np.testing.assert_array_equal(milestone.z, other.z)
    assert milestone.parent is roots[0]
    points = np.concatenate([stretch.points for stretch in milestone.stretches])
    np.testing.assert_array_equal(points[0], roots[0].z)
    np.testing.assert_array_equal(points[-1], other.z)
    formation = milestone.stretches[0].formation
    assert np.abs(gaps(system, system.place(points), formation.array).gap).max() < 1e-9
    assert (tracer().margins(formation, points).stable > 0.0).all()
    assert joining.same.of(new.stretches[0].region) is joining.same.of(other.stretches[0].region)


def test_other_formations_are_not_joined() -> None:
    system = tracer().system
    start = examine_problem(system, tracer().model).start
    assert start is not None
    named = Named()
    root = Milestone(start.z, surroundings(system, start.z), None, ())
    new = pushed(Pusher(tracer(), Counter(), named), root, 0)
    assert Joining(tracer(), named).join(0, new) is None


def test_pieces_known_to_be_one_are_told_from_those_not_known_to_be() -> None:
    named = Named()
    one, two, three, four = (
        named([], Formation((0, 1, 2)), Stability.FORCE_CLOSURE) for _ in range(4)
    )
    same = SamePieces()
    same.unite(three, two)
    same.unite(three, four)
    assert same.of(four) is two
    assert same.of(three) is two
    assert same.of(one) is one
    same.unite(four, one)
    assert {same.of(region).index for region in (one, two, three, four)} == {0}
