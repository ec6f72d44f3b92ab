"""Measurement of a machine's noise. The same fixed work is timed repeatedly between the measurements of a bench."""

from __future__ import annotations

import statistics
import time
from dataclasses import dataclass

import numpy as np

#: Intended time of the fixed work on a quiet machine, in seconds. The fixed work takes much longer than the clock's
#: resolution, and much less time than a measured run.
PROBE_S = 1e-3


@dataclass(frozen=True)
class Spread:
    """Median and quartiles of several measurements."""

    median: float
    low: float
    high: float


def compute_spread(values: list[float]) -> Spread:
    """Return the median and the quartiles of some values."""
    low, median, high = (float(q) for q in np.percentile(values, (25, 50, 75)))
    return Spread(median, low, high)


@dataclass(frozen=True)
class Noise:
    """Variation of the time that a machine takes for the same work.

    Attributes:
        work_s: Median time, in seconds.
        interquartile: Range of the middle half of all times, divided by the median.
        worst: Longest time, divided by the median.
        probes: Number of measurements.
    """

    work_s: float
    interquartile: float
    worst: float
    probes: int


class NoiseProbe:
    """Fixed work in plain Python that takes about a millisecond."""

    def __init__(self) -> None:
        self._loops = 1000
        trials = []
        for _ in range(9):
            self._loops = max(1, round(self._loops * PROBE_S / self._time_work()))
            trials.append(self._loops)
        self._loops = round(statistics.median(trials[3:]))  # the first trials are short, and thus inaccurate
        self._times: list[float] = []

    def take(self) -> None:
        """Do the fixed work once and store its run time."""
        self._times.append(self._time_work())

    def compute_noise(self) -> Noise:
        """Return the spread of the measured times. At least one measurement must have been taken."""
        found, times = compute_spread(self._times), self._times
        return Noise(found.median, (found.high - found.low) / found.median, max(times) / found.median, len(times))

    def _time_work(self) -> float:
        started = time.perf_counter()
        total = 0
        for k in range(self._loops):
            total += k & 7
        return time.perf_counter() - started
