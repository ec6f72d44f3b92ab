"""Options of `carom certify`; see `carom.support.options`."""

from __future__ import annotations

from dataclasses import dataclass

from carom.support.options import DeclaredOptions, build_seconds_kind, build_whole_number_kind, declare_option

MOST_DIGITS = 10_000

#: Default of the greatest precision, in bits. The default precision suffices for half a million impacts of 64 discs,
#: which take about an hour to compute.
MAX_PRECISION_BITS = 65536

#: Largest allowed value of the greatest precision: sixteen times the default. One exponential of this precision takes
#: about a second.
MOST_PRECISION_BITS = 2**20

#: If the times of two events agree in this many bits, the run ends. Different times don't agree so closely by chance,
#: because the numbers of a scene have only 53 bits.
TIE_BITS = 512

#: Smallest allowed value of the greatest precision: the 53 bits of floats, rounded up to a power of two.
LEAST_BITS = 64


@dataclass(frozen=True)
class CertifyOptions(DeclaredOptions):
    """Options of a certified run. `carom.certify` explains them.

    Raises:
        InputError: A value is invalid.
    """

    digits: int = declare_option(
        15, build_whole_number_kind(1, MOST_DIGITS), "Decimal digits to prove.", "--digits", "-d"
    )
    max_impacts: int | None = declare_option(
        None, build_whole_number_kind(0), "Stop after this many impacts.", "--max-impacts", "-n"
    )
    time_budget_s: float | None = declare_option(
        None, build_seconds_kind(), "Stop each scene after this many seconds.", "--time-budget", "-t"
    )
    max_precision_bits: int = declare_option(
        MAX_PRECISION_BITS,
        build_whole_number_kind(LEAST_BITS, MOST_PRECISION_BITS),
        "Greatest precision, in bits.",
        "--max-precision",
    )
    tie_bits: int = declare_option(
        TIE_BITS,
        build_whole_number_kind(LEAST_BITS, MOST_PRECISION_BITS),
        "Accuracy, in bits, at which an undecided event ends the run.",
    )
