"""Phases (shifts of a scene by fractions of a step), and the distribution of scores over many phases.

At a single phase, an engine can find or miss an impact by chance. `carom.comparator.shifted_scenes` computes the
shifted scenes.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from carom.comparator import Score
from carom.model.scene import Scene

#: Fractional part of the golden ratio, whose multiples modulo 1 fill the interval from 0 to 1 most evenly.
_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


@dataclass(frozen=True, slots=True)
class PhaseSpread:
    """Distribution of the scores of one scene, method and step size over many phases.

    Attributes:
        phases: Number of phases that ran.
        wrong: Number of phases in which the engine misses or invents an impact.
        missed: Number of phases with a missed impact.
        velocity_median: Median of the phases' largest velocity errors, divided by the scene's speed; NaN if no velocity
            error is known.
        velocity_worst: Largest velocity error over all phases, divided by the scene's speed.
        time_median_s: Median of the phases' largest errors of an impact's time, in seconds, without sign.
        time_worst_s: Largest error of an impact's time over all phases, in seconds, without sign.
        pit_miss_probability: Fraction of all possible phases in which PIT misses the impact. The fraction is computed
            by a formula for two discs that meet on straight paths, and is NaN for other scenes.
    """

    phases: int
    wrong: int
    missed: int
    velocity_median: float
    velocity_worst: float
    time_median_s: float
    time_worst_s: float
    pit_miss_probability: float

    @property
    def miss_probability(self) -> float:
        """Number of phases with a missed impact, divided by the number of phases that ran."""
        return self.missed / self.phases if self.phases else math.nan


def generate_phases(count: int, seed: int = 0) -> tuple[float, ...]:
    """Return quasi-random phases: multiples of the golden ratio, plus an offset that depends on the seed, modulo 1."""
    if not count:  # return early, since loading numpy.random takes longer than a short run
        return ()
    start = float(np.random.default_rng(seed).random())
    return tuple((start + k * _GOLDEN) % 1.0 for k in range(count))


def compute_pit_miss_probability(scene: Scene, dt_s: float) -> float:
    """Return the fraction of all possible phases in which PIT misses the impact of two discs; NaN if they don't meet.

    PIT detects the impact if one of its checks happens while the discs overlap and approach. The discs overlap and
    approach for a time T. For straight paths and constant speeds, ``T = sqrt(R^2 - b^2) / u``. R is the sum of the
    radii, b is the smallest distance of the centres, and u is the relative speed. PIT finds the impact with the
    probability ``min(1, T / dt_s)``.
    """
    if len(scene.discs) != 2 or scene.walls or scene.damping_per_s or scene.table_deceleration_m_s2:
        return math.nan
    first, second = scene.discs
    if first.legs or second.legs:
        return math.nan
    if any(scene.gravity_m_s2) and first.immovable is not second.immovable:
        return math.nan  # only one disc falls, so the relative path is not straight
    d = np.subtract(second.position_m, first.position_m)
    u = np.subtract(second.velocity_m_s, first.velocity_m_s)
    speed = math.hypot(*u)
    if not float(d @ u) < 0.0:
        return math.nan
    offset = abs(float(d[0] * u[1] - d[1] * u[0])) / speed
    reach = first.radius_m + second.radius_m
    if offset >= reach:
        return math.nan
    half_chord = math.sqrt((reach - offset) * (reach + offset))
    if -float(d @ u) / speed - half_chord > speed * scene.duration_s:
        return math.nan  # the discs meet after the end of the run
    return max(0.0, 1.0 - half_chord / (speed * dt_s))


def compute_spread(scores: Sequence[Score], scene: Scene, dt_s: float) -> PhaseSpread:
    """Return the distribution of scores at many phases. All scores belong to one scene, method and step size."""
    velocities = [s.total.velocity for s in scores if not math.isnan(s.total.velocity)]
    times = [abs(s.total.time_s) for s in scores if not math.isnan(s.total.time_s)]
    return PhaseSpread(
        phases=len(scores),
        wrong=sum(bool(s.missed or s.spurious) for s in scores),
        missed=sum(bool(s.missed) for s in scores),
        velocity_median=statistics.median(velocities) if velocities else math.nan,
        velocity_worst=max(velocities, default=math.nan),
        time_median_s=statistics.median(times) if times else math.nan,
        time_worst_s=max(times, default=math.nan),
        pit_miss_probability=compute_pit_miss_probability(scene, dt_s),
    )
