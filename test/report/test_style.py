from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from cfplan_core.model import Problem
from cfplan_core.report.style import (
    FINGERS,
    OBJECT,
    PALM,
    body_colours,
    finger_colours,
    joint_colours,
)
from cfplan_core.trajectory.plan_result import PlanResult

# Machado, Oliveira & Fernandes (2009), severity 1: what linear RGB becomes to the viewer.
DEUTERANOPIA = np.array(
    [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.01182, 0.04294, 0.968881],
    ]
)
PROTANOPIA = np.array(
    [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ]
)


def test_every_body_of_a_contact_name_has_a_colour(problem: Problem) -> None:
    assert set(body_colours(problem.hand)) == {'object', *problem.hand.body_names}


def test_links_of_a_finger_share_its_colour(three_joints: tuple[Problem, PlanResult]) -> None:
    hand = three_joints[0].hand
    colours = body_colours(hand)
    assert colours['index.proximal'] == colours['index.distal'] == finger_colours(hand)['index']


def test_joints_have_the_colour_of_the_link_they_move(
    three_joints: tuple[Problem, PlanResult],
) -> None:
    hand = three_joints[0].hand
    assert joint_colours(hand)['thumb_joint'] == body_colours(hand)['thumb.only']


@pytest.mark.parametrize('vision', [np.eye(3), DEUTERANOPIA, PROTANOPIA])
def test_the_bodies_of_two_fingers_differ_for_every_eye(vision: np.ndarray) -> None:
    seen = [
        np.clip(vision @ np.array(to_rgb(colour)) ** 2.2, 0.0, 1.0) ** (1.0 / 2.2)
        for colour in (OBJECT, PALM, *FINGERS[:2])
    ]
    assert min(np.linalg.norm(a - b) for a, b in combinations(seen, 2)) > 0.2
