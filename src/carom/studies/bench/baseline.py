"""Comparison of a bench with an earlier bench, the baseline, on the same machine.

Run times of different days are not comparable, so each run time is divided by PIT's run time in the same round.
"""

from __future__ import annotations

import json
import math
import statistics
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any, NamedTuple

from carom.errors import InputError
from carom.execution.environment import Environment
from carom.execution.job import Method
from carom.report.document import Column, Media, Section, Table
from carom.report.files import FORMATS
from carom.studies.bench.convergence import CONFIDENCE, compute_student_quantile
from carom.studies.bench.options import ErrorKind
from carom.studies.bench.result import Bench, Point
from carom.studies.bench.tables import format_error, format_point_name
from carom.studies.bench.timing_pass import At
from carom.support import formatting

#: A run time counts as changed if the whole confidence interval of (new run time / earlier run time) differs from 1 by
#: more than this number. Smaller differences may have other causes, such as the program's position in memory and other
#: programs on the machine.
LEAST_CHANGE = 0.05


class BaselineChange(Enum):
    """Change of a point's run time or error. Each member's value is the word that a report shows."""

    REGRESSED = "regressed"
    IMPROVED = "improved"
    SAME = "no change"


class BaselinePoint(NamedTuple):
    """Result of one method with one step size on one scene in the earlier bench.

    Run times are divided by PIT's run times of the same rounds. `missed_and_spurious` counts missed and invented
    impacts.
    """

    ratios: Sequence[float]
    error: float
    missed_and_spurious: int


@dataclass(frozen=True)
class PointChange:
    """The new and the earlier result of one method with one step size on one scene.

    Attributes:
        scene: Name of the scene.
        point: The point of the new bench.
        before: The same point in the earlier bench.
        ratio: The new run time divided by the earlier run time, both in units of PIT's run time; NaN if a bench has too
            few rounds.
        low: Lower end of the ratio's confidence interval. The confidence level holds for the intervals of all points
            together.
        high: Upper end of the ratio's confidence interval.
    """

    scene: str
    point: Point
    before: BaselinePoint
    ratio: float
    low: float
    high: float

    @property
    def time(self) -> BaselineChange:
        """Change of the point's run time."""
        if self.low > 1.0 + LEAST_CHANGE:
            return BaselineChange.REGRESSED
        return BaselineChange.IMPROVED if self.high < 1.0 - LEAST_CHANGE else BaselineChange.SAME

    @property
    def accuracy(self) -> BaselineChange:
        """Change of the number of missed and invented impacts or, if this number is unchanged, change of the error.

        Errors are rounded to two digits. Unlike run times, errors have no noise, because repeated runs of one version
        have equal errors.
        """
        current, earlier = ((one.missed_and_spurious, _round_error(one.error)) for one in (self.point, self.before))
        if current == earlier:
            return BaselineChange.SAME
        return BaselineChange.REGRESSED if current > earlier else BaselineChange.IMPROVED


def read_baseline(path: Path, environment: Environment) -> dict[tuple[str, At], BaselinePoint]:
    """Read an earlier bench, and return its points by scene, method and step size.

    Args:
        path: The earlier `bench.json`, or its folder.
        environment: Description of this machine.

    Raises:
        InputError: The bench can't be read, has another format, or ran on another machine.
    """
    file = path / "bench.json" if path.is_dir() else path
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        if content["format"] != FORMATS["bench"]:
            raise InputError(f"{file} has format {content['format']}; this version of Carom reads {FORMATS['bench']}")
        machine = tuple(content["environment"][name] for name in ("system", "processor", "cores"))
        points = {
            # `Method` translates profile names of earlier versions.
            (scene["scene"], (Method(point["engine"], point["profile"]), point["dt_s"])): _read_point(point)
            for scene in content["scenes"]
            for curve in scene["curves"]
            for point in curve["points"]
            if not point["reason"]
        }
    except OSError as error:
        raise InputError(f"the baseline {file} can't be read: {error.strerror}") from None
    except (ValueError, KeyError, TypeError, AttributeError):
        raise InputError(f"{file} is not a bench.json of carom bench") from None
    if machine != environment.machine:
        raise InputError(
            f"the baseline ran on another machine ({', '.join(map(str, machine))}): "
            "run times are comparable only on one machine"
        )
    return points


def _read_point(point: dict[str, Any]) -> BaselinePoint:
    error = point["error"]
    ratios = (point["timing"] or {}).get("ratios") or ()
    losses = int(point["missed"]) + int(point["spurious"])
    return BaselinePoint([float(one) for one in ratios], math.nan if error is None else float(error), losses)


def compare_points(bench: Bench, before: dict[tuple[str, At], BaselinePoint]) -> list[PointChange]:
    """Compare each scored point with the baseline's point of the same scene, method and step size, if there is one.

    PIT's points are omitted, because all run times are divided by PIT's.
    """
    both = [
        (scene.scene.name, point, found)
        for scene in bench.scenes
        for point in scene.points
        if point.engine != "pit" and not point.reason
        if (found := before.get((scene.scene.name, point.at))) is not None
    ]
    return [PointChange(scene, point, found, *_compute_ratio(point, found, len(both))) for scene, point, found in both]


def _compute_ratio(point: Point, before: BaselinePoint, points: int) -> tuple[float, float, float]:
    """Return the ratio of a point's mean run time to its earlier mean run time, and the ratio's confidence limits.

    Means are geometric. The interval of Welch's t-test is widened, so that the confidence level holds for the intervals
    of all `points` together.
    """
    times = (point.timing.ratios if point.timing else (), before.ratios)
    one, other = ([math.log(value) for value in values if value > 0.0] for values in times)
    if len(one) < 2 or len(other) < 2:
        return math.nan, math.nan, math.nan
    parts = [statistics.variance(values) / len(values) for values in (one, other)]
    middle, spread = statistics.fmean(one) - statistics.fmean(other), math.sqrt(sum(parts))
    if spread == 0.0:
        return (math.exp(middle),) * 3
    freedom = sum(parts) ** 2 / sum(p * p / (len(v) - 1) for p, v in zip(parts, (one, other), strict=True))
    half = compute_student_quantile(1.0 - (1.0 - CONFIDENCE) / (2 * points), max(1, math.floor(freedom))) * spread
    return math.exp(middle), math.exp(middle - half), math.exp(middle + half)


def _round_error(error: float) -> float:
    return math.inf if math.isnan(error) else float(f"{error:.1e}")


def describe_baseline(changes: Sequence[PointChange]) -> Iterator[str]:
    """Describe how many points became worse, became better or did not change, and name the worst point."""
    if not changes:
        yield "The baseline has none of these points. Make a baseline with the same scenes, engines and steps."
        return
    times = [one.time for one in changes]
    counts = [f"{times.count(change)} {change.value}" for change in BaselineChange]
    points = formatting.format_count(len(changes), "point")
    text = f"Run time of {points} compared with the baseline: {', '.join(counts)}"
    worst = max((one for one in changes if one.time is BaselineChange.REGRESSED), key=lambda one: one.low, default=None)
    yield f"{text}; worst: {_format_name(worst)}, {_format_interval(worst)}." if worst else f"{text}."
    changed = [one for one in changes if one.accuracy is not BaselineChange.SAME]
    if changed:
        worse = sum(one.accuracy is BaselineChange.REGRESSED for one in changed)
        yield f"Errors: {worse} regressed, {len(changed) - worse} improved."


def build_baseline_section(changes: Sequence[PointChange], kind: ErrorKind) -> Section:
    """Return a section with a table of the changed points. A full document also has a table of all other points."""
    columns = (
        Column("point", _format_name),
        Column("run time", lambda one: one.time.value),
        Column("now / then", _format_interval, number=True),
        Column("error", lambda one: one.accuracy.value),
        Column("then", lambda one: _format_error(one.before, kind), number=True),
        Column("now", lambda one: _format_error(one.point, kind), number=True),
    )
    changed = [one for one in changes if (one.time, one.accuracy) != (BaselineChange.SAME, BaselineChange.SAME)]
    note = (
        "Run times are divided by PIT's in the same round. 'Now / then' is their ratio, with confidence intervals that "
        f"all hold together at a level of {CONFIDENCE:.0%}. A run time has changed if the whole interval differs from "
        f"1 by more than {LEAST_CHANGE:.0%}."
    )
    tables = (
        Table(columns, changed, title="Changes from the baseline", note=note),
        Table(columns, [one for one in changes if one not in changed], title="No change", only=Media.IN_FULL),
    )
    return Section("Baseline", tuple(table for table in tables if table.items))


def _format_name(one: PointChange) -> str:
    return f"{one.scene}, {format_point_name(one.point)}"


def _format_interval(one: PointChange) -> str:
    if math.isnan(one.ratio):
        return formatting.ABSENT
    ends = f"{formatting.format_number(one.low)} to {formatting.format_number(one.high)}"
    return f"{formatting.format_ratio(one.ratio)} ({ends})"


def _format_error(one: Point | BaselinePoint, kind: ErrorKind) -> str:
    return f"{one.missed_and_spurious} lost" if one.missed_and_spurious else format_error(one.error, kind)
