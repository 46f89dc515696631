from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.bracketing import enclose

Shape = Callable[[FloatArray], FloatArray]

# Functions of the distance from the root that are negative before it and positive behind it.
SHAPES: dict[str, Shape] = {
    'line': lambda x: x,
    'shallow line': lambda x: 1e-12 * x,
    'steep': lambda x: np.tanh(1e6 * x),
    'flat': lambda x: x**3,
    'very flat': lambda x: x**9,
    'kink at the root': lambda x: np.where(x < 0.0, 0.001 * x, 50.0 * x),
    'kink before the root': lambda x: np.maximum(x, 0.2 * x - 0.01),
    'step': lambda x: np.sign(x),
    'nowhere flat, nowhere steep': lambda x: np.expm1(3.0 * x),
    'vertical': lambda x: np.cbrt(x),
}
shapes = pytest.mark.parametrize('shape', SHAPES.values(), ids=list(SHAPES))
roots = st.one_of(
    st.floats(1e-6, 1.0 - 1e-6), st.sampled_from([0.125, 0.5, 1.0 - 2.0**-20, 2.0**-20])
)


@shapes
@given(root=roots, sign=st.sampled_from([-1.0, 1.0]))
def test_known_root_lies_in_the_interval(shape: Shape, root: float, sign: float) -> None:
    low, high = enclose(lambda places: sign * shape(places - root))
    assert low <= root <= high


@shapes
@given(root=roots, width=st.sampled_from([1e-3, 1e-6, 1e-10]))
def test_interval_is_not_wider_than_asked_for(shape: Shape, root: float, width: float) -> None:
    low, high = enclose(lambda places: shape(places - root), width)
    assert 0.0 < high - low <= width


@shapes
def test_sign_changes_between_the_ends(shape: Shape) -> None:
    low, high = enclose(lambda places: shape(places - 0.3))
    before, after = shape(np.array([low, high]) - 0.3)
    assert before <= 0.0 < after


@shapes
def test_function_is_never_asked_outside_the_interval(shape: Shape) -> None:
    asked: list[float] = []

    def function(places: FloatArray) -> FloatArray:
        asked.extend(places)
        return shape(places - 1e-3)

    enclose(function)
    assert min(asked) >= 0.0
    assert max(asked) <= 1.0


def calls(function: Shape, width: float) -> int:
    count = 0

    def counted(places: FloatArray) -> FloatArray:
        nonlocal count
        count += 1
        return function(places)

    enclose(counted, width)
    return count


@shapes
@pytest.mark.parametrize('root', [1e-5, 0.4321, 0.9])
def test_at_most_as_many_calls_are_needed_as_by_halving(shape: Shape, root: float) -> None:
    """Which would take 34 to this width; the first call alone divides by eight."""
    assert calls(lambda places: shape(places - root), 1e-10) <= math.ceil(math.log2(1e10))


@pytest.mark.parametrize(
    'function',
    [
        lambda x: x - 0.4321,
        lambda x: np.sin(3.0 * x) - 0.7,
        lambda x: np.where(x < 0.4321, x - 0.4321, 10.0 * (x - 0.4321)),
    ],
    ids=['line', 'sine', 'kink at the root'],
)
def test_few_calls_are_needed_where_the_function_is_smooth_before_its_root(
    function: Shape,
) -> None:
    assert calls(function, 1e-8) <= 5


def test_one_of_several_roots_is_enclosed() -> None:
    def cubic(places: FloatArray) -> FloatArray:
        return np.asarray((places - 0.21) * (places - 0.52) * (places - 0.83))

    low, high = enclose(cubic)
    assert any(low <= root <= high for root in (0.21, 0.52, 0.83))
