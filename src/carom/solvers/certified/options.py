"""Options of a certified run: see `carom.support.options`."""

from __future__ import annotations

from carom.support.dataclass import dataclass
from carom.support.options import DeclaredOptions, option, seconds, whole

MOST_DIGITS = 10_000

#: Default largest precision. This precision is enough for half a million impacts of 64 discs at packing .4, in about an
#: hour.
MAX_PRECISION_BITS = 65536

#: Limit of the largest precision: sixteen times the default. One exponential of a number of this length takes about a
#: second. ctx.prec, a C long, can be far larger.
MOST_PRECISION_BITS = 2**20

#: If two times agree in this many bits, they do not agree by accident, since a start has 53 bits.
TIE_BITS = 512

#: The least precision: the bits of floats, rounded up to a word.
LEAST_BITS = 64


@dataclass(frozen=True)
class CertifyOptions(DeclaredOptions):
    """Options of a certified run, except its scene: see `carom.certify`.

    Raises:
        InputError: A value is invalid.
    """

    digits: int = option(15, whole(1, MOST_DIGITS), "Decimal digits to prove.", "--digits", "-d")
    max_impacts: int | None = option(None, whole(0), "Stop after this many impacts.", "--max-impacts", "-n")
    time_budget_s: float | None = option(
        None, seconds(), "Stop each scene after this many seconds.", "--time-budget", "-t"
    )
    max_precision_bits: int = option(
        MAX_PRECISION_BITS,
        whole(LEAST_BITS, MOST_PRECISION_BITS),
        "Greatest precision, in bits.",
        "--max-precision",
    )
    tie_bits: int = option(
        TIE_BITS, whole(LEAST_BITS, MOST_PRECISION_BITS), "Bits after which an undecided event ends the run."
    )
