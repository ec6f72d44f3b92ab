"""Search space: the searchable settings (knobs) that an adapter declares, and their tested values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from carom.engines.api import Knob
from carom.execution.job import SettingOverrides
from carom.model.trace import Setting

#: Number of tested values between the two ends of a setting's range, evenly spread on its linear or logarithmic scale.
#: Both ends are also tested, because they often disable a feature.
BETWEEN = 15

#: During refinement, the range of each setting is divided into `STOPS` equal parts. The values at the ends of the parts
#: are tested, and the `NEAR` next values on both sides of the present value.
STOPS, NEAR = 4, 2

#: A point of the search space: a mapping from the names of changed settings to indices of their values. Other settings
#: keep their default.
Point = Mapping[str, int]


def list_values(knob: Knob) -> tuple[Setting, ...]:
    """Return the values at which a setting is tested, in order."""
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
    """All points that the search may test.

    Attributes:
        values: The values of each setting, by the setting's name.
    """

    values: Mapping[str, tuple[Setting, ...]]

    def settings_of(self, point: Point) -> SettingOverrides:
        """Return the settings of a point, sorted by name."""
        return tuple(sorted((name, self.values[name][k]) for name, k in point.items()))

    def point_of(self, overrides: SettingOverrides) -> dict[str, int]:
        """Return the point with the given settings."""
        return {name: self.values[name].index(value) for name, value in overrides}

    def list_end_points(self) -> list[dict[str, int]]:
        """Return all points that change a single setting, to its first or to its last value."""
        return [{name: k} for name, values in self.values.items() for k in dict.fromkeys((0, len(values) - 1))]

    def neighbours(self, point: Point) -> Iterator[dict[str, int]]:
        """Yield the points that differ from `point` in one setting.

        The changed setting keeps the first profile's value, or has a value at the end of one of the `STOPS` parts, or a
        value near its present value.
        """
        for name, values in self.values.items():
            last, current_index = len(values) - 1, point.get(name)
            without = {other: k for other, k in point.items() if other != name}
            stops = {round(last * part / STOPS) for part in range(STOPS + 1)}
            if current_index is not None:
                yield without
                stops |= {k for k in range(current_index - NEAR, current_index + NEAR + 1) if 0 <= k <= last}
            yield from ({**without, name: k} for k in sorted(stops - {current_index}))
