"""Results of a bench: points, curves, and the points that no other point beats in both error and run time."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from carom.comparator.thresholds import THRESHOLDS
from carom.execution.environment import Environment
from carom.execution.job import Method
from carom.model.scene import Scene
from carom.studies.bench.convergence import ConvergenceOrder
from carom.studies.bench.machine_noise import Noise
from carom.studies.bench.options import BenchPlan
from carom.studies.bench.own_methods import EXACT_METHOD
from carom.studies.bench.timing_pass import At, CellTiming


@dataclass(frozen=True)
class MethodResult:
    """Base class of the results of a method. Engine and profile are separate fields, as in files.

    Attributes:
        engine: Name of the adapter.
        profile: Name of the profile.
    """

    engine: str
    profile: str

    @property
    def method(self) -> Method:
        """Engine and profile."""
        return Method(self.engine, self.profile)


@dataclass(frozen=True)
class Point(MethodResult):
    """Result of one engine and profile with one step size on one scene.

    Attributes:
        dt_s: Step size, in seconds.
        error: Largest error over all phases; NaN if no impact was found or nothing was run.
        error_median: Median error over the phases.
        error_least: Smallest error over the phases.
        phases: Number of phases.
        expected: Number of the reference's impacts, added up over all phases.
        missed: Number of missed impacts, added up over all phases.
        spurious: Number of invented impacts, added up over all phases.
        reason: Reason why the point was not scored; empty if it was scored.
        timing: Run times; None if the point was not timed.
        untimed: Reason why the point was not timed; empty if it was timed.
    """

    dt_s: float
    error: float
    error_median: float
    error_least: float
    phases: int
    expected: int
    missed: int
    spurious: int
    reason: str = ""
    timing: CellTiming | None = None
    untimed: str = ""

    @property
    def is_correct(self) -> bool:
        """Whether every impact was found, none was invented, and the error is known."""
        return not self.reason and not self.missed and not self.spurious and math.isfinite(self.error)

    @property
    def missed_and_spurious(self) -> int:
        """Number of missed and invented impacts, added up over all phases."""
        return self.missed + self.spurious

    @property
    def at(self) -> At:
        """Method and step size of the point."""
        return self.method, self.dt_s


@dataclass(frozen=True)
class Curve(MethodResult):
    """All points of one engine and profile on one scene.

    Attributes:
        points: Points from the largest to the smallest step size.
        order: The order of convergence, fitted only to points that find every impact and invent none.
        cheapest: The fastest point that finds every impact with an error of at most the target; None if there is none.
    """

    points: tuple[Point, ...]
    order: ConvergenceOrder
    cheapest: Point | None

    @property
    def is_pic(self) -> bool:
        """Whether this is PIC's curve."""
        return self.method == EXACT_METHOD

    @property
    def best(self) -> Point | None:
        """The most accurate point that finds every impact, or else the point with the fewest wrong impacts.

        None if no point was scored. The fastest of equally good points is returned.
        """

        def order(point: Point) -> tuple[bool, int, float, float]:
            return not point.is_correct, point.missed_and_spurious, point.error, read_run_time(point)

        return min((point for point in self.points if not point.reason), key=order, default=None)


@dataclass(frozen=True)
class SceneBench:
    """Results of one scene.

    Attributes:
        scene: The scene.
        curves: One entry per engine and profile.
        front: The points that no other point beats in both error and run time, from the fastest to the most accurate.
            PIC's points are not included.
        cheapest: The fastest point that finds every impact with an error of at most the target; None if there is none.
        noise: Spread of the run times of fixed work while this scene was timed; None if the scene was not timed.
        rounds: Number of rounds of the timing pass.
        timed_at: Time of the timing pass, UTC. If a bench is resumed, this may be the time of an earlier session.
    """

    scene: Scene
    curves: tuple[Curve, ...]
    front: tuple[Point, ...]
    cheapest: Point | None
    noise: Noise | None
    rounds: int
    timed_at: str

    @property
    def points(self) -> list[Point]:
        """All points of all curves."""
        return [point for curve in self.curves for point in curve.points]

    @property
    def exact(self) -> Point | None:
        """PIC's fastest point; None if PIC was not run, or has errors above rounding."""
        points = [point for curve in self.curves if curve.is_pic for point in curve.points if point.is_correct]
        return min((p for p in points if p.error <= THRESHOLDS.rounding), key=read_run_time, default=None)

    @property
    def engines(self) -> list[Curve]:
        """The curves of engines, best first; PIT's curve if no engine was run."""
        for own_names in ({"pic", "pit"}, {"pic"}):
            if found := [curve for curve in self.curves if curve.engine not in own_names]:
                return sort_best_first(found)
        return []

    def find_cheapest_engine(self, target: float) -> Point | None:
        """Return the fastest engine's point that finds every impact and reaches the target; None if there is none."""
        return find_cheapest([point for curve in self.engines for point in curve.points], target)


@dataclass(frozen=True)
class Bench:
    """Result of `carom bench`.

    Attributes:
        scenes: One entry per scene.
        plan: Options of the bench.
        environment: Description of the machine, and versions of packages.
        command: The command that repeats the bench.
        elapsed_s: Wall-clock seconds.
    """

    scenes: tuple[SceneBench, ...]
    plan: BenchPlan
    environment: Environment
    command: str
    elapsed_s: float


def read_run_time(point: Point | None) -> float:
    """Return the run time of all steps of a point, in seconds. Without a point or a run time, return infinity."""
    return point.timing.advance_s.median if point is not None and point.timing else math.inf


def find_pareto_front(points: Sequence[Point]) -> tuple[Point, ...]:
    """Return the points that no other point beats in both run time and error (the Pareto front).

    The fastest point is first. Points without a run time, or with missed or invented impacts, are excluded.
    """
    front: list[Point] = []
    for point in sorted((p for p in points if p.is_correct and p.timing), key=lambda p: (read_run_time(p), p.error)):
        # Differences within rounding do not count as more accurate.
        if not front or point.error < front[-1].error - THRESHOLDS.rounding:
            front.append(point)
    return tuple(front)


def find_cheapest(points: Sequence[Point], target: float) -> Point | None:
    """Return the fastest point that finds every impact with an error of at most the target; None if there is none."""
    meeting = [point for point in points if point.is_correct and point.timing and point.error <= target]
    return min(meeting, key=read_run_time, default=None)


def sort_best_first(curves: Iterable[Curve]) -> list[Curve]:
    """Sort curves by their best points.

    Points that find every impact are sorted by error and run time. Other points follow, sorted by their numbers of
    missed and invented impacts.
    """

    def place(curve: Curve) -> tuple[float, ...]:
        best = curve.best
        if best is None:
            return (True,)
        # Errors that look equal in tables count as equal. For equal errors, the faster method is better.
        error = 0.0 if best.error <= THRESHOLDS.rounding else float(f"{best.error:.1e}")
        lost_share = best.missed_and_spurious / max(1, best.expected)
        return (False, not best.is_correct, lost_share, error, read_run_time(best))

    return sorted(curves, key=place)
