"""What a check says: the rules, what broke one, and how far rounding got."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from tests.checker.watch import Stretch

Floats = NDArray[np.float64]

#: Every rule, and what it demands.
RULES = {
    "row": "two distinct bodies that there are, the first a disc, one of them movable, all numbers finite",
    "count": "as many impacts are recorded as the run says that there were",
    "order": "no impact before the one before it, or outside its stretch",
    "history": "velocities and spins before are those after the body's last impact, bit for bit where nothing falls",
    "contact": "the two bodies touch",
    "approach": "the two bodies approach",
    "normal": "the normal is the line of centres, or the wall's",
    "law": "velocities and spins after are those of the laws of restitution and friction, which conserve momentum",
    "passed": "no two bodies overlap, at any time",
    "state": "the run's own state is the one that its impacts lead to",
    "end": "the run goes on to its end, or to a disc that rests, and raises nothing",
}


@dataclass(frozen=True)
class Violation:
    """One rule broken once.

    Attributes:
        rule: Name of the rule in `RULES`.
        row: The impact, counted from the start of the run; -1 where it is none.
        bodies: Whom it concerns, a wall as ``-1 - k``.
        time_s: When.
        size: How far it is from what must hold: metres, metres per second or a pure number.
        bound: How far rounding can have it off.
        note: What else is known of it.
    """

    rule: str
    row: int
    bodies: tuple[int, ...]
    time_s: float
    size: float
    bound: float
    note: str = ""

    def __str__(self) -> str:
        place = f"impact {self.row}" if self.row >= 0 else "no impact"
        bodies = ", ".join(map(str, self.bodies))
        note = f"; {self.note}" if self.note else ""
        return (
            f"{self.rule}: {RULES[self.rule]}; {place}, bodies {bodies}, at {self.time_s!r} s: "
            f"off by {self.size:.3g}, rounding explains {self.bound:.3g}{note}"
        )


@dataclass
class Report:
    """What has been checked, and what was found.

    Attributes:
        impacts: Number of impacts checked.
        violations: All rules broken, in order of time within a stretch.
        worst_gap: Largest distance from contact at an impact, in units of its bound.
        worst_overlap: Deepest overlap at any time, in units of its bound.
        pairs: Pairs of flights that were near enough to be compared with each other.
        elastic: Impacts that the TC model makes elastic.
    """

    impacts: int = 0
    violations: list[Violation] = field(default_factory=list)
    worst_gap: float = 0.0
    worst_overlap: float = 0.0
    pairs: int = 0
    elastic: int = 0


def largest_ratio(size: Floats, bound: Floats) -> float:
    """Return the largest size in units of its bound; NaN counts as infinite."""
    if not len(size):
        return 0.0
    ratio = np.abs(size) / bound
    return float(np.where(np.isnan(ratio), np.inf, ratio).max())


def find_violations(rule: str, stretch: Stretch, size: Floats, bound: Floats) -> list[Violation]:
    """Return a violation for each impact whose size exceeds its bound, or is NaN."""
    return [
        build_violation(rule, stretch, k, float(size[k]), float(bound[k]))
        for k in np.flatnonzero(~(size <= bound)).tolist()
    ]


def build_violation(rule: str, stretch: Stretch, k: int, size: float, bound: float) -> Violation:
    row = stretch.impacts[k]
    bodies = (int(row["first"]), int(row["second"]))
    return Violation(rule, stretch.first_row + int(k), bodies, float(row["time_s"]), size, bound)
