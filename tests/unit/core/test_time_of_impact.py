"""Times of impact where naive formulas fail; `tests/unit/core/test_pair_time.py` compares them with exact ones."""

import math
from typing import Any

import numpy as np
import pytest
from tests.cases import each

from carom.core import primitives
from carom.core.time_of_impact import time_of_impact
from carom.errors import InputError

#: Relative rounding of one operation.
U = 2.0**-53


def compute_pair_time(dx: float, dy: float, ux: float, uy: float, contact_distance: float) -> float:
    """Return the time of a relative motion, which is the same in both forms; halving costs no rounding."""
    half = contact_distance / 2
    scalar = primitives.pair_time(0.0, 0.0, 0.0, 0.0, half, dx, dy, ux, uy, half)
    assert time_of_impact([(0.0, 0.0)], (0.0, 0.0), half, (dx, dy), (ux, uy), half) == [scalar]
    return scalar


@each(
    "d, u, time",
    [
        pytest.param((5.0, 0.0), (-2.0, 0.0), 2.0, id="head-on"),
        pytest.param((2.0, 0.0), (-5e-324, 0.0), math.inf, id="head-on, later than the largest float"),
        pytest.param((4.0, 3.0), (-1.0, 0.0), math.inf, id="passing by"),
        pytest.param((5.0, 0.0), (2.0, 0.0), math.inf, id="apart and separating"),
        pytest.param((5.0, 0.0), (0.0, 2.0), math.inf, id="apart and crossing"),
        pytest.param((5.0, 0.0), (0.0, 0.0), math.inf, id="apart and at rest to each other"),
        pytest.param((1.0, 0.0), (-1.0, 0.0), 0.0, id="touching and approaching"),
        pytest.param((1.0, 0.0), (-1e-300, 1e300), 0.0, id="touching and approaching by the least"),
        pytest.param((1.0, 0.0), (1.0, 0.0), math.inf, id="touching and separating"),
        pytest.param((1.0, 0.0), (0.0, 1.0), math.inf, id="touching and sliding"),
        pytest.param((1.0, 0.0), (0.0, 0.0), math.inf, id="touching and at rest to each other"),
        pytest.param((0.5, 0.0), (-1.0, 0.0), 0.0, id="overlapping and approaching"),
        pytest.param((1 - 2**-53, 0.0), (-1.0, 0.0), 0.0, id="overlapping by a rounding and approaching"),
        pytest.param((0.5, 0.0), (1.0, 0.0), math.inf, id="overlapping and separating"),
        pytest.param((0.5, 0.0), (0.0, 1.0), math.inf, id="overlapping and crossing"),
        pytest.param((0.0, 0.0), (1.0, 0.0), math.inf, id="concentric: neither approaching nor separating"),
        pytest.param((5.0, 1.0), (-1.0, 0.0), math.inf, id="a graze of zero depth"),
        pytest.param((3.0, -0.6), (-1.0, 0.0), 2.2, id="3-4-5"),
    ],
)
def test_pair_time_by_relative_motion(d: tuple[float, float], u: tuple[float, float], time: float) -> None:
    """Only approaching pairs collide; touching or overlapping ones that approach collide at 0 s."""
    # Each of these is exact except the last, whose inputs are decimals: their rounding, and 2 units in the last place.
    assert compute_pair_time(*d, *u, 1.0) == pytest.approx(time, rel=8 * U, abs=0.0)


# Walls ----------------------------------------------------------------------------------------------------------------


@each(
    "gap, velocity, time",
    [
        pytest.param(3.0, -2.0, 1.5, id="approaching"),
        pytest.param(3.0, 2.0, math.inf, id="separating"),
        pytest.param(3.0, 0.0, math.inf, id="along the wall"),
        pytest.param(3.0, -0.0, math.inf, id="along the wall, negative zero"),
        pytest.param(0.0, -2.0, 0.0, id="touching and approaching"),
        pytest.param(0.0, 2.0, math.inf, id="touching and separating"),
        pytest.param(-0.5, -2.0, 0.0, id="overlapping and approaching"),
        pytest.param(-0.5, 2.0, math.inf, id="overlapping and separating"),
        pytest.param(1e-300, -1e-300, 1.0, id="as small as can be"),
    ],
)
def test_wall_time_is_gap_over_speed_for_approaching_discs(gap: float, velocity: float, time: float) -> None:
    """A wall is met after gap over speed, at 0 s if touched or overlapped, and never if not approached."""
    # The disc has radius 1 and is above a wall at height -1.
    assert primitives.wall_time(0.0, gap, 0.0, velocity, 1.0, (0.0, -1.0, 0.0, 1.0)) == time


# Arrays ---------------------------------------------------------------------------------------------------------------


def test_plain_numbers_give_a_float() -> None:
    """`time_of_impact` returns a plain float for lists and numbers: 1.8 s for a gap of 9 m at 5 m/s."""
    time = time_of_impact([0, 0], [3, 4], 0.5, [6, 8], [0, 0], 0.5)
    assert type(time) is float
    # Two units in the last place.
    assert abs(time - 1.8) <= 4 * U * 1.8


@each(
    "shapes, shape",
    [
        ([(2,), (2,), (), (7, 2), (2,), ()], (7,)),
        ([(5, 1, 2), (2,), (), (2,), (7, 2), ()], (5, 7)),
        ([(2,), (2,), (5, 1), (2,), (2,), (7,)], (5, 7)),
        ([(0, 2), (2,), (), (2,), (2,), ()], (0,)),
        ([(1, 2), (2,), (), (2,), (2,), ()], (1,)),
    ],
)
def test_argument_shapes_broadcast(shapes: list[tuple[int, ...]], shape: tuple[int, ...]) -> None:
    """Leading axes broadcast as in NumPy: arrays of the full shape give the same times."""
    rng = np.random.default_rng(3)
    arguments = [rng.uniform(0.1, 0.5, one) if k % 3 == 2 else rng.normal(size=one) for k, one in enumerate(shapes)]
    full = [np.broadcast_to(one, shape if k % 3 == 2 else (*shape, 2)) for k, one in enumerate(arguments)]
    times = time_of_impact(*arguments)
    assert np.shape(times) == shape
    np.testing.assert_array_equal(times, time_of_impact(*full))


GOOD: dict[str, Any] = {"p1": [0, 0], "v1": [1, 0], "r1": 1.0, "p2": [5, 0], "v2": [0, 0], "r2": 1.0}


@each(
    "name, value, says",
    [
        ("p1", [math.nan, 0], "p1 must be finite everywhere, got nan"),
        ("v1", [0, -math.inf], "v1 must be finite everywhere, got -inf"),
        ("r1", math.inf, "r1 must be finite everywhere, got inf"),
        ("r1", 0.0, "r1 must be above 0 everywhere, got 0.0"),
        ("r2", [1.0, -2.0], "r2 must be above 0 everywhere, got -2.0"),
        ("p2", [1, 2, 3], "p2 must have x and y along its last axis, got shape (3,)"),
        ("v2", 5.0, "v2 must have x and y along its last axis, got shape ()"),
        ("p2", "abc", "p2 must be numbers: "),
        ("v1", [[1, 2], [3]], "v1 must be numbers: "),
        ("r2", None, "r2 must be finite everywhere, got nan"),
    ],
)
def test_invalid_argument_is_refused_with_name_and_value(name: str, value: object, says: str) -> None:
    """An argument outside its domain raises an InputError with its name and the value or shape found."""
    with pytest.raises(InputError) as caught:
        time_of_impact(**{**GOOD, name: value})
    assert str(caught.value).startswith(says)


@each("name, shape", [("p1", (3, 2)), ("r1", (3,))])
def test_shapes_that_do_not_broadcast_are_refused(name: str, shape: tuple[int, ...]) -> None:
    """Arrays of three and four discs raise an InputError that shows the shapes."""
    with pytest.raises(InputError, match="do not broadcast") as caught:
        time_of_impact(**{**GOOD, "p2": np.full((4, 2), 9.0), name: np.ones(shape)})
    assert "(4," in str(caught.value) or "(3," in str(caught.value)


def test_overflowing_squares_raise_no_warning() -> None:
    """`time_of_impact` returns a float without a warning where squares overflow."""
    time = time_of_impact([-1e200, 0], [1e200, 0], 1.0, [1e200, 0], [-1e200, 1e200], 1.0)
    assert isinstance(time, float)
