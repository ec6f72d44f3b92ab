"""Digits of a certified run that are recorded and shown: those that are proven."""

from fractions import Fraction

from flint import arb
from hypothesis import assume, given
from hypothesis import strategies as st
from tests.cases import each
from tests.scene_builders import build_line_scene

from carom.solvers.certified.impacts import BallEvent, BallImpact
from carom.solvers.certified.recording import Recording
from carom.solvers.certified.result import proven_decimal


@given(st.floats(-1e20, 1e20), st.floats(1e-300, 1e3), st.floats(-1, 1))
def test_displayed_digits_are_right_to_one_unit_in_the_last(value: float, radius: float, where: float) -> None:
    """A displayed number is within one unit in its last digit of every value in its ball."""
    text = proven_decimal(value, radius)
    assume("within" not in text)
    digits, _, exponent = text.partition("e")
    decimals = len(digits.partition(".")[2])
    unit = Fraction(10) ** (int(exponent or 0) - decimals)
    if "." not in text and not exponent:  # zeros before the point would replace digits that are not proven
        unit = Fraction(10) ** (len(text) - len(text.rstrip("0")))
    truth = Fraction(value) + Fraction(radius) * Fraction(where)
    assert abs(Fraction(text) - truth) <= unit


@each(
    "value, radius, text",
    [
        (0.125, 0.0, "0.125"),
        (0.123456, 1e-4, "0.123"),
        (0.123456, 4e-5, "0.1235"),
        (-1234.5, 0.4, "-1234"),
        (1e-9, 1e-12, "1.00e-09"),
        (1e-9, 1e-8, "0 (within 1.1e-08)"),
    ],
)
def test_proven_decimal_shows_only_proven_digits(value: float, radius: float, text: str) -> None:
    """`proven_decimal` shows the digits that a radius proves, or a bound if it proves none."""
    # A radius of up to half a unit proves a digit. Below 1e-4 an exponent is used.
    assert proven_decimal(value, radius) == text


# What is recorded of a certified run is known to the digits asked for, or is not recorded -----------------------------


EXACT = tuple(map(arb, (0, 0, 1, 0)))


@each("radius, known", [(1e-5, False), (2e-6, False), (1e-6, True), (0.0, True)])
def test_impact_is_recorded_only_if_its_digits_are_known(radius: float, known: bool) -> None:
    """With six digits, an impact at 1.5 s is recorded with a time error of 1 us, but not with 2 us."""
    # Exact velocities do not make up for an uncertain time.
    log = Recording(build_line_scene(0.0, 4.0, velocities=(1.0, 0.0)), 6)
    log.add(BallEvent(BallImpact(0, 1, arb(1.5, radius), arb(1), arb(0), arb(1), EXACT)))  # type: ignore[arg-type] # four
    assert log.convert() is known
    assert len(log) == known
