"""Where in a step the impact falls: one scene run at many sub-step phases, scored as a distribution.

One phase makes a step look lucky or unlucky. The scene is shifted along its own motion by a part of a step, so that
nothing changes but when, within a step, its first impact comes.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from carom.comparator import Score
from carom.comparator.finite import not_finite
from carom.errors import InputError, SceneError
from carom.scene import Scene
from carom.solvers.pic import solve_pic
from carom.trace import Trace, Vector

__all__ = [
    "PhaseSpread",
    "Shifted",
    "begun_earlier",
    "even_phases",
    "phase_values",
    "pit_miss_probability",
    "shifted_scenes",
    "spread_of",
]

#: Of all numbers the golden ratio is the worst to approximate by fractions: its multiples leave no gap long unfilled.
_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


@dataclass(frozen=True)
class Shifted:
    """A scene shifted along its own motion, and its reference."""

    phase: float
    scene: Scene
    reference: Trace


@dataclass(frozen=True)
class PhaseSpread:
    """The scores of one cell over many phases.

    Attributes:
        phases: How many phases ran.
        wrong: In how many an impact was missed or invented.
        missed: In how many an impact was missed.
        velocity_median: Median over phases of the largest velocity error, over the scene's speed; NaN without any.
        velocity_worst: The largest.
        time_median_s: Median over phases of the magnitude of the largest time error, seconds.
        time_worst_s: The largest.
        pit_miss_probability: In what share of all phases PIT misses the impact, by closed form; NaN where the scene is
            not of two discs that meet.
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
        """Share of the phases in which an impact was missed."""
        return self.missed / self.phases if self.phases else math.nan


def even_phases(count: int) -> tuple[float, ...]:
    """Return so many phases, evenly spread over a step, the first of them 0.

    Raises:
        InputError: `count` is below 1.
    """
    if count < 1:
        raise InputError(f"phases must be 1 or more, got {count}")
    return tuple(k / count for k in range(count))


def phase_values(count: int, seed: int = 0) -> tuple[float, ...]:
    """Return quasi-random phases in 0 to 1: multiples of the golden ratio from a start that the seed draws."""
    start = float(np.random.default_rng(seed).random())
    return tuple((start + k * _GOLDEN) % 1.0 for k in range(count))


def shifted_scenes(reference: Trace, dt_s: float, phases: Sequence[float]) -> tuple[Shifted, ...]:
    """Shift a scene along its own motion to each phase; what can't be shifted so is left out.

    All discs are taken ``phase * dt`` ahead along their paths, and the duration is shortened by as much; where an
    impact comes before that, they are taken back by the rest of the step instead. A shift that changes which impacts
    happen (because the way back leads through another body, or the last impact falls past the end) is none.

    Args:
        reference: The scene's PIC trace.
        dt_s: The step, seconds.
        phases: Parts of a step, 0 to 1.
    """
    scene = reference.scene
    first = float(reference.impacts["time_s"][0]) if len(reference.impacts) else math.inf
    found = []
    for phase in phases:
        ahead = phase * dt_s
        shift = ahead if ahead < min(first, scene.duration_s) else ahead - dt_s
        try:
            moved = _shifted(scene, shift)
        except SceneError:
            continue
        trace = solve_pic(moved, max_impacts=len(reference.impacts) + 1)
        same = np.array_equal(trace.impacts[["first", "second"]], reference.impacts[["first", "second"]])
        if same and not not_finite(trace):
            found.append(Shifted(phase, moved, trace))
    return tuple(found)


def begun_earlier(scene: Scene, by_s: float) -> Scene:
    """Return the scene begun `by_s` seconds earlier: every disc moved back along its path, the end where it was.

    The same impacts follow, `by_s` later each. Where bodies would have met on the way back (those of a cradle that
    touch at the start, say) the scene begins later instead, if nothing is to happen before.

    Args:
        scene: The scene.
        by_s: Seconds, 0 or more.

    Raises:
        InputError: Bodies meet within `by_s` both before the start and after it.
    """
    if by_s == 0.0:
        return scene
    for shift_s in (-by_s, by_s):
        if shift_s < scene.duration_s and _nothing_meets(scene, shift_s):
            return _shifted(scene, shift_s)
    raise InputError(
        f"the scene can't begin {by_s:.3g} s earlier or later: bodies meet within that time on either side"
    )


def _nothing_meets(scene: Scene, shift_s: float) -> bool:
    """Whether nothing meets between the start and `shift_s` after it, or before it where that is negative."""
    ahead = scene if shift_s > 0 else _reversed(scene)
    return len(solve_pic(ahead, max_impacts=1, until_s=abs(shift_s)).impacts) == 0


def _reversed(scene: Scene) -> Scene:
    """Return the scene that runs the path before the start backwards; a parabola is the same one either way."""
    return _with_states(scene, [(d.position_m, (-d.velocity_m_s[0], -d.velocity_m_s[1])) for d in scene.discs])


def _shifted(scene: Scene, shift_s: float) -> Scene:
    """Return the scene as it stands `shift_s` after its start if nothing meets before, its end where it was."""
    gx, gy = scene.gravity_m_s2
    states = []
    for disc in scene.discs:
        (x, y), (u, v) = disc.position_m, disc.velocity_m_s
        place = (x + u * shift_s + 0.5 * gx * shift_s * shift_s, y + v * shift_s + 0.5 * gy * shift_s * shift_s)
        velocity = (u + gx * shift_s, v + gy * shift_s)
        states.append((disc.position_m, disc.velocity_m_s) if disc.immovable else (place, velocity))
    return _with_states(scene, states, duration_s=scene.duration_s - shift_s)


def _with_states(scene: Scene, states: Sequence[tuple[Vector, Vector]], **fields: float) -> Scene:
    discs = [
        {**disc.model_dump(), "position_m": place, "velocity_m_s": velocity}
        for disc, (place, velocity) in zip(scene.discs, states, strict=True)
    ]
    return Scene(**{**scene.model_dump(), "discs": discs, **fields})


def pit_miss_probability(scene: Scene, dt_s: float) -> float:
    """Return in what share of all phases PIT misses the impact of two discs at a step: NaN where none is to be missed.

    PIT sees them overlap and approach for half the chord, ``sqrt(R^2 - b^2)`` at the relative speed; a frame falls into
    that for certain where it lasts a step, and with the probability of its length in steps where it does not.
    """
    if len(scene.discs) != 2 or scene.walls:
        return math.nan
    one, two = scene.discs
    d = np.subtract(two.position_m, one.position_m)
    u = np.subtract(two.velocity_m_s, one.velocity_m_s)
    speed = math.hypot(*u)
    if not float(d @ u) < 0.0:
        return math.nan
    offset = abs(float(d[0] * u[1] - d[1] * u[0])) / speed
    reach = one.radius_m + two.radius_m
    if offset >= reach:
        return math.nan
    half_chord = math.sqrt((reach - offset) * (reach + offset))
    return max(0.0, 1.0 - half_chord / (speed * dt_s))


def spread_of(scores: Sequence[Score], scene: Scene, dt_s: float) -> PhaseSpread:
    """Return the distribution of scores of one cell over phases."""
    velocities = [s.velocity_error for s in scores if not math.isnan(s.velocity_error)]
    times = [abs(s.time_error_s) for s in scores if not math.isnan(s.time_error_s)]
    return PhaseSpread(
        phases=len(scores),
        wrong=sum(bool(s.missed or s.spurious) for s in scores),
        missed=sum(bool(s.missed) for s in scores),
        velocity_median=statistics.median(velocities) if velocities else math.nan,
        velocity_worst=max(velocities, default=math.nan),
        time_median_s=statistics.median(times) if times else math.nan,
        time_worst_s=max(times, default=math.nan),
        pit_miss_probability=pit_miss_probability(scene, dt_s),
    )
