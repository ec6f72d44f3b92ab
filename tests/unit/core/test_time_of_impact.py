"""Times of impact where naive formulas fail; `tests/unit/core/test_pair_time.py` compares them with exact ones."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.cases import each

from carom.core import primitives
from carom.core.time_of_impact import time_of_impact
from carom.errors import InputError

#: Relative rounding of one operation.
U = 2.0**-53


def compute_by_array(dx: float, dy: float, ux: float, uy: float, contact_distance: float) -> float:
    """Return what `time_of_impact` says of the same relative motion; halving and zero cost no rounding."""
    half = contact_distance / 2
    time = time_of_impact((0.0, 0.0), (0.0, 0.0), half, (dx, dy), (ux, uy), half)
    assert isinstance(time, float)
    return time


def compute_by_scalar(dx: float, dy: float, ux: float, uy: float, contact_distance: float) -> float:
    """The scalar form, of relative position and velocity."""
    half = contact_distance / 2
    return primitives.pair_time(0.0, 0.0, 0.0, 0.0, half, dx, dy, ux, uy, half)


FORMS = [pytest.param(compute_by_scalar, id="scalar"), pytest.param(compute_by_array, id="array")]
PairTime = Callable[[float, float, float, float, float], float]


# Inputs that break a naive least positive root; contact distance 1 ----------------------------------------------------


@each("form", FORMS)
def test_oblique_contact_within_rounding_collides_now(form: PairTime) -> None:
    """Discs within about 2^-54 of contact at (.6, .8) collide within 2^-52 s, not at their exit at 1.2 s."""
    assert 0.0 <= form(0.6, 0.8, -1.0, -1e-3, 1.0) <= 2**-52


@each("form", FORMS)
@each("gap", [1e-10, 1e-12, 2.0**-52])
def test_tiny_gap_is_crossed_in_gap_over_speed(form: PairTime, gap: float) -> None:
    """A head-on impact across a gap of 1e-10 down to 2^-52 is found at gap over speed; no epsilon hides it."""
    # Both factors of c are exact or one rounding off here, and so is the denominator: 4 roundings in all.
    exact_gap = (1 + gap) - 1
    assert abs(form(1 + gap, 0.0, -1.0, 0.0, 1.0) - exact_gap) <= 4 * U * exact_gap


@each("form", FORMS)
def test_distant_disc_keeps_its_miss_distance(form: PairTime) -> None:
    """An off-centre hit from 1e8 contact distances away is found to a few ulp; b^2 - a c would lose it."""
    # 1e8 - sqrt(.75), to the rounding of a number of that size: 2 units in its last place, and the root's own rounding.
    assert abs(form(1e8, 0.5, -1.0, 0.0, 1.0) - (1e8 - math.sqrt(0.75))) <= 6 * U * 1e8


@each("form", FORMS)
@each("speed", [1e-300, 1e-170, 1e-100, 1e-9, 1e9, 1e100])
def test_very_slow_and_very_fast_discs_hit(form: PairTime, speed: float) -> None:
    """A gap of 1 is crossed in 1/speed for speeds from 1e-300 to 1e100, also where their squares underflow."""
    assert abs(form(2.0, 0.0, -speed, 0.0, 1.0) * speed - 1) <= 8 * U


# Approaching, touching, overlapping, never ----------------------------------------------------------------------------


@each("form", FORMS)
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
def test_pair_time_by_relative_motion(
    form: PairTime, d: tuple[float, float], u: tuple[float, float], time: float
) -> None:
    """Only approaching pairs collide; touching or overlapping ones that approach collide at 0 s."""
    # Each of these is exact but the last, whose inputs are decimals: their rounding, and 2 units in the last place.
    assert form(*d, *u, 1.0) == pytest.approx(time, rel=8 * U, abs=0.0)


@each("form", FORMS)
def test_graze_is_an_impact_only_with_depth(form: PairTime) -> None:
    """Passing at exactly the contact distance is no impact; passing 2^-53 of it closer is one."""
    assert form(4.0, 1.0, -1.0, 0.0, 1.0) == math.inf
    # The depth of half a unit gives D = 2^-53 + ..., far above the one rounding of each of its two squares: a hit.
    time = form(4.0, 1.0 - 2**-53, -1.0, 0.0, 1.0)
    # 4 - sqrt(1 - (1 - 2^-53)^2), of which the root is 1.5e-8.
    assert time == pytest.approx(4 - math.sqrt(2 * 2**-53), rel=16 * U, abs=0.0)


coordinates = st.floats(-1e3, 1e3)
radii = st.floats(1e-3, 1e3)


@given(coordinates, coordinates, coordinates, coordinates, radii)
def test_exchanging_the_discs_changes_no_bit_of_the_time(dx: float, dy: float, ux: float, uy: float, r: float) -> None:
    """Reversing the relative position and velocity changes no bit of the time."""
    assert compute_by_scalar(-dx, -dy, -ux, -uy, r) == compute_by_scalar(dx, dy, ux, uy, r)


@given(coordinates, coordinates, coordinates, coordinates, radii)
def test_time_is_never_negative_or_nan(dx: float, dy: float, ux: float, uy: float, r: float) -> None:
    """The scalar and the array form return a time of 0 or more, or infinity, for any motion."""
    assert compute_by_scalar(dx, dy, ux, uy, r) >= 0.0
    assert compute_by_array(dx, dy, ux, uy, r) >= 0.0


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
    # Of a disc of radius 1 above a wall at height -1.
    assert primitives.wall_time(0.0, gap, 0.0, velocity, 1.0, (0.0, -1.0, 0.0, 1.0)) == time


# Arrays ---------------------------------------------------------------------------------------------------------------


def test_plain_numbers_give_a_float() -> None:
    """`time_of_impact` returns a plain float for lists and numbers: 1.8 s for a gap of 9 m at 5 m/s."""
    time = time_of_impact([0, 0], [3, 4], 0.5, [6, 8], [0, 0], 0.5)
    assert type(time) is float
    # Two units in the last place.
    assert abs(time - 1.8) <= 4 * U * 1.8


@each(
    "p1, v1, r1, p2, v2, r2, shape",
    [
        ((2,), (2,), (), (7, 2), (2,), (), (7,)),
        ((2,), (7, 2), (), (2,), (2,), (), (7,)),
        ((2,), (2,), (7,), (2,), (2,), (), (7,)),
        ((5, 1, 2), (2,), (), (7, 2), (2,), (), (5, 7)),
        ((2,), (2,), (5, 1), (2,), (7, 2), (), (5, 7)),
        ((3, 5, 7, 2),) * 2 + ((3, 5, 7),) + ((3, 5, 7, 2),) * 2 + ((3, 5, 7), (3, 5, 7)),
        ((0, 2), (2,), (), (2,), (2,), (), (0,)),
        ((1, 2), (2,), (), (2,), (2,), (), (1,)),
    ],
)
def test_argument_shapes_broadcast(
    p1: tuple[int, ...],
    v1: tuple[int, ...],
    r1: tuple[int, ...],
    p2: tuple[int, ...],
    v2: tuple[int, ...],
    r2: tuple[int, ...],
    shape: tuple[int, ...],
) -> None:
    """Leading axes broadcast as in NumPy, and each item equals the result of a single call."""
    rng = np.random.default_rng(3)
    args = [
        rng.normal(size=p1),
        rng.normal(size=v1) * 5,
        rng.uniform(0.1, 0.5, r1),
        rng.normal(size=p2) + np.array([3, 0]),
        rng.normal(size=v2) - np.array([5, 0]),
        rng.uniform(0.1, 0.5, r2),
    ]
    times = np.asarray(time_of_impact(*args))
    assert times.shape == shape
    full = [
        np.broadcast_to(a, (*shape, 2) if k % 3 != 2 else shape).reshape((-1, 2) if k % 3 != 2 else -1)
        for k, a in enumerate(args)
    ]
    singles = [time_of_impact(*(a[k] for a in full)) for k in range(times.size)]
    np.testing.assert_array_equal(times.ravel(), np.array(singles, dtype=float))


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
