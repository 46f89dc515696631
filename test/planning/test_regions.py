from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planning.scenes import FEET, TIPS, at, formation, pushed_angles, pushed_block
from random_problems import explore, goal_at, random_problem

from cfplan_core.contact.detection import touching
from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.separation import penetration_depth
from cfplan_core.mechanics.contact_model import Stability
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.model import Goal, Problem
from cfplan_core.planner import PlanOptions, plan
from cfplan_core.planning.pieces import Region
from cfplan_core.planning.regions import Regions
from cfplan_core.planning.roadmap import Roadmap
from cfplan_core.planning.tracing import classify
from cfplan_core.verification import verify_plan

LEFT_TIP = (*FEET, TIPS[0])


def leaning_block() -> Problem:
    """Gravity pulls the block to the left: on the left tip alone it is held as well."""
    return replace(pushed_block(), gravity=(-3.0, -9.0))


def roadmap_of(problem: Problem) -> tuple[ContactSystem, Roadmap]:
    system = ContactSystem(problem)
    roadmap = Roadmap(system, FrictionlessModel(system.load))
    roadmap.regions = Regions(roadmap)
    return system, roadmap


def loose(x: float, clearance: float) -> tuple[float, float]:
    """Joint angles with the left tip on the block at x and the right one turned away."""
    left, right = pushed_angles(x)
    return left, right - clearance


def beside(seed: int) -> list[Region]:
    """Regions that the curves of a random problem border on, of which one contact is open."""
    explored = explore(random_problem(seed))
    regions = explored.roadmap.regions = Regions(explored.roadmap)
    found: list[Region] = []
    for piece in explored.pieces:
        if piece.dimension == 1:
            for _, region in regions.beside(piece):
                assert isinstance(region, Region)
                found.append(region)
    return list(dict.fromkeys(found))


def test_configurations_that_a_straight_path_joins_are_in_one_region() -> None:
    system, roadmap = roadmap_of(leaning_block())
    kept = formation(system, *LEFT_TIP)
    regions = [
        roadmap.regions.around(kept, at(system, x, loose(x, clearance)))
        for x, clearance in ((0.0, 0.3), (0.004, 0.2), (-0.002, 0.1))
    ]
    assert len(set(regions)) == 1
    assert regions[0].dimension == 2
    assert regions[0].stability is Stability.FORCE_CLOSURE


def test_path_through_a_region_keeps_its_contacts_and_no_others() -> None:
    system, roadmap = roadmap_of(leaning_block())
    kept = formation(system, *LEFT_TIP)
    ends = [at(system, x, loose(x, clearance)) for x, clearance in ((0.004, 0.3), (-0.002, 0.1))]
    (region,) = {roadmap.regions.around(kept, z) for z in ends}
    path = region.path(*ends)
    np.testing.assert_allclose(path[[0, -1]], ends, atol=1e-9)
    for z in path:
        assert tuple(touching(system, z, 1e-7).tolist()) == kept.pairs


def test_curve_borders_on_the_region_where_a_contact_opens() -> None:
    system, roadmap = roadmap_of(leaning_block())
    curve = roadmap.root(at(system, 0.0, pushed_angles(0.0)))
    found = {region.formation for _, region in roadmap.regions.beside(curve)}
    assert formation(system, *LEFT_TIP) in found
    # Without the left tip nothing balances the pull of gravity.
    assert formation(system, *FEET, TIPS[1]) not in found


def test_block_that_is_pressed_from_both_sides_only_borders_on_no_region() -> None:
    """Upright gravity: with either tip away the other one pushes the block off."""
    system, roadmap = roadmap_of(pushed_block())
    curve = roadmap.root(at(system, 0.0, pushed_angles(0.0)))
    assert not [
        r
        for _, r in roadmap.regions.beside(curve)
        if set(formation(system, *FEET).pairs) <= set(r.formation.pairs)
    ]


def test_rays_from_a_region_come_back_to_the_curve_that_it_borders_on() -> None:
    system, roadmap = roadmap_of(leaning_block())
    curve = roadmap.root(at(system, 0.0, pushed_angles(0.0)))
    regions = [
        region
        for _, region in roadmap.regions.beside(curve)
        if region.formation == formation(system, *LEFT_TIP)
    ]
    assert curve in {piece for _, piece in roadmap.regions.beyond(regions[0])}


def test_region_is_entered_from_the_inside_of_its_curve() -> None:
    system, roadmap = roadmap_of(leaning_block())
    curve = roadmap.root(at(system, 0.0, pushed_angles(0.0)))
    for z, region in roadmap.regions.beside(curve):
        assert isinstance(region, Region)
        assert 0.0 < curve.place(z) < len(curve.points) - 1.0
        assert np.abs(region.path(z, region.anchor)[0] - z).max() < 1e-12


@pytest.mark.parametrize('seed', range(0, 40, 3))
def test_links_of_regions_lead_to_the_anchor_without_leaving_the_contacts(seed: int) -> None:
    problem = random_problem(seed)
    system = ContactSystem(problem)
    tracer = Roadmap(system, FrictionlessModel(system.load)).tracer
    for region in beside(seed):
        for z, points in region.links:
            np.testing.assert_allclose(points[[0, -1]], [region.anchor, z], atol=1e-9)
            assert np.abs(np.diff(points, axis=0)).max(initial=0.0) < 0.1
            for inside in points[:-1]:
                touched = touching(system, inside, 1e-7).tolist()
                assert tuple(touched) == region.formation.pairs
                margins = tracer.margins(region.formation, inside[None])
                assert classify(margins) is region.stability


@pytest.mark.parametrize('seed', range(0, 40, 3))
def test_nothing_overlaps_on_the_links_of_regions(seed: int) -> None:
    problem = random_problem(seed)
    system = ContactSystem(problem)
    for region in beside(seed):
        for _, points in region.links:
            for z, pose in zip(points, system.object_poses(points), strict=True):
                bodies = problem.hand.world_vertices(z[3:])
                thing = problem.object.world_vertices(pose)
                assert max(penetration_depth(thing, body) for body in bodies.values()) < 1e-9
                assert penetration_depth(bodies['left.link'], bodies['right.link']) < 1e-9


@pytest.mark.parametrize('seed', [1, 3, 8, 11, 13, 17, 31])
def test_goal_inside_a_region_is_reached(seed: int) -> None:
    regions = beside(seed)
    assert regions
    problem = goal_at(random_problem(seed), regions[-1].anchor)
    result = plan(problem, PlanOptions(time_budget=20.0))
    assert result.solved, result.message
    assert verify_plan(problem, result).ok


@pytest.mark.parametrize('seed', [1, 13])
def test_way_from_a_region_leads_back(seed: int) -> None:
    """Start and goal of the plan above in each other's place."""
    problem = goal_at(random_problem(seed), beside(seed)[-1].anchor)
    start = problem.goal.grasp(problem.hand)
    assert start is not None
    names = problem.hand.joint_names
    joints = dict(zip(names, problem.start.joints.tolist(), strict=True))
    back = replace(problem, start=start, goal=Goal(problem.start.object_pose, joints))
    result = plan(back, PlanOptions(time_budget=20.0))
    assert result.solved, result.message
    assert verify_plan(back, result).ok
