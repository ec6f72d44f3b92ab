"""What a bench is to do: the plan, the series of steps where none are asked for, and every job that comes of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from carom.bench.axes import ErrorKind
from carom.comparator.shift import even_phases
from carom.errors import InputError
from carom.registry import EngineInfo
from carom.runs.asked import require_asked
from carom.runs.engines import Methods, methods_of
from carom.runs.job import Job
from carom.runs.plan import profiles_to_plan, sorted_out
from carom.runs.pool import Pool
from carom.scene import Scene

__all__ = ["STEPS", "BenchPlan", "default_steps", "geometric_steps", "jobs_of"]

#: Steps of a scene's series where none are asked for: from its own frame to one as much finer as 1/10000 s is than
#: 1/60 s, in so many steps as a fitted order needs to have a confidence interval worth reading.
FINEST = 60 / 10_000
STEPS = 6


@dataclass(frozen=True)
class BenchPlan:
    """What a bench is to do.

    Attributes:
        engines: Names of adapters; None for all.
        dts: Steps, seconds; None for each scene's own series.
        profiles: Names of profiles.
        phases: How many starts, evenly spread over a step, each job is scored at.
        error: Which error.
        target: The error for which the cheapest way is looked for.
        rounds: Rounds of the timing pass.
        seed: Of the order of its visits.
        budget_s: Seconds a scene: half for scoring, half for timing. What does not fit is left out, and says so.
        time_limit_s: A run that takes longer is ended.
        memory_limit_mb: Megabytes that an engine's process may take; by default as a `carom.runs.pool.LocalPool` has
            it.
        timing: Whether to time at all.

    Raises:
        InputError: A number is out of range.
    """

    engines: tuple[str, ...] | None = None
    dts: tuple[float, ...] | None = None
    profiles: tuple[str, ...] = ("default", "tuned")
    phases: int = 4
    error: ErrorKind = ErrorKind.IMPACT
    target: float = 1e-3
    rounds: int = 7
    seed: int = 1
    budget_s: float = 80.0
    time_limit_s: float = 60.0
    memory_limit_mb: float | None = None
    timing: bool = True

    def __post_init__(self) -> None:
        require_asked(self)


def geometric_steps(coarsest_s: float, finest_s: float, count: int) -> tuple[float, ...]:
    """Return so many steps, evenly spread on a logarithmic axis; whole frame rates where both ends are.

    Raises:
        InputError: An end is no positive number, or there are fewer than two steps.
    """
    for name, value in (("the coarsest step", coarsest_s), ("the finest step", finest_s)):
        if not 0 < value < math.inf:
            raise InputError(f"{name} must be a positive number of seconds, got {value}")
    if count < 2:
        raise InputError(f"a series of steps needs two of them or more, got {count}")
    coarsest_s, finest_s = max(coarsest_s, finest_s), min(coarsest_s, finest_s)
    rates = [(1 / coarsest_s) * (coarsest_s / finest_s) ** (k / (count - 1)) for k in range(count)]
    ends = rates[0], rates[-1]
    if all(round(rate) >= 1 and abs(rate - round(rate)) < 1e-9 * rate for rate in ends):  # a float holds 1/60 to 1e-16
        rates = [float(round(rate)) for rate in rates]
        return tuple(1.0 / rate for rate in dict.fromkeys(rates))
    return (coarsest_s, *(1.0 / rate for rate in rates[1:-1]), finest_s)


def default_steps(scene: Scene) -> tuple[float, ...]:
    """Return the series of steps that a scene is run at where none are asked for."""
    frame_s = 1.0 / scene.frame_rate_hz
    return geometric_steps(frame_s, frame_s * FINEST, STEPS)


def jobs_of(
    scenes: Sequence[Scene], infos: Sequence[EngineInfo], plan: BenchPlan, pool: Pool
) -> tuple[list[Job], Methods]:
    """Return every job of the scoring pass, and what is known of its methods.

    Raises:
        InputError: There is no scene, or two have one name.
        UnknownNameError: No engine asked for has a profile of the plan.
    """
    plain, _ = sorted_out(scenes)
    profiles = profiles_to_plan(infos, plan.profiles)
    steps = {scene.name: sorted(set(plan.dts or default_steps(scene)), reverse=True) for scene in plain}
    methods = methods_of(infos, profiles, [dt_s for own in steps.values() for dt_s in own], pool)
    jobs = [
        Job(scene, method, dt_s, refinement, phase)
        for scene in plain
        for info in infos
        for refinement, dt_s in enumerate(steps[scene.name])
        for method in methods.at[info.name, dt_s]
        for phase in even_phases(plan.phases)
    ]
    return jobs, methods
