from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from planning.scenes import (
    FEET,
    HALF,
    LEAN,
    LEFT,
    RIGHT,
    TIPS,
    at,
    formation,
    pushed_angles,
    pushed_block,
    squeezed_angles,
    squeezed_trapezoid,
    tracer_of,
    x_of,
)
from scipy.optimize import brentq

from cfplan_core.contact.gaps import gaps
from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import Stability
from cfplan_core.planning.stability_classes import split_by_class

FORM, FORCE = Stability.FORM_CLOSURE, Stability.FORCE_CLOSURE
TRAPEZOID = ContactSystem(squeezed_trapezoid())
KEPT = formation(TRAPEZOID, *FEET, *TIPS)
# There the right and the left tip are nearly at the foot of the trapezoid's sides.
ENDS = (-0.0045, 0.0095)


def points(*places: float) -> FloatArray:
    return np.array([at(TRAPEZOID, x, squeezed_angles(x)) for x in places])


def split(*places: float) -> list[tuple[Stability, FloatArray]]:
    return split_by_class(tracer_of(TRAPEZOID), KEPT, points(*places))


def lines_of_force_meet_at(x: float) -> float:
    """How far right of the base's middle the lines of force of both tips meet."""
    left, right = squeezed_angles(x)
    return (LEFT * math.sin(left) - RIGHT * math.sin(right)) / math.sin(2.0 * LEAN)


def borders() -> tuple[float, float]:
    """Where the lines of force meet above the right and above the left foot."""
    first = brentq(lambda x: lines_of_force_meet_at(x) - HALF, *ENDS, xtol=1e-15)
    last = brentq(lambda x: lines_of_force_meet_at(x) + HALF, *ENDS, xtol=1e-15)
    return first, last


def test_scene_has_force_closure_on_either_side_of_form_closure() -> None:
    first, last = borders()
    assert ENDS[0] < first < last < ENDS[1]


@pytest.mark.parametrize('count', [3, 5, 40])
def test_curve_is_cut_where_the_lines_of_force_pass_a_foot(count: int) -> None:
    parts = split(*np.linspace(*ENDS, count))
    assert [stability for stability, _ in parts] == [FORCE, FORM, FORCE]
    cuts = [x_of(TRAPEZOID, part[-1]) for _, part in parts[:-1]]
    np.testing.assert_allclose(cuts, borders(), atol=1e-7)


def test_neighbours_share_a_point_that_still_has_form_closure() -> None:
    parts = split(*np.linspace(*ENDS, 9))
    for (_, before), (_, after) in pairwise(parts):
        np.testing.assert_array_equal(before[-1], after[0])
        margin = tracer_of(TRAPEZOID).margins(KEPT, before[-1:]).form_closure[0]
        assert 0.0 < margin < 1e-4


def test_points_where_curves_are_cut_lie_on_the_manifold() -> None:
    parts = split(*np.linspace(*ENDS, 9))
    cuts = np.array([part[-1] for _, part in parts[:-1]])
    gap = gaps(TRAPEZOID, TRAPEZOID.place(cuts), KEPT.array).gap
    np.testing.assert_allclose(gap, 0.0, atol=1e-13)


def test_all_points_are_kept_in_their_order() -> None:
    places = np.linspace(*ENDS, 13)
    parts = split(*places)
    whole = np.concatenate([parts[0][1], *(part[1:] for _, part in parts[1:])])
    found = [x_of(TRAPEZOID, z) for z in whole]
    assert found == sorted(found)
    assert {round(float(x), 12) for x in places} <= {round(x, 12) for x in found}


def test_curve_is_cut_alike_in_both_directions() -> None:
    there, back = split(*np.linspace(*ENDS, 9)), split(*np.linspace(*ENDS[::-1], 9))
    cuts = [[x_of(TRAPEZOID, part[-1]) for _, part in parts[:-1]] for parts in (there, back)]
    np.testing.assert_allclose(cuts[0], cuts[1][::-1], atol=1e-7)


@pytest.mark.parametrize(
    ('places', 'stability'),
    [((-0.001, 0.0, 0.001), FORM), ((-0.0045, -0.004), FORCE), ((0.009, 0.0095), FORCE)],
)
def test_curve_of_one_class_stays_as_it_is(
    places: tuple[float, ...], stability: Stability
) -> None:
    ((found, part),) = split(*places)
    assert found is stability
    np.testing.assert_array_equal(part, points(*places))


def test_form_closure_between_two_points_without_it_is_found() -> None:
    """Both points lie just outside."""
    first, last = borders()
    assert [stability for stability, _ in split(first - 1e-4, last + 1e-4)] == [FORCE, FORM, FORCE]


def test_upright_sides_never_give_form_closure() -> None:
    system = ContactSystem(pushed_block())
    curve = np.array([at(system, x, pushed_angles(x)) for x in (-0.004, 0.0, 0.004)])
    ((found, _),) = split_by_class(tracer_of(system), formation(system, *FEET, *TIPS), curve)
    assert found is FORCE
