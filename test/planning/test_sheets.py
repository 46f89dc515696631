from __future__ import annotations

import itertools
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from planning.dense_fill import DenseFill
from random_problems import explore, goal_at, random_problem

from cfplan_core.contact.detection import touching
from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.separation import penetration_depth
from cfplan_core.model import Hand, Problem
from cfplan_core.planner import PlanOptions, plan
from cfplan_core.planning.joint_grid import JointGrid
from cfplan_core.planning.sheet_graph import Sheet
from cfplan_core.planning.sheets import Sheets
from cfplan_core.verification import verify_plan


@cache
def sheets_of(seed: int) -> tuple[ContactSystem, list[Sheet], JointGrid]:
    """Sheets that the curves of a random problem border on."""
    explored = explore(random_problem(seed))
    regions = explored.roadmap.regions
    assert isinstance(regions, Sheets)
    for piece in explored.pieces:
        if piece.dimension == 1:
            regions.beside(piece)
    return explored.system, regions.sheets, regions.grid


def strides_of(sheet: Sheet) -> tuple[int, int]:
    """Least and largest distance of neighbouring vertices, in lines of the finest grid."""
    places = np.array(sheet.places)
    strides = [
        int(np.abs(places[a] - places[b]).max())
        for a, edges in enumerate(sheet.edges)
        for b in edges
    ]
    return min(strides), max(strides)


@pytest.mark.parametrize(('seed', 'share'), [(1, 0.98), (8, 0.98), (12, 0.9)])
def test_sheet_is_what_a_dense_fill_with_other_mechanics_reaches(seed: int, share: float) -> None:
    """The fill has a third of the finest spacing: every third node may lie below a vertex.

    A share of what it reaches is no further than a spacing from a vertex. The sheet of the last
    problem has a tail that is narrower.
    """
    system, sheets, grid = sheets_of(seed)
    sheet = min(
        (sheet for sheet in sheets if len(sheet.vertices) > 60), key=lambda s: len(s.vertices)
    )
    finest, coarsest = strides_of(sheet)
    spacing = grid.axes[0][finest] - grid.axes[0][0]
    (pose,) = system.object_poses(sheet.anchor[None])
    names = system.contact_names(sheet.formation.pairs)
    dense = DenseFill(random_problem(seed), names, pose, sheet.anchor[3:], spacing / 3.0)
    z = np.array(sheet.vertices)
    steps = (z[:, 3:] - sheet.anchor[3:]) / (spacing / 3.0)
    over = {(int(i), int(j)) for i, j in np.rint(steps)}
    np.testing.assert_allclose(steps, np.rint(steps), atol=1e-6)
    for (i, j), pose in zip(np.rint(steps), system.object_poses(z), strict=True):
        np.testing.assert_allclose(dense.nodes[int(i), int(j)], pose, atol=1e-8)
    nodes = np.array(sorted(dense.nodes))
    apart = np.abs(nodes[:, None] - np.array(sorted(over))).max(axis=2).min(axis=1)
    assert (apart <= 3 * coarsest // finest).mean() > share


@pytest.mark.parametrize('seed', [1, 2, 6, 8, 13, 15, 24])
def test_way_between_any_two_links_stays_on_the_sheet(seed: int) -> None:
    system, sheets, _ = sheets_of(seed)
    problem = random_problem(seed)
    for sheet in sheets:
        ends = [*(z for z, _ in sheet.links[:4]), sheet.vertices[-1]]
        for first, last in itertools.pairwise(ends):
            path = sheet.path(first, last)
            np.testing.assert_allclose(path[[0, -1]], [first, last], atol=1e-12)
            assert np.abs(np.diff(path, axis=0)).max(initial=0.0) < 0.25
            for z, pose in zip(path, system.object_poses(path), strict=True):
                assert set(sheet.formation.pairs) <= set(touching(system, z, 1e-7).tolist())
                bodies = problem.hand.world_vertices(z[3:])
                thing = problem.object.world_vertices(pose)
                assert max(penetration_depth(thing, body) for body in bodies.values()) < 1e-9
                assert penetration_depth(bodies['left.link'], bodies['right.link']) < 1e-9


def strong(problem: Problem) -> Problem:
    """A problem whose joints can hold any grasp, also one with large forces at a fold."""
    fingers = tuple(
        replace(finger, joints=tuple(replace(j, effort_limit=1e9) for j in finger.joints))
        for finger in problem.hand.fingers
    )
    return replace(problem, hand=Hand(problem.hand.palm, fingers))


@pytest.mark.parametrize('seed', [1, 6, 13, 20, 24])
def test_configuration_on_a_sheet_is_reached_by_a_certified_plan(seed: int) -> None:
    problem = strong(random_problem(seed))
    _, sheets, _ = sheets_of(seed)
    for sheet in sheets[:3]:
        goal = goal_at(problem, sheet.vertices[len(sheet.vertices) // 2])
        result = plan(goal, PlanOptions(time_budget=60.0))
        assert result.solved, result.message
        assert verify_plan(goal, result).ok


@pytest.mark.parametrize('seed', [1, 2, 6, 13])
def test_more_touches_on_a_border_or_a_vertex_is_at_the_end_of_its_edge(seed: int) -> None:
    system, sheets, _ = sheets_of(seed)
    for sheet in sheets:
        for border in sheet.borders:
            assert set(touching(system, border.z, 1e-7).tolist()) > set(sheet.formation.pairs)
