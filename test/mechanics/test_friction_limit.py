"""Friction that contacts bear, against closed forms and linear programs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.friction_limit import friction_limits

DOWN = np.array([0.0, -1.0, 0.0])


def wedge(slope: float) -> FloatArray:
    """Gradients of a block on a ramp of this slope against a stop across it, that cannot turn."""
    along, across = (
        np.array([np.cos(slope), np.sin(slope)]),
        np.array([-np.sin(slope), np.cos(slope)]),
    )
    return np.array([[[*across, 0.1], [*across, -0.1], [*along, 0.0]]])


def on_ramp(slope: float, direction: float, most: float = 1.0) -> float:
    gradients = wedge(slope)
    slides = np.zeros((1, 3, 3))
    slides[0, :2, :2] = gradients[0, 2, :2]
    step = direction * gradients[:, 2]
    return float(friction_limits(gradients, slides, step, DOWN, most)[0])


def test_a_block_that_is_let_down_a_ramp_leaves_its_stop_at_the_tangent_of_the_slope() -> None:
    # The stop moves down the ramp; friction holds the block back and carries it beyond tan(slope).
    assert on_ramp(np.arctan(0.25), -1.0) == pytest.approx(0.25, rel=1e-3)


def test_a_block_that_is_pushed_up_a_ramp_never_leaves_its_stop() -> None:
    assert on_ramp(np.arctan(0.25), 1.0) == 1.0


def test_without_motion_no_friction_has_a_direction() -> None:
    assert on_ramp(np.arctan(0.25), 0.0) == 1.0


def test_contacts_that_do_not_hold_bear_no_friction() -> None:
    assert on_ramp(-0.2, -1.0) == 0.0


@pytest.mark.parametrize('count', [3, 4, 5])
def test_contacts_hold_below_the_limit_and_not_above(count: int) -> None:
    """Whether contacts hold is asked of linear programs; most limits are between two steps."""
    random = np.random.default_rng(count)
    checked = 0
    while checked < 20:
        wrenches, slides = random.normal(size=(2, 1, count, 3))
        load, step = DOWN, random.normal(size=(1, 3))
        limit = float(friction_limits(wrenches, slides, step, load, 0.2)[0])
        if not 0.0 < limit < 0.2:
            continue
        checked += 1
        pull = np.sign(slides @ step[0])[0][:, None] * slides[0]

        def holds(mu: float, wrenches: FloatArray = wrenches, pull: FloatArray = pull) -> bool:
            found = linprog(np.zeros(count), A_eq=(wrenches[0] - mu * pull).T, b_eq=-DOWN)
            return bool(found.status == 0)

        assert holds(0.05 * np.floor(limit / 0.05))
        assert not holds(0.05 * np.ceil(limit / 0.05))
