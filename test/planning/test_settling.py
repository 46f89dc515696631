from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planning.pegs import (
    ON_LEFT,
    ON_PEG,
    ON_RIGHT,
    ON_TIP,
    PEG,
    UPRIGHT,
    balanced,
    cradle,
    formation,
    lowest_nearby,
    swing,
    two_fingers,
)

from cfplan_core.contact.detection import touching
from cfplan_core.contact.gaps import gap_gradients
from cfplan_core.contact.system import ContactSystem
from cfplan_core.exploration import _reachable
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import Stability
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.model import Grasp, Problem
from cfplan_core.planning.events import EventKind
from cfplan_core.planning.manifold import settle
from cfplan_core.planning.pieces import Piece, Region
from cfplan_core.planning.roadmap import Roadmap

TIPS = ('object.e2|left.link.v1', 'object.e3|right.link.v1')


def rooted(problem: Problem, *names: str, counts: bool = True) -> tuple[Roadmap, Piece]:
    system = ContactSystem(problem)
    roadmap = Roadmap(system, FrictionlessModel(system.load, counts))
    z, _ = balanced(system, problem.start, *names)
    return roadmap, roadmap.root(z)


def forces(system: ContactSystem, piece: Piece, z: FloatArray) -> FloatArray:
    """Forces of a piece's contacts at z: least squares, three contacts have no other."""
    gradients = gap_gradients(system, system.place(z[None]), piece.formation.array)[0]
    return np.linalg.lstsq(gradients[:, :3].T, -system.load, rcond=None)[0]


def test_square_on_peg_and_tip_is_a_curve_of_second_order() -> None:
    roadmap, piece = rooted(cradle(), ON_PEG, ON_TIP)
    assert piece.stability is Stability.SECOND_ORDER
    assert piece.dimension == 1
    assert piece.formation == formation(roadmap.system, ON_PEG, ON_TIP)


def test_every_configuration_of_the_curve_is_least_in_energy() -> None:
    roadmap, piece = rooted(cradle(), ON_PEG, ON_TIP)
    for z in piece.points[1:-1]:
        assert lowest_nearby(roadmap.system, z, piece.formation.array, 3e-3) > 0.0


def test_curve_ends_where_the_square_meets_a_ledge_on_either_side() -> None:
    roadmap, piece = rooted(cradle(), ON_PEG, ON_TIP)
    system = roadmap.system
    ends = {
        tuple(system.contact_names(touching(system, z, 1e-8).tolist()))
        for z in piece.points[[0, -1]]
    }
    assert ends == {(ON_PEG, ON_RIGHT, ON_TIP), (ON_PEG, ON_LEFT, ON_TIP)}


def test_without_ledges_it_ends_where_the_energy_has_no_minimum_any_more() -> None:
    """On one side: on the other the contact reaches the corner of the square."""
    roadmap, piece = rooted(cradle(()), ON_PEG, ON_TIP)
    margins = roadmap.tracer.margins(piece.formation, piece.points).stable
    assert roadmap.failures[EventKind.UNSTABLE.value] == 1
    assert sorted(margins[[0, -1]] < 1e-5) == [False, True]
    assert margins.min() > 0.0


def test_the_end_without_a_minimum_is_a_turning_point_of_the_joint() -> None:
    """Where the curvature vanishes the joint comes to a stand along the equilibria."""
    _, piece = rooted(cradle(()), ON_PEG, ON_TIP)
    points = piece.points if piece.points[-1, 2] < piece.points[0, 2] else piece.points[::-1]
    steps = np.diff(points[-6:], axis=0)
    slopes = np.abs(steps[:, 3] / steps[:, 2])
    assert (np.diff(slopes) < 0.0).all()
    assert slopes[-1] < 0.15 * slopes[0]


@pytest.mark.parametrize('side', [ON_LEFT, ON_RIGHT])
def test_third_contact_carries_nothing_where_it_lets_go_and_more_behind(side: str) -> None:
    roadmap, piece = rooted(cradle(), ON_PEG, ON_TIP)
    system = roadmap.system
    third = system.pair(system.contact(formation(system, side).pairs[0]))
    ((z, other),) = [
        (z, other) for z, other in roadmap.settling.beside(piece) if third in other.formation
    ]
    assert other.stability is Stability.FORCE_CLOSURE
    slot = other.formation.pairs.index(third)
    assert abs(forces(system, other, z)[slot]) < 1e-9
    order = slice(None) if np.abs(other.points[0] - z).max() < 1e-6 else slice(None, None, -1)
    pressing = [forces(system, other, point)[slot] for point in other.points[order]]
    assert (np.diff(pressing) > 0.0).all()
    assert pressing[1] > 1e-6


def test_contacts_settle_and_come_back_between_the_same_pieces() -> None:
    roadmap, piece = rooted(cradle(), ON_PEG, ON_TIP)
    for z, other in roadmap.settling.beside(piece):
        back = [(at, found) for at, found in roadmap.settling.beside(other) if found is piece]
        assert back
        assert min(np.abs(at - z).max() for at, _ in back) < 1e-6


def test_end_of_stability_is_found_from_the_side_of_three_contacts() -> None:
    """A roadmap that begins there, and never saw the two contacts alone."""
    first, piece = rooted(cradle(), ON_PEG, ON_TIP)
    for z, other in first.settling.beside(piece):
        roadmap = Roadmap(first.system, first.model)
        root = roadmap.root(other.points[len(other.points) // 2])
        found = {
            neighbour.formation: at
            for at, neighbour in roadmap.settling.beside(root)
            if neighbour.stability is Stability.SECOND_ORDER
        }
        np.testing.assert_allclose(found[piece.formation], z, atol=1e-7)


def test_object_does_not_settle_onto_two_contacts_that_would_drop_it() -> None:
    """The peg and the tip are so near that the square topples once it leaves the ledge."""
    problem = cradle()
    peg = [(x + 0.006, y) for x, y in PEG]
    hand = replace(problem.hand, palm=(peg, *problem.hand.palm[1:]))
    system = ContactSystem(replace(problem, hand=hand))
    roadmap = Roadmap(system, FrictionlessModel(system.load))
    leaning = formation(system, ON_PEG, ON_LEFT, ON_TIP)
    start = system.configuration(Grasp((0.001, 0.011, 0.12), (UPRIGHT,)))
    piece = roadmap.root(settle(system, start, leaning.array))
    assert piece.stability is Stability.FORCE_CLOSURE
    z = roadmap.settling.locate(leaning, piece.points[-1])
    assert z is not None
    pairs = formation(system, ON_PEG, ON_TIP).array
    assert lowest_nearby(system, z, pairs, 3e-3) < 0.0
    assert roadmap.settling.ways(z) == []
    assert roadmap.settling.beside(piece) == []


def test_two_contacts_pass_a_seam_of_the_edge_that_they_slide_on() -> None:
    """What one slope lets the bar do, two slopes in line do in two parts."""
    on_link = 'object.v2|wall.link.e2'
    _, whole = rooted(swing(), 'object.v0|palm.0.e3', on_link)
    roadmap, outer = rooted(swing(seam=0.029), 'object.v0|palm.1.e3', on_link)
    system = roadmap.system
    inner_formation = formation(system, 'object.v0|palm.0.e3', on_link)
    ((seam, inner),) = [
        (z, found)
        for z, found in roadmap.settling.beside(outer)
        if found.formation == inner_formation
    ]
    assert inner.stability is Stability.SECOND_ORDER
    corner = system.place(seam[None]).vertices[0, 0] * system.size
    assert abs(corner - (-0.029 + 0.029j)) < 1e-9
    assert any(found is outer for _, found in roadmap.settling.beside(inner))
    parts = [*inner.points[:, 3], *outer.points[:, 3]]
    assert min(parts) == pytest.approx(whole.points[:, 3].min(), abs=1e-6)
    assert max(parts) == pytest.approx(whole.points[:, 3].max(), abs=1e-6)


def test_way_that_is_dropped_is_not_offered_again_on_either_side() -> None:
    problem = two_fingers()
    roadmap, piece = rooted(problem, *TIPS)
    assert isinstance(piece, Region)
    z, other = roadmap.settling.beside(piece)[0]
    roadmap.regions.drop(piece, z)
    for one in (piece, other):
        places = [at for at, found in roadmap.settling.beside(one) if found in (piece, other)]
        assert all(np.abs(at - z).max() > 1e-6 for at in places)


def test_nothing_settles_where_second_order_does_not_count() -> None:
    roadmap, piece = rooted(cradle(), ON_PEG, ON_TIP)
    other = next(found for _, found in roadmap.settling.beside(piece))
    middle = other.points[len(other.points) // 2]
    strict = Roadmap(roadmap.system, FrictionlessModel(roadmap.system.load, second_order=False))
    assert strict.settling.beside(strict.root(middle)) == []


@pytest.mark.parametrize('resolution', [0.05, None], ids=['sheets', 'rays'])
def test_square_on_two_fingers_is_a_region_of_second_order(resolution: float | None) -> None:
    problem = two_fingers()
    system = ContactSystem(problem)
    roadmap = Roadmap(system, FrictionlessModel(system.load), resolution=resolution)
    z, pairs = balanced(system, problem.start, *TIPS)
    piece = roadmap.root(z)
    assert (piece.stability, piece.dimension) == (Stability.SECOND_ORDER, 2)
    around = [*roadmap.neighbours(piece), *roadmap.settling.beside(piece)]
    assert around
    assert all(other.formation != piece.formation for _, other in around)
    for at, _ in around[::5]:
        path = piece.path(z, at)
        assert lowest_nearby(system, path[len(path) // 2], pairs, 3e-3) > 0.0


def test_sheet_reaches_as_far_in_the_joints_as_the_closed_form() -> None:
    """Upright and symmetric the pegs may come as near as half the half diagonal."""
    problem = two_fingers(())
    system = ContactSystem(problem)
    roadmap = Roadmap(system, FrictionlessModel(system.load))
    z, _ = balanced(system, problem.start, *TIPS)
    piece = roadmap.root(z)
    for point in np.array(piece.vertices):  # type: ignore[attr-defined]
        placed = system.place(point[None])
        tips = placed.vertices[0, system.pair_vertex[list(piece.formation.pairs)]] * system.size
        if abs(point[2]) < 0.02:
            assert abs(tips[0] - tips[1]) > 0.0099


def test_everything_that_is_reached_holds_the_object() -> None:
    roadmap, piece = rooted(cradle(), ON_PEG, ON_TIP)
    graph = _reachable(roadmap, piece)
    for index in graph:
        found = roadmap.pieces[index]
        for z in found.points[1:-1]:
            assert forces(roadmap.system, found, z).min() > 0.0
            assert lowest_nearby(roadmap.system, z, found.formation.array, 3e-3) > 0.0
