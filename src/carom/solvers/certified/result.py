"""Result of a certified run: a trace, and an error bound (called radius) for each number of the trace."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from carom.model.trace import Trace, body_name
from carom.support.display import Drawn
from carom.support.equality import ByValue


class Ending(Enum):
    """How a certified run ended. Reports contain the text of a member."""

    COMPLETED = "certified to the end of the scene"
    MAX_IMPACTS = "stopped after the requested number of impacts"
    TIME_BUDGET = "stopped when the time budget was used up"
    PRECISION_CAP = "stopped at the precision limit: the requested digits need more bits than allowed"
    INTERRUPTED = "interrupted; the impacts certified before are kept"
    DEGENERATE = "stopped at an event after which the motion is uncertain"


class Degenerate(Enum):
    """Why the motion after an event is uncertain. Reports contain the text of a member."""

    SHARED_INSTANT = "a disc has two impacts at one instant, and their order may matter"
    TOUCHING_START = "two bodies touch exactly at the start and move towards each other"
    OVERLAPPING_START = "two bodies overlap at the start, by no more than rounding, and move towards each other"
    RESTING_CONTACT = "two bodies already in contact are pressed together"
    GRAZE = "two bodies pass each other at nearly the contact distance, and it cannot be decided whether they touch"
    SIMULTANEOUS_NEIGHBOURS = "two simultaneous impacts are so close together that they may not be independent"
    AT_A_TURN = "it cannot be decided whether an impact is before or after a moving body changes its velocity"
    AT_THE_END = "it cannot be decided whether an impact is before or after the end of the scene"
    MODE = "a disc in contact is so near the limit of friction that its further motion cannot be decided"
    EDGE = "a disc reaches the end of a straight edge and does not fly off: its motion around the end is not computed"
    COLLAPSE = "infinitely many impacts in a finite time (inelastic collapse)"
    CRUSH = "two bodies crush a disc or a row of discs, after infinitely many impacts"


@dataclass(frozen=True)
class Degeneracy:
    """An event at which a certified run stops, because the motion after it is uncertain.

    Attributes:
        kind: Kind of event.
        bodies: The bodies of the event, in ascending order. Walls are numbered as by `carom.model.trace.wall_body`.
        earliest_s: Earliest possible time of the event, in seconds.
        latest_s: Latest possible time of the event, in seconds. For a collapse, `latest_s` is the time of the last
            counted impact. For a graze that may be no contact, `latest_s` is infinity.
        proven: Whether exact arithmetic proves this event. Without a proof, the event is undecided although the state
            of the bodies is known to `bits` bits.
        bits: Accuracy of the state of the bodies, in bits.
    """

    kind: Degenerate
    bodies: tuple[int, ...]
    earliest_s: float
    latest_s: float
    proven: bool
    bits: int

    def __str__(self) -> str:
        names = ", ".join(map(body_name, self.bodies))
        time_text = f"at {self.earliest_s:.17g} s"
        if self.latest_s != self.earliest_s:
            time_text = f"between {self.earliest_s:.17g} and {self.latest_s:.17g} s"
        how = "proven exactly" if self.proven else f"undecided although the state is known to {self.bits} bits"
        return f"{self.kind.value}: {names}, {time_text} ({how})"


class Undecided(Exception):  # noqa: N818 - a signal that more precision may be needed, not an error
    """Signal that a higher precision may be needed to decide which event is next.

    `degeneracy` is reported if the event is undecided with the greatest precision.
    """

    def __init__(self, degeneracy: Degeneracy) -> None:
        super().__init__(str(degeneracy))
        self.degeneracy = degeneracy


@dataclass(frozen=True, repr=False, eq=False)
class CertifiedTrace(ByValue, Drawn):
    """A trace with a proven error bound for every number. Traces are compared by value and are not hashable.

    Attributes:
        trace: The trace, whose field `method` is "certified". The trace ends at the end of the scene or at the last
            certified impact. Each number differs from its true value by at most its radius.
        radii: Structured array like ``trace.impacts`` with the bound of each number's error, including float rounding.
            The fields `first` and `second` are the numbers of the bodies.
        final_position_radius_m: Error bounds of `trace.final_position_m`, shape ``(n, 2)``.
        final_velocity_radius_m_s: Error bounds of `trace.final_velocity_m_s`, shape ``(n, 2)``.
        spin_radii: Error bounds of ``trace.spins``, as a structured array; None if ``trace.spins`` is None.
        final_spin_radius_rad_s: Error bounds of `trace.final_spin_rad_s`, shape ``(n,)``.
        mode_radii: Error bounds of ``trace.modes``, as a structured array; None if ``trace.modes`` is None.
        digits: The requested decimal digits.
        decimals: Decimal numbers for each impact: the time and the velocities after the impact ``(t, x1, y1, x2, y2)``.
            If any disc turns, the spins of the discs follow. Errors are at most one unit in the last digit. Up to 15
            digits, the tuple is empty, because floats suffice.
        ending: How the run ended.
        degeneracy: The event that stopped the run early; None if the run reached its end.
        commuted: Pairs of indices of impacts whose order is unknown and does not affect the result.
        precision_bits: Precision at the start of the last attempt, in bits.
        bits_lost: Number of accurate bits that the least accurate disc lost until the end.
        replays: Number of restarts with a higher precision.
        elapsed_s: Elapsed seconds. The comparison of two traces ignores this field.

    Examples:
        >>> found = carom.certify("classics/gas", max_impacts=3)
        >>> len(found.trace.impacts)
        3
    """

    trace: Trace
    radii: NDArray[np.void]
    final_position_radius_m: NDArray[np.float64]
    final_velocity_radius_m_s: NDArray[np.float64]
    digits: int
    ending: Ending
    decimals: tuple[tuple[str, ...], ...] = ()
    degeneracy: Degeneracy | None = None
    commuted: tuple[tuple[int, int], ...] = ()
    precision_bits: int = 0
    bits_lost: float = 0.0
    replays: int = 0
    elapsed_s: float = field(default=0.0, compare=False)
    spin_radii: NDArray[np.void] | None = None
    final_spin_radius_rad_s: NDArray[np.float64] | None = None
    mode_radii: NDArray[np.void] | None = None

    def __len__(self) -> int:
        return len(self.trace.impacts)


def proven_decimal(value: float, radius: float) -> str:
    """Return a value, whose error is at most `radius`, as a decimal number with all proven digits.

    With k decimals, the decimal number differs from the true value by at most ``radius + 10^-k / 2``. Here k is the
    largest number for which this bound is at most one unit in the last digit. If no digit is proven, the text is a
    bound.
    """
    if radius == 0.0:
        return repr(value)
    decimals = math.floor(-math.log10(2.0 * radius))
    if 10.0**-decimals < 2.0 * radius:  # the logarithm was rounded up
        decimals -= 1
    significant = decimals + math.floor(math.log10(abs(value))) if value else -1
    if significant < 0:
        return f"0 (within {abs(value) + radius:.1e})"
    if 1e-4 <= abs(value) < 1e16:
        return f"{round(value, decimals):.{max(decimals, 0)}f}"
    return f"{value:.{significant}e}"
