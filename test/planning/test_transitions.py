from __future__ import annotations

from collections import Counter
from itertools import combinations

import numpy as np
import pytest
from planning.scenes import FEET, TIPS, at, pushed_angles, pushed_block
from random_problems import explore, random_problem
from scipy.optimize import linprog

from cfplan_core.contact.detection import touching
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.gaps import gap_gradients
from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.geometry.separation import penetration_depth
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.planning.manifold import independent_rows, project, tangent_basis
from cfplan_core.planning.transitions import Departure, departures, surroundings

# Its corner, vertex 2, stops the block's left side at x = -0.003, lower than both tips.
WALL = [(-0.03, 0.004), (-0.025, 0.004), (-0.023, 0.007), (-0.025, 0.01), (-0.03, 0.01)]
WALL_CONTACT = 'object.e3|palm.1.v2'
NUDGE = 1e-4


def leave(system: ContactSystem, z: FloatArray) -> tuple[list[Departure], Counter[str]]:
    failures: Counter[str] = Counter()
    model = FrictionlessModel(system.load)
    return departures(surroundings(system, z), model, failures), failures


def at_the_wall() -> tuple[ContactSystem, FloatArray]:
    system = ContactSystem(pushed_block(palms=[WALL]))
    return system, at(system, -0.003, pushed_angles(-0.003))


def rates(system: ContactSystem, z: FloatArray, departure: Departure) -> dict[str, float]:
    """Rate of the gap of every touching contact, by name."""
    pairs = touching(system, z, 1e-8)
    gradients = gap_gradients(system, system.place(z[None]), pairs)[0]
    values = gradients @ departure.direction
    return dict(zip(system.contact_names(pairs.tolist()), values.tolist(), strict=True))


def test_surroundings_of_a_block_at_a_wall_are_five_contacts() -> None:
    system, z = at_the_wall()
    around = surroundings(system, z)
    assert system.contact_names(around.pairs.tolist()) == (
        *FEET,
        WALL_CONTACT,
        *TIPS,
    )
    assert not around.held_vertex
    assert not around.at_end.any()


def test_surroundings_of_a_fingertip_at_a_corner_hold_a_vertex() -> None:
    """The left tip is as high as the block where the squares of x + 0.04 and 0.035 give 0.05²."""
    system = ContactSystem(pushed_block(height=0.035))
    x = np.sqrt(0.05**2 - 0.035**2) - 0.04
    around = surroundings(system, at(system, x, pushed_angles(x)))
    assert around.held_vertex
    names = system.contact_names(around.pairs.tolist())
    assert TIPS[0] in names
    at_end = {name for name, end in zip(names, around.at_end, strict=True) if end}
    assert at_end == {name for name in names if 'left' in name}
    assert len(at_end) >= 2


def test_block_leaves_a_wall_by_sliding_off_it_or_by_tipping() -> None:
    """By hand: which of the five contacts may open, with the others holding the block.

    Held against the wall by the right tip it needs no left tip, held between the tips no wall, and
    as the right tip is between the wall and the left tip it stands on either foot alone. Without
    the right tip nothing pushes it to the left.
    """
    system, z = at_the_wall()
    found, _ = leave(system, z)
    opened = [system.contact_names(list(way.departing)) for way in found]
    assert sorted(opened) == sorted([(WALL_CONTACT,), (TIPS[0],), (FEET[0],), (FEET[1],)])


@pytest.mark.parametrize(
    ('opened', 'x', 'angle'),
    [(WALL_CONTACT, 1, 0), (TIPS[0], 0, 0), (FEET[0], 1, -1), (FEET[1], -1, 1)],
)
def test_block_at_a_wall_moves_to_where_the_contact_opens(opened: str, x: int, angle: int) -> None:
    """Away from the wall without turning; or over its right foot clockwise, and likewise."""
    system, z = at_the_wall()
    ways = [
        way for way in leave(system, z)[0] if opened in system.contact_names(list(way.departing))
    ]
    (direction,) = (way.direction for way in ways)
    moves = np.where(np.abs(direction) < 1e-12, 0.0, np.sign(direction))
    assert (moves[0], moves[2]) == (x, angle)


def test_gaps_of_kept_contacts_stay_and_the_others_open() -> None:
    system, z = at_the_wall()
    for way in leave(system, z)[0]:
        kept = set(system.contact_names(way.formation.pairs))
        for name, rate in rates(system, z, way).items():
            assert abs(rate) < 1e-12 if name in kept else rate > 1e-6


def test_direction_is_a_unit_tangent() -> None:
    system, z = at_the_wall()
    found, _ = leave(system, z)
    assert found
    for way in found:
        assert np.linalg.norm(way.direction) == pytest.approx(1.0)
        gradients = gap_gradients(system, system.place(z[None]), way.formation.array)[0]
        np.testing.assert_allclose(gradients @ way.direction, 0.0, atol=1e-12)


def test_failed_ways_are_counted_by_reason() -> None:
    """Sliding into the wall penetrates; without the right tip the block is not held."""
    system, z = at_the_wall()
    _, failures = leave(system, z)
    assert failures['a contact would penetrate'] >= 2
    assert failures['unstable contact formation'] >= 1


def test_redundant_contacts_are_left_together_with_the_others() -> None:
    """Beside a second palm, flush with the first, both of its contacts are kept as well."""
    step = [(0.01, -0.1), (0.5, -0.1), (0.5, 0.0), (0.01, 0.0)]
    system = ContactSystem(pushed_block(palms=[step, WALL]))
    z = at(system, -0.003, pushed_angles(-0.003))
    found, _ = leave(system, z)
    sliding = [
        set(system.contact_names(way.formation.pairs))
        for way in found
        if way.direction[0] > 0.1 and abs(way.direction[2]) < 1e-9
    ]
    assert sliding == [{*FEET, *TIPS, 'object.v1|palm.1.e2', 'object.e0|palm.1.v3'}]


def holds(wrenches: FloatArray, load: FloatArray) -> bool:
    """Tell by linear programming whether all contact forces can be positive, and span."""
    count = len(wrenches)
    found = linprog(
        [*np.zeros(count), -1.0],
        A_ub=np.hstack([-np.eye(count), np.ones((count, 1))]),
        b_ub=np.zeros(count),
        A_eq=np.hstack([wrenches.T, np.zeros((3, 1))]),
        b_eq=-load,
        bounds=[(0.0, None)] * count + [(None, 1.0)],
    )
    spans = np.linalg.matrix_rank(wrenches, tol=1e-7) == 3
    return bool(spans and found.x is not None and found.x[-1] > 1e-7)


def overlap(system: ContactSystem, z: FloatArray) -> float:
    """Deepest overlap of any two bodies that may not overlap, m."""
    (pose,) = system.object_poses(z[None])
    outline = system.problem.object.world_vertices(pose)
    bodies = system.problem.hand.world_vertices(z[3:])
    links = [vertices for name, vertices in bodies.items() if 'link' in name]
    return max(
        *(penetration_depth(outline, vertices) for vertices in bodies.values()),
        penetration_depth(links[0], links[1]),
    )


def ways_by_trial(system: ContactSystem, z: FloatArray) -> set[tuple[Formation, int]]:
    """Try a short step with every subset of the touching contacts, in both directions.

    Returns:
        Formations that hold the object and are all that touches after the step, nothing
        overlapping, each with the sign of its step along the first of its large coordinates.
    """
    around = surroundings(system, z)
    found = set()
    for size in range(system.dof - 1, len(around.pairs) + 1):
        for kept in combinations(range(len(around.pairs)), size):
            chosen = list(kept)
            gradients = around.gradients[chosen]
            independent = list(independent_rows(gradients))
            together = around.together[np.ix_(chosen, chosen)].any()
            if len(independent) != system.dof - 1 or together:
                continue
            if not holds(gradients[:, :3], system.load):
                continue
            pairs = around.pairs[chosen]
            basis = tangent_basis(gradients[independent])
            for sign in (1, -1):
                guess = (z + sign * NUDGE * basis[0])[None]
                (after,) = project(system, pairs[independent], z, basis, guess).points
                touched = touching(system, after, 1e-7).tolist()
                if touched == pairs.tolist() and overlap(system, after) < 1e-9:
                    found.add((Formation(tuple(touched)), sign * _sign(basis[0])))
    return found


def _sign(direction: FloatArray) -> int:
    """Sign of a vector, the same for vectors that differ by rounding."""
    large = np.flatnonzero(np.abs(direction) > 0.1)[0]
    return int(np.sign(direction[large]))


@pytest.mark.parametrize('seed', [1, 6, 8, 13, 15, 16, 22, 29, 34, 37])
def test_ways_out_of_junctions_are_those_that_a_short_step_finds(seed: int) -> None:
    explored = explore(random_problem(seed))
    system = explored.system
    count = 0
    for piece in explored.pieces:
        for junction in piece.ends:
            if junction is None or junction.around is None:
                continue
            found, _ = leave(system, junction.z)
            ways = {(way.formation, _sign(way.direction)) for way in found}
            assert ways == ways_by_trial(system, junction.z)
            count += 1
    assert count > 0


def test_ways_at_the_wall_are_those_that_a_short_step_finds() -> None:
    system, z = at_the_wall()
    ways = {(way.formation, _sign(way.direction)) for way in leave(system, z)[0]}
    assert ways == ways_by_trial(system, z)
