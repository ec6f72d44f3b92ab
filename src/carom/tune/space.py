"""The space that is searched: the knobs of an engine, each left as it is shipped or turned to one of some values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from carom.adapter import Knob
from carom.runs.job import Tried
from carom.trace import Setting

__all__ = ["Point", "Space", "values_of"]

#: A range is tried at its two ends and so many values between, evenly spread, on the scale of the knob. The ends are
#: among them since they are the best as a rule: off is 0, never is the largest value there is.
BETWEEN = 15

#: Which value each knob is turned to, by its name; a knob that is not in it stays as shipped.
Point = Mapping[str, int]


def values_of(knob: Knob) -> tuple[Setting, ...]:
    """Return the values at which a knob is tried, in order."""
    low, high = knob.low, knob.high
    if low is None or high is None:
        return knob.choices
    parts = [k / (BETWEEN + 1) for k in range(1, BETWEEN + 1)]
    between = [low * (high / low) ** part if knob.log else low + (high - low) * part for part in parts]
    if isinstance(low, int):
        return tuple(dict.fromkeys((low, *map(round, between), high)))
    return (low, *between, high)


@dataclass(frozen=True)
class Space:
    """All points that may be tried.

    Attributes:
        values: The values of each knob, by its name.
    """

    values: Mapping[str, tuple[Setting, ...]]

    def tried(self, point: Point) -> Tried:
        """Return the settings that a point stands for, in order of name."""
        return tuple(sorted((name, self.values[name][k]) for name, k in point.items()))

    def ends(self) -> list[dict[str, int]]:
        """Return the points at which one knob alone is turned, to either end; to any of its choices."""
        return [{name: k} for name, values in self.values.items() for k in self.stops(name)]

    def stops(self, name: str) -> list[int]:
        """Return the ends of a knob's range, or all its choices where these are few."""
        count = len(self.values[name])
        return list(range(count)) if count <= 4 else [0, count - 1]
