"""A neck narrower than the grid: a sheet that a bound in the joint plane makes an hourglass."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from cfplan_core import load_problem
from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.planning import sheet_filling
from cfplan_core.planning.constraints import Constraints
from cfplan_core.planning.grasp_check import examine_grasp
from cfplan_core.planning.roadmap import Roadmap
from cfplan_core.planning.sheet_graph import Sheet

# Of the grid, rad.
SPACING = 0.05


class Hourglass:
    """Joint angles where the second one is near a line, the nearer the closer the first is."""

    reason = 'the neck is too narrow'

    def __init__(self, waist: FloatArray, width: float) -> None:
        self.waist, self.width = waist, width

    def margins(self, z: FloatArray, gradients: FloatArray) -> FloatArray:
        along, across = np.abs(z[:, 3:] - self.waist).T
        return np.asarray(0.5 * self.width + 0.6 * along - across)

    def finding(self, z: FloatArray, gradients: FloatArray) -> tuple[str, str]:
        raise AssertionError


@cache
def free_sheet() -> tuple[ContactSystem, Sheet, int]:
    """A sheet without the bound, and a vertex of it that an hourglass fits around."""
    problem = load_problem(Path(__file__).parents[2] / 'config' / 'problems' / 'h122.yaml')
    system = ContactSystem(problem)
    model = FrictionlessModel(system.load, False)
    roadmap = Roadmap(system, model)
    start = examine_grasp(system, model, problem.start, 'start', '').z
    sheets = [piece for _, piece in roadmap.regions.beside(roadmap.root(start))]
    sheet = max((s for s in sheets if isinstance(s, Sheet)), key=lambda s: len(s.vertices))
    joints = np.array(sheet.vertices)[:, 3:]
    along, across = np.meshgrid(np.linspace(-0.1, 0.1, 5), np.linspace(-0.05, 0.05, 3))
    inside = np.abs(across) <= 0.6 * np.abs(along) + 0.02
    shape = np.stack([along[inside], across[inside]], axis=1)
    fits = [
        sum(np.abs(joints - (at + point)).max(axis=1).min() < 0.03 for point in shape)
        for at in joints
    ]
    assert max(fits) == len(shape)
    return system, sheet, int(np.argmax(fits))


def filled(width: float, waist_off: tuple[float, float]) -> tuple[FloatArray, float]:
    """Joint angles of what is reached from left of the waist, and the angle of the waist."""
    system, sheet, middle = free_sheet()
    joints = np.array(sheet.vertices)[:, 3:]
    waist = joints[middle] + waist_off
    constraints = Constraints((Hourglass(waist, width),))
    model = FrictionlessModel(system.load, False)
    bounded = Roadmap(system, model, constraints=constraints)
    left = np.argmin(np.abs(joints - (waist - [0.1, 0.0])).max(axis=1))
    region = bounded.regions.around(sheet.formation, sheet.vertices[int(left)])
    assert isinstance(region, Sheet)
    return np.array(region.vertices)[:, 3:], float(waist[0])


@pytest.mark.parametrize('waist_off', [(0.0, 0.018), (0.02, 0.025), (0.01, 0.02)])
def test_a_neck_of_two_hundredths_is_found_between_lines_of_five(
    waist_off: tuple[float, float],
) -> None:
    joints, waist = filled(0.02, waist_off)
    assert (joints[:, 0] > waist + SPACING).any()
    assert (joints[:, 0] < waist - SPACING).any()


def test_steps_of_the_grid_alone_miss_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sheet_filling._Filling, '_look_between', lambda self, level: False)
    monkeypatch.setattr(sheet_filling, '_FEW', 0)
    joints, waist = filled(0.02, (0.0, 0.018))
    assert not (joints[:, 0] > waist + SPACING).any()


def test_two_parts_that_only_nearly_meet_stay_apart() -> None:
    joints, waist = filled(-0.002, (0.0, 0.018))
    assert (joints[:, 0] < waist).all()
