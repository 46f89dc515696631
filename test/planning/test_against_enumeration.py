"""What exploration reaches against all grasps of three contacts, found by enumeration."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from planning.dense_fill import DenseFill
from planning.enumeration import Enumeration, Held, scene_of

from cfplan_core import load_problem
from cfplan_core.exploration import Exploration, explore
from cfplan_core.planning.joint_grid import Place
from cfplan_core.planning.sheet_graph import Sheet
from cfplan_core.planning.sheets import Sheets

FOLDER = Path(__file__).parents[2] / 'config' / 'problems' / 'existence'
PROBLEM = load_problem(FOLDER / 'link_long_enough.yaml')
# Nodes of the coarsest grid that are looked at, of those below a grasp that is reached.
NODES = (0.5, 1.0)
# Coordinates of a pose's coordinates, m and rad, that are one.
SAME = 1e-6


@cache
def explored() -> Exploration:
    return explore(PROBLEM, second_order=False)


def place_of(node: float) -> Place:
    """A node below a sheet, by its rank among them."""
    regions = explored().roadmap.regions
    assert isinstance(regions, Sheets)
    places = {
        place
        for sheet in explored().pieces()
        if isinstance(sheet, Sheet)
        for place in sheet.places
        if place is not None and regions.grid.is_coarse(place)
    }
    return sorted(places)[int(node * (len(places) - 1))]


def reached(place: Place) -> list[Held]:
    """Grasps of sheets over a node, with the pose of the centre of mass."""
    system = explored().system
    return [
        Held(
            frozenset(system.contact_names(sheet.formation.pairs)),
            sheet.vertices[vertex][:3] * [system.size, system.size, 1.0],
        )
        for sheet in explored().pieces()
        if isinstance(sheet, Sheet) and len(sheet.formation) == 3
        for vertex, other in enumerate(sheet.places)
        if other == place
    ]


def joints_at(place: Place) -> np.ndarray:
    regions = explored().roadmap.regions
    assert isinstance(regions, Sheets)
    return regions.grid.joints(place)


@cache
def enumerated(node: float) -> list[Held]:
    scene = scene_of(PROBLEM, joints_at(place_of(node)))
    return Enumeration(scene).grasps(np.array(PROBLEM.gravity) / np.hypot(*PROBLEM.gravity))


def same(one: Held, other: Held) -> bool:
    off = one.pose - other.pose
    off[2] = (off[2] + np.pi) % (2.0 * np.pi) - np.pi
    return one.contacts == other.contacts and bool(np.abs(off).max() < SAME)


@pytest.mark.parametrize('node', NODES)
def test_every_grasp_that_is_reached_is_enumerated(node: float) -> None:
    found = enumerated(node)
    assert found
    for grasp in reached(place_of(node)):
        assert any(same(grasp, other) for other in found), grasp


def test_some_grasps_are_reached_and_some_are_not() -> None:
    everywhere = [(g, place_of(node)) for node in NODES for g in enumerated(node)]
    hits = [any(same(g, other) for other in reached(place)) for g, place in everywhere]
    assert any(hits)
    assert not all(hits)


@pytest.mark.parametrize('node', NODES)
def test_a_grasp_that_is_not_reached_leads_over_the_grid_to_none_that_is(
    node: float,
) -> None:
    regions = explored().roadmap.regions
    assert isinstance(regions, Sheets)
    place = place_of(node)
    stride = regions.grid.stride(0)
    spacing = regions.grid.axes[0][stride] - regions.grid.axes[0][0]
    x, y = PROBLEM.object.center_of_mass
    for grasp in enumerated(node):
        if any(same(grasp, other) for other in reached(place)):
            continue
        c, s = np.cos(grasp.pose[2]), np.sin(grasp.pose[2])
        pose = grasp.pose - np.array([c * x - s * y, s * x + c * y, 0.0])
        fill = DenseFill(PROBLEM, tuple(grasp.contacts), pose, joints_at(place), spacing, 60)
        for (i, j), there in fill.nodes.items():
            c, s = np.cos(there[2]), np.sin(there[2])
            center = there + np.array([c * x - s * y, s * x + c * y, 0.0])
            held = Held(grasp.contacts, center)
            beside = (place[0] + stride * i, place[1] + stride * j)
            assert not any(same(held, other) for other in reached(beside))
