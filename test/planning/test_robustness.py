from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cfplan_core import load_problem
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.gaps import gap_gradients
from cfplan_core.contact.system import ContactSystem
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.planning.grasp_check import examine_problem
from cfplan_core.planning.manifold import Chart, independent_rows, tangent_basis
from cfplan_core.planning.near_misses import _passing
from cfplan_core.planning.pieces import Piece
from cfplan_core.planning.roadmap import Roadmap
from cfplan_core.planning.robustness import Robustness

STORY = load_problem(
    Path(__file__).parents[2] / 'config' / 'problems' / 'trinkle_hunter_1991.yaml'
)
SYSTEM = ContactSystem(STORY)
MODEL = FrictionlessModel(SYSTEM.load)
ROBUSTNESS = Robustness(SYSTEM, MODEL)


def curves() -> list[Piece]:
    """Curves from the start of the 1991 problem on, a dozen."""
    roadmap = Roadmap(SYSTEM, MODEL)
    pieces = [roadmap.root(examine_problem(SYSTEM, MODEL).start.z)]
    for piece in pieces:
        pieces += [p for _, p in roadmap.neighbours(piece) if p not in pieces and len(pieces) < 12]
    return [piece for piece in pieces if piece.dimension == 1 and len(piece.points) > 4]


CURVES = curves()


def finer(piece: Piece, parts: int) -> np.ndarray:
    """Points of a curve with many more between them."""
    points = [piece.points[:1]]
    for before, after in zip(piece.points[:-1], piece.points[1:], strict=True):
        gradients = gap_gradients(SYSTEM, SYSTEM.place(before[None]), piece.formation.array)[0]
        rows = list(independent_rows(gradients))
        chart = Chart(
            SYSTEM,
            piece.formation.array[rows],
            before,
            tangent_basis(gradients[rows]),
            np.empty((0, SYSTEM.dof)),
        )
        points.append(chart.between(before, after, np.arange(1, parts) / parts))
        points.append(after[None])
    return np.concatenate(points)


@pytest.mark.parametrize('piece', CURVES, ids=lambda piece: str(piece.index))
def test_the_margin_does_not_depend_on_how_finely_a_curve_is_sampled(piece: Piece) -> None:
    coarse = ROBUSTNESS.ratios(piece.formation, piece.points)
    fine = ROBUSTNESS.ratios(piece.formation, finer(piece, 16))
    assert_allclose(coarse.clearance.min(), fine.clearance.min(), atol=0.01)
    for rough, exact in zip(coarse, fine, strict=True):
        assert rough.min() <= 1.25 * exact.min() + 0.01


@pytest.mark.parametrize('piece', CURVES, ids=lambda piece: str(piece.index))
def test_the_margin_but_for_friction_is_the_same_backwards(piece: Piece) -> None:
    there = ROBUSTNESS.ratios(piece.formation, piece.points)._replace(friction=np.ones(1))
    back = ROBUSTNESS.ratios(piece.formation, piece.points[::-1])._replace(friction=np.ones(1))
    assert there.worst == pytest.approx(back.worst, rel=1e-9)


@pytest.mark.parametrize('piece', CURVES, ids=lambda piece: str(piece.index))
def test_the_widths_of_a_motion_are_its_ratios_backwards_and_as_it_is(piece: Piece) -> None:
    z = piece.points
    widths = ROBUSTNESS.widths(piece.formation, z, np.gradient(z, axis=0))
    for way, width in zip((-1, 1), widths, strict=True):
        ratios = ROBUSTNESS.ratios(piece.formation, z[::way])._replace(clearance=np.ones(1))
        inside = slice(2, -2)
        steady = np.minimum.reduce([ratios.force, ratios.hold, ratios.torque, ratios.limits])
        steady = np.minimum(steady, ratios.stiffness)[::way]
        assert (width <= steady + 1e-9).all()
        both = np.minimum(steady, ratios.friction[::way])
        assert_allclose(width[inside], both[inside], rtol=0.2)


def test_joints_without_effort_limits_are_measured_without_a_warning() -> None:
    joints = [replace(joint, effort_limit=np.inf) for joint in STORY.hand.joints]
    fingers = [
        replace(finger, joints=(joint,))
        for finger, joint in zip(STORY.hand.fingers, joints, strict=True)
    ]
    strong = replace(STORY, hand=replace(STORY.hand, fingers=tuple(fingers)))
    piece = CURVES[0]
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        robustness = Robustness(ContactSystem(strong), MODEL)
        torque = robustness.ratios(piece.formation, piece.points).torque
    assert (torque > 0.0).all()


def test_a_joint_near_its_limit_is_what_the_margin_tells() -> None:
    piece = CURVES[0]
    z = piece.points.copy()
    ratios = ROBUSTNESS.ratios(piece.formation, z)
    distance = np.minimum(z[:, 3:] - SYSTEM.lower, SYSTEM.upper - z[:, 3:]).min(axis=1)
    assert_allclose(ratios.limits, distance / 0.1)


def test_form_closure_is_limited_by_what_the_joints_can_hold() -> None:
    (start,) = [piece for piece in CURVES if piece.index == 0]
    torque = ROBUSTNESS.ratios(start.formation, start.points).torque
    effort = sum(
        2.0 * joint.effort_limit / (SYSTEM.force_unit * SYSTEM.size) / 0.2
        for joint in STORY.hand.joints[:1]
    )
    assert (torque <= effort + 1e-9).all()
    assert (torque > 0.0).all()


def test_three_contacts_have_no_torque_to_hold() -> None:
    piece = CURVES[0]
    for left_out in piece.formation.pairs:
        three = Formation(tuple(pair for pair in piece.formation.pairs if pair != left_out))
        assert np.isinf(ROBUSTNESS.ratios(three, piece.points).torque).all()


def test_straight_paths_pass_a_point_as_near_as_many_samples_do() -> None:
    random = np.random.default_rng(0)
    place = random.normal(size=(2, 50)) + 1j * random.normal(size=(2, 50))
    samples = place[0] + np.linspace(0.0, 1.0, 2001)[:, None] * (place[1] - place[0])
    assert_allclose(_passing(place)[0], np.abs(samples).min(axis=0), atol=2e-3)
