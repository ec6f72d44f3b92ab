"""The change of time that damping is."""

import math

import mpmath
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.cases import each

from carom.model.damping import Damping

RATES = st.floats(1e-6, 1e6)
#: What a product of rate and time may be, so that a speed falls by up to a million.
SPANS = st.floats(1e-20, math.log(1e6))


@given(RATES, SPANS)
def test_damping_follows_its_law(rate: float, span: float) -> None:
    """The undamped time of t is (1 - exp(-c t))/c, and the kept fraction of a speed exp(-c t), within rounding."""
    seconds, damping = span / rate, Damping(rate)
    with mpmath.workprec(200):
        kept = mpmath.exp(-mpmath.mpf(rate) * seconds)
        undamped = -mpmath.expm1(-mpmath.mpf(rate) * seconds) / rate
    # Roundings: of c t (which exp multiplies by up to c t), of exp or expm1 (two of libm's), and of the quotient.
    assert damping.to_undamped(seconds) == pytest.approx(float(undamped), rel=8 * 2.0**-53)
    assert damping.compute_kept_fraction(seconds) == pytest.approx(float(kept), rel=(4 + 2 * span) * 2.0**-53)


@given(RATES, SPANS)
def test_latest_undamped_time_is_not_after_its_instant(rate: float, span: float) -> None:
    """The latest undamped time maps to at most the given instant, and the next larger float to a later one."""
    seconds, damping = span / rate, Damping(rate)
    latest = damping.find_latest_undamped(seconds)
    assert damping.to_damped(latest) <= seconds < damping.to_damped(math.nextafter(latest, math.inf))


@each("rate", [5e-324, 1e-300, 1.0, 1e300])
def test_latest_undamped_time_of_all_is_mapped_to_a_number(rate: float) -> None:
    """The latest undamped time before infinity is mapped to a finite instant and is below 1/c."""
    damping = Damping(rate)
    assert damping.to_damped(damping.find_latest_undamped(math.inf)) < math.inf
    assert rate * damping.find_latest_undamped(math.inf) < 1.0


def test_damping_before_the_start_and_at_the_end_of_the_way() -> None:
    """Before the start speeds are larger, up to infinity, and the undamped time 1/c is reached at infinity only."""
    assert Damping(2.0).compute_kept_fraction(-1.0) == math.exp(2.0)
    assert Damping(2.0).to_undamped(-1.0) == -math.expm1(2.0) / 2.0
    assert (Damping(1.0).compute_kept_fraction(-1e4), Damping(1.0).to_undamped(-1e4)) == (math.inf, -math.inf)
    assert Damping(0.5).to_damped(2.0) == Damping(0.5).to_damped(3.0) == math.inf
    assert Damping(0.5).to_damped(math.nextafter(2.0, 0.0)) < math.inf
    assert Damping(5e-324).to_undamped(0.3) == 0.3
