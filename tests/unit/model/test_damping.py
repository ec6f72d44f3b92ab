"""The change of time that damping is."""

import math

import mpmath
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.cases import each

from carom.model.damping import UNDAMPED, Damping

RATES = st.floats(1e-6, 1e6)
#: What a product of rate and time may be, so that a speed falls by up to a million.
SPANS = st.floats(1e-20, math.log(1e6))


@given(RATES, SPANS)
def test_both_times_are_those_of_the_law(rate: float, span: float) -> None:
    """The undamped time of an instant is (1 - exp(-c t))/c, and what is left of a speed exp(-c t), to rounding."""
    seconds, damping = span / rate, Damping(rate)
    with mpmath.workprec(200):
        kept = mpmath.exp(-mpmath.mpf(rate) * seconds)
        undamped = -mpmath.expm1(-mpmath.mpf(rate) * seconds) / rate
    # Roundings: of c t (which exp multiplies by up to c t), of exp or expm1 (two of libm's), and of the quotient.
    assert damping.to_undamped(seconds) == pytest.approx(float(undamped), rel=8 * 2.0**-53)
    assert damping.compute_kept_fraction(seconds) == pytest.approx(float(kept), rel=(4 + 2 * span) * 2.0**-53)


@given(RATES, SPANS)
def test_the_latest_undamped_time_is_mapped_to_no_later_instant(rate: float, span: float) -> None:
    """It is the greatest float that is: the next one is mapped beyond."""
    seconds, damping = span / rate, Damping(rate)
    latest = damping.find_latest_undamped(seconds)
    assert damping.to_damped(latest) <= seconds < damping.to_damped(math.nextafter(latest, math.inf))


@each("rate", [5e-324, 1e-300, 1.0, 1e300])
def test_the_end_of_time_is_before_what_is_never_met(rate: float) -> None:
    """The latest undamped time of all is one that is still mapped to a number."""
    damping = Damping(rate)
    assert damping.to_damped(damping.find_latest_undamped(math.inf)) < math.inf
    assert rate * damping.find_latest_undamped(math.inf) < 1.0


@each("seconds", [0.0, 1e-300, 0.1, 1e300])
def test_without_damping_both_times_are_one(seconds: float) -> None:
    """At a rate of 0, and of one so small that no float shows it, times stay as they are, and so do speeds."""
    assert (
        UNDAMPED.to_undamped(seconds)
        == UNDAMPED.to_damped(seconds)
        == UNDAMPED.find_latest_undamped(seconds)
        == seconds
    )
    assert UNDAMPED.compute_kept_fraction(seconds) == 1.0
    assert Damping(5e-324).to_undamped(0.3) == 0.3


def test_before_the_start_discs_were_faster_and_at_the_end_of_the_way_is_nobody() -> None:
    """Backwards speeds grow, until floats end; at 1/c of undamped time and beyond no damped disc gets."""
    assert Damping(2.0).compute_kept_fraction(-1.0) == math.exp(2.0)
    assert Damping(2.0).to_undamped(-1.0) == -math.expm1(2.0) / 2.0
    assert (Damping(1.0).compute_kept_fraction(-1e4), Damping(1.0).to_undamped(-1e4)) == (math.inf, -math.inf)
    assert Damping(0.5).to_damped(2.0) == Damping(0.5).to_damped(3.0) == math.inf
    assert Damping(0.5).to_damped(math.nextafter(2.0, 0.0)) < math.inf
