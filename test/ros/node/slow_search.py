"""A search that takes far longer than any test: fingers of two joints, a goal out of reach."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import yaml

from cfplan_core.model import Problem
from cfplan_core.model.loading import problem_from_mapping
from cfplan_ros.conversions.requests import request_from_problem

LENGTHS = 0.04, 0.03
HALF = 0.02
BASE = 0.07, 0.02


def slow_hand_file(directory: Path) -> Path:
    """Write the hand and return its file."""
    path = directory / 'slow_hand.yaml'
    path.write_text(yaml.safe_dump(_hand()), encoding='utf-8')
    return path


def slow_request(name: str = 'slow') -> Any:
    request = request_from_problem(_problem())
    request.problem_name = name
    request.options.time_budget.sec = 60
    return request


def slow_problem_file(directory: Path) -> Path:
    """Write the whole problem and return its file."""
    path = directory / 'slow.yaml'
    path.write_text(yaml.safe_dump(_mapping()), encoding='utf-8')
    return path


def _problem() -> Problem:
    reading = problem_from_mapping(_mapping())
    assert reading.problem is not None, reading.findings
    return reading.problem


def _mapping() -> dict[str, Any]:
    left, right = _reach(0.0), _reach(0.005)
    joints = {
        'left_0': left[0],
        'left_1': left[1],
        'right_0': math.pi - right[0],
        'right_1': -right[1],
    }
    return {
        'format': 'cfplan/problem/1',
        'name': 'slow',
        'gravity': [0.0, -9.81],
        'hand': _hand(),
        'object': {
            'vertices': [[-HALF, 0.0], [HALF, 0.0], [HALF, 0.04], [-HALF, 0.04]],
            'mass': 0.1,
        },
        'contact': {'friction': 0.0},
        'start': {'object_pose': [0.0, 0.0, 0.0], 'joints': joints},
        'goal': {'object_pose': [0.0, 0.03, 1.0]},
    }


def _reach(height: float) -> tuple[float, float]:
    """Joint angles at which the left tip touches the block so far above its base."""
    x, y = BASE[0] - HALF, height
    first, second = LENGTHS
    bend = -math.acos((x**2 + y**2 - first**2 - second**2) / (2.0 * first * second))
    turn = math.atan2(second * math.sin(bend), first + second * math.cos(bend))
    return math.atan2(y, x) - turn, bend


def _hand() -> dict[str, Any]:
    return {
        'palm': [{'vertices': [[-0.5, -0.1], [0.5, -0.1], [0.5, 0.0], [-0.5, 0.0]]}],
        'fingers': [_finger('left', -BASE[0]), _finger('right', BASE[0])],
    }


def _finger(name: str, x: float) -> dict[str, Any]:
    first, second = LENGTHS
    return {
        'name': name,
        'base': [x, BASE[1]],
        'base_angle': 0.0,
        'joints': [
            {
                'name': f'{name}_{k}',
                'limits': [-3.1, 3.1],
                'velocity_limit': 1.0,
                'effort_limit': 5.0,
            }
            for k in range(2)
        ],
        'links': [
            {
                'name': 'first',
                'length': first,
                'vertices': [[0.0, -0.002], [first, -0.002], [first, 0.002], [0.0, 0.002]],
            },
            {
                'name': 'second',
                'length': second,
                'vertices': [[0.0, -0.002], [second, 0.0], [0.0, 0.002]],
            },
        ],
    }
