"""Result of a certified run: the trace, and a radius for each of its numbers."""

from __future__ import annotations

import math
from dataclasses import field
from enum import Enum
from typing import TYPE_CHECKING

from carom.model.trace import body_name
from carom.support.dataclass import dataclass
from carom.support.display import Drawn
from carom.support.equality import ByValue

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from carom.model.trace import Trace


class Ending(Enum):
    """How a certified run ended. Reports show the value as a sentence."""

    COMPLETED = "certified to the end of the scene"
    MAX_IMPACTS = "stopped after the requested number of impacts"
    TIME_BUDGET = "stopped when the time budget was used up"
    PRECISION_CAP = "stopped at the precision limit: the requested digits need more bits than allowed"
    INTERRUPTED = "interrupted; the impacts certified before are kept"
    DEGENERATE = "stopped at an event that has no certain answer"


class Degenerate(Enum):
    """Why an event has no certain answer. Reports show the value as a sentence."""

    SHARED_INSTANT = "a disc has two impacts at one instant, and their order may matter"
    TOUCHING_START = "two bodies touch exactly at the start and move towards each other"
    OVERLAPPING_START = "two bodies overlap at the start, by no more than rounding, and move towards each other"
    RESTING_CONTACT = "two bodies already in contact are pressed together"
    GRAZE = "two bodies pass each other at nearly the contact distance, and it cannot be decided whether they touch"
    SIMULTANEOUS_NEIGHBOURS = "two simultaneous impacts are so close together that they may not be independent"
    AT_A_TURN = "it cannot be decided whether an impact is before or after a driven body turns"
    AT_THE_END = "it cannot be decided whether an impact is before or after the end of the scene"
    MODE = "a disc in contact is so near the limit of friction that its further motion cannot be decided"
    EDGE = "a disc reaches the end of a straight edge and does not fly off: its motion around the end is not computed"
    COLLAPSE = "infinitely many impacts in a finite time (inelastic collapse)"
    CRUSH = "two bodies crush a disc or a row of discs, after infinitely many impacts"


@dataclass(frozen=True)
class Degeneracy:
    """Event at which a certified run stops.

    Attributes:
        kind: Kind of event.
        bodies: The bodies that take part, in ascending order; walls as `carom.model.trace.wall_body`.
        earliest_s: Lower bound of the event's time, seconds.
        latest_s: Upper bound of the event's time, seconds. Infinity if a graze may not be a contact at all; for a
            collapse, the last of the counted impacts.
        proven: Whether exact arithmetic proves the kind. Otherwise the event was not decided although the state was
            known to `bits` bits.
        bits: Bits to which the state of the bodies was known.
    """

    kind: Degenerate
    bodies: tuple[int, ...]
    earliest_s: float
    latest_s: float
    proven: bool
    bits: int

    def __str__(self) -> str:
        names = ", ".join(map(body_name, self.bodies))
        when = f"at {self.earliest_s:.17g} s"
        if self.latest_s != self.earliest_s:
            when = f"between {self.earliest_s:.17g} and {self.latest_s:.17g} s"
        how = "proven exactly" if self.proven else f"not decided with the state known to {self.bits} bits"
        return f"{self.kind.value}: {names}, {when} ({how})"


class Undecided(Exception):  # noqa: N818 - not an error: a signal to look closer
    """The next event is not decided at this precision. Contains the report if no precision decides it."""

    def __init__(self, degeneracy: Degeneracy) -> None:
        super().__init__(str(degeneracy))
        self.degeneracy = degeneracy


@dataclass(frozen=True, repr=False, eq=False)
class CertifiedTrace(ByValue, Drawn):
    """A trace with a proven bound on the error of every number. Compared by value; there is no hash.

    Attributes:
        trace: The method is "certified". Each number is the float64 nearest to the middle of the ball that is proven to
            contain the true value. The trace ends with the last certified impact, or with the scene.
        radii: Structured array shaped like ``trace.impacts``: the greatest difference of each number from the true
            value, rounding to float64 included. The fields `first` and `second` repeat the bodies.
        final_position_radius_m: Radii of `trace.final_position_m`, shape ``(n, 2)``.
        final_velocity_radius_m_s: Radii of `trace.final_velocity_m_s`, shape ``(n, 2)``.
        spin_radii: Radii of ``trace.spins``, a structured array; None if ``trace.spins`` is None.
        final_spin_radius_rad_s: Radii of `trace.final_spin_rad_s`, shape ``(n,)``.
        mode_radii: Radii of ``trace.modes``, a structured array; None if ``trace.modes`` is None.
        digits: The requested decimal digits.
        decimals: For more than 15 digits: time and velocities after each impact, ``(t, x1, y1, x2, y2)``, and the spins
            of its discs after it if anything turns. Every digit of these decimal numbers is right, to one unit in the
            last digit. Empty if float64 can represent the digits.
        ending: How the run ended.
        degeneracy: The event that stopped the run; None if the run was not stopped.
        commuted: Pairs of indices of impacts whose order is unknown and irrelevant.
        precision_bits: Initial bits of the last attempt.
        bits_lost: Bits of accuracy lost in the worst disc until the end.
        replays: Number of restarts at a higher precision.
        elapsed_s: Elapsed seconds; not compared.

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
    """Return a value known to within `radius`, with as many digits as are proven.

    With k decimals the true value is within ``radius + 10^-k / 2`` of the shown one. k is chosen so that this is at
    most one unit in the last digit. If not even the first digit is proven, a bound is shown instead.
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
