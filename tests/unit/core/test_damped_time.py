"""Exponentials and logarithms are the floats nearest to those that mpmath has to 400 bits."""

import math

import mpmath
import pytest
from hypothesis import given
from hypothesis import strategies as st

core_functions = pytest.importorskip("tests.core_functions")
exp, expm1, logs1p = core_functions.exp, core_functions.expm1, core_functions.logs1p

#: From the smallest for which damping asks, 2**-54, on.
DECAYS = st.floats(-708.0, -(2.0**-54))
ABOVE = st.floats(-1.0, -(2.0**-54), exclude_min=True) | st.floats(-1.0 + 2.0**-53, -1.0 + 2.0**-40)


def _compute_nearest_float(name: str, x: float) -> float:
    with mpmath.workprec(400):
        return float(getattr(mpmath, name)(mpmath.mpf(x)))


@given(DECAYS | st.floats(-1.0, -(2.0**-54)) | st.floats(2.0**-54, 709.0))
def test_exp_and_expm1_are_correctly_rounded(x: float) -> None:
    """`exp` and `expm1` return the float nearest to mpmath's value at 400 bits."""
    assert exp(x) == _compute_nearest_float("exp", x)
    assert expm1(x) == _compute_nearest_float("expm1", x)


@given(ABOVE, st.lists(st.floats(0.0, 1.0).map(lambda part: part**16), max_size=20))
def test_logs1p_is_correctly_rounded(x: float, parts: list[float]) -> None:
    """`logs1p` rounds each logarithm of a list correctly, also one that is computed from the previous one."""
    numbers = [x]
    for part in parts:
        numbers.append(numbers[-1] - part * (1.0 + numbers[-1]))
    numbers = [number for number in numbers if -1.0 < number <= -(2.0**-54)]
    assert logs1p(numbers) == [_compute_nearest_float("log1p", number) for number in numbers]


def test_exp_and_expm1_of_extreme_arguments() -> None:
    """`exp` and `expm1` return 0 and -1 far below 0, infinity on overflow, and NaN for NaN."""
    assert (exp(-709.0), exp(-math.inf), expm1(-1e300), expm1(-math.inf)) == (0.0, 0.0, -1.0, -1.0)
    assert math.isnan(exp(math.nan))
    assert math.isnan(expm1(math.nan))
    for power in (exp, expm1):
        assert power(711.0) == power(1e300) == math.inf
