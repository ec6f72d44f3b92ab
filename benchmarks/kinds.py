"""Speed of PIC and PIT for each kind of motion, compared with discs on straight paths: ``python -m benchmarks.kinds``.

In the row "plain", discs with a radius of 0.25 m, one per square metre, start at 1 m/s in a box. Each other row adds
one kind of motion: friction and spin, a driven wall, a chain of 100 segments instead of the box, damping, gravity, a
table that slows discs. In the row "contact", ten balls are dropped on each of many floors until all rest or have left.

The table shows PIC's impacts per second (with changes between sliding, rolling and rest), PIT's milliseconds per frame,
and the ratios to the row "plain". The row "recording" is PIC's time with all impacts recorded, divided by the time
without recording. The line "small" is `carom.solve_pic` with 16 discs and 1,000 impacts. With ``--baseline``, another
version of Carom is timed in turn. All times are processor times, and medians over the rounds. Except in "small" and
"recording", the time before the first impact or frame is subtracted. A star marks a slow kind. A slow kind runs once,
up to 48 impacts or 4 frames, and no time is subtracted. The signs "<" and ">" mark a kind that reached the time limit
before 48 impacts or 4 frames, so the number is only a bound.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from benchmarks.arguments import count, parser, run
from benchmarks.baseline import Interpreter
from benchmarks.kinds_worker import KINDS

#: Target for each kind: smallest ratio of PIC's impacts per second to the impacts per second in the row "plain".
PIC_TARGETS = {
    "friction": 0.8,
    "driven": 0.8,
    "chain": 0.5,
    "damping": 0.7,
    "gravity": 0.6,
    "gravity-friction": 0.5,
    "table": 0.15,
    "gravity-chain": 0.3,
    "contact": 0.1,
}
#: Target: greatest ratio of PIT's time per frame to the time per frame in the row "plain".
PIT_TARGET = 3.0
#: Target: greatest ratio of the time with all impacts recorded to the time without recording.
RECORDING_TARGET = 1.15
#: Target: smallest ratio of the baseline's time to this version's time for "small".
SMALL_TARGET = 1.5

_SIZES = (100, 1000)
_SMALL_DISCS, _SMALL_IMPACTS, _SMALL_SOLVES = 16, 1000, 40
#: Impacts or frames of the first run of a kind. The time of this run determines how many impacts or frames are timed
#: later.
_FIRST = {"pic": 48, "pit": 4}
_FRAMES = 600
_IMPACTS_PER_DISC = 100
_RECORDED_IMPACTS = 300_000
#: More impacts per disc than the scene "contact" has, so that this scene runs to its end.
_ALL_IMPACTS_PER_DISC = 1000
#: Number of seconds. A kind whose first run takes longer runs only once.
_SLOW_S = 0.3
#: Longest intended time of one run of a kind, in seconds.
_RUN_S = 0.4


@dataclass
class Speed:
    """Impacts or frames per second of one kind of motion in one interpreter.

    Attributes:
        rates: Impacts or frames per second in each round; a single value for a slow kind. NaN if the run was too short
            to measure.
        size: Impacts or frames of a run; 0 for a slow kind, which is not run again.
        solves: Runs that are timed together in a round.
        is_bound: Whether the true rate is below the given rate.
    """

    rates: list[float] = field(default_factory=list)
    size: int = 0
    solves: int = 1
    is_bound: bool = False

    @property
    def median(self) -> float:
        """Median of the rates."""
        return _median(self.rates)

    def over(self, other: Speed) -> float:
        """Return the median of the ratios of these rates to the other's rates in the same rounds."""
        if len(self.rates) != len(other.rates):
            return self.median / other.median
        return _median(a / b for a, b in zip(self.rates, other.rates, strict=True))


def _median(numbers: Iterable[float]) -> float:
    """Return the median of all numbers except NaN; NaN if there is none."""
    known = [number for number in numbers if not math.isnan(number)]
    return statistics.median(known) if known else math.nan


class Worker(Interpreter):
    """An interpreter that times scenes, see `benchmarks.kinds_worker`."""

    def __init__(self, python: str | None, limit_s: float) -> None:
        super().__init__(Path(__file__).with_name("kinds_worker.py").read_text(encoding="utf-8"), python)
        self._limit_s = limit_s

    def time(
        self, method: str, kind: str, discs: int, size: int, *, record: str = "all", solves: int = 1
    ) -> tuple[float, float]:
        """Return the total seconds of some runs with `size` impacts or frames, and the number of events of one run."""
        seconds, events = self.ask(f"{method} {kind} {discs} {size} {record} {solves} {self._limit_s}")
        return seconds, events

    def first_speed(self, method: str, kind: str, discs: int) -> Speed:
        """Run a kind for the first time.

        Return the speed of a slow kind, and for other kinds the size of the timed runs.
        """
        size, most = _FIRST[method], _FRAMES
        if method == "pic":
            most = discs * (_ALL_IMPACTS_PER_DISC if kind == "contact" else _IMPACTS_PER_DISC)
        for _ in range(3):  # The first run also imports modules, and the start takes most of the time of a short run.
            seconds, events = self.time(method, kind, discs, size)
            if seconds == math.inf:
                return Speed([_FIRST[method] / self._limit_s], is_bound=True)
            if size == _FIRST[method] and seconds > _SLOW_S:
                return Speed([events / seconds])
            wanted = _RUN_S / seconds * size
            size = min(most, max(_FIRST[method], int(wanted)))
        return Speed(size=size, solves=max(1, int(wanted / size)))

    def measure(self, method: str, kind: str, discs: int, speed: Speed) -> None:
        """Add a round to the speed of a kind, unless the kind is slow."""
        if speed.size:
            least = 0 if method == "pic" else 1
            start_s, before = self.time(method, kind, discs, least, solves=speed.solves)
            seconds, events = self.time(method, kind, discs, speed.size, solves=speed.solves)
            run_s = seconds - start_s
            speed.rates.append((events - before) * speed.solves / run_s if run_s > 0.0 else math.nan)


class Table:
    """The speeds of all kinds with PIC and PIT, for one number of discs and one or two interpreters."""

    def __init__(self, workers: Sequence[Worker], discs: int, kinds: Sequence[str], rounds: int) -> None:
        subjects = [
            (method, kind) for kind in kinds for method in ("pic", "pit") if (method, kind) != ("pit", "contact")
        ]
        self._speeds = {
            (method, kind): [worker.first_speed(method, kind, discs) for worker in workers] for method, kind in subjects
        }
        for _ in range(rounds):
            for (method, kind), speeds in self._speeds.items():
                for worker, speed in zip(workers, speeds, strict=True):
                    worker.measure(method, kind, discs, speed)

    def speed(self, method: str, kind: str) -> dict[str, Any]:
        """Return the speed of a kind with PIC or PIT, as a row of the JSON file."""
        if (method, kind) not in self._speeds:
            return {}
        ours, *baseline = self._speeds[method, kind]
        plain = self._speeds[method, "plain"][0]
        times_plain = ours.over(plain) if method == "pic" else 1.0 / ours.over(plain)
        row: dict[str, Any] = {"times_plain": times_plain, "is_bound": ours.is_bound, "is_single_run": not ours.size}
        row |= {"impacts_per_s": ours.median} if method == "pic" else {"ms_per_frame": 1e3 / ours.median}
        if kind != "plain":
            row["target"] = PIC_TARGETS[kind] if method == "pic" else PIT_TARGET
        if baseline and not ours.is_bound and not baseline[0].is_bound:
            row["speed_over_baseline"] = ours.over(baseline[0])
        return row


def measure_recording(worker: Worker, discs: int, rounds: int) -> float:
    """Return PIC's time with all impacts recorded, divided by the time without recording."""
    ratios = []
    for _ in range(rounds):
        (none_s, _), (all_s, _) = (
            worker.time("pic", "plain", discs, _RECORDED_IMPACTS, record=record) for record in ("none", "all")
        )
        ratios.append(all_s / none_s)
    return statistics.median(ratios)


def measure_small(workers: Sequence[Worker], rounds: int) -> list[float]:
    """Return the seconds of a run of the small scene in each interpreter."""
    seconds = [
        [
            worker.time("pic", "plain", _SMALL_DISCS, _SMALL_IMPACTS, solves=_SMALL_SOLVES)[0] / _SMALL_SOLVES
            for worker in workers
        ]
        for _ in range(rounds + 1)
    ]
    return [
        statistics.median(column) for column in zip(*seconds[1:], strict=True)
    ]  # The first round is left out, because it also computes the scene's arrays.


def format_number(value: float) -> str:
    """Format a number with three digits; from 1000 on, as a whole number with separators."""
    return f"{value:,.0f}" if value >= 1000 else f"{value:.3g}"


def _columns(speed: dict[str, Any], has_baseline: bool) -> str:
    if not speed:
        return ""
    is_pic = "impacts_per_s" in speed
    bound = ("<" if is_pic else ">") if speed["is_bound"] else ""
    star = "*" if speed["is_single_run"] and not bound else ""
    value = bound + format_number(speed["impacts_per_s"] if is_pic else speed["ms_per_frame"]) + star
    target = f"{speed['target']:g}" if "target" in speed else ""
    columns = f" {value:>12} {bound + format_number(speed['times_plain']):>9} {target:>7}"
    if has_baseline:
        ratio = speed.get("speed_over_baseline")
        columns += f" {'-' if ratio is None else format_number(ratio):>10}"
    return columns


def print_table(discs: int, rows: dict[str, dict[str, Any]], recording: float, has_baseline: bool) -> None:
    """Print the table for one number of discs."""
    beside = f" {'x baseline':>10}" if has_baseline else ""
    heads = (f" {name:>12} {'x plain':>9} {'target':>7}{beside}" for name in ("impacts/s", "ms per frame"))
    print(f"{f'{discs} discs':<16}{''.join(heads)}")
    for kind, row in rows.items():
        print(f"{kind:<16}{_columns(row['pic'], has_baseline)}{_columns(row['pit'], has_baseline)}")
    print(
        f"{'recording':<16} {'':>12} {f'{recording:.2f}':>9} {RECORDING_TARGET:7g}  (time / time with record='none')\n"
    )


def main(
    discs: Sequence[int], kinds: Sequence[str], baseline: str, rounds: int, limit: float, json_path: Path | None
) -> None:
    """Print the tables."""
    kinds = ["plain", *(kind for kind in kinds if kind != "plain")]
    found: dict[str, Any] = {"tables": []}
    with ExitStack() as stack:
        pythons = [None, baseline] if baseline else [None]
        workers = [stack.enter_context(Worker(python, limit)) for python in pythons]
        small_s, *baseline_s = measure_small(workers, rounds)
        ratio = (
            f", {baseline_s[0] / small_s:.2f} times as fast as the baseline (target {SMALL_TARGET:g})"
            if baseline
            else ""
        )
        print(f"small: {_SMALL_DISCS} discs, {_SMALL_IMPACTS:,} impacts: {1e6 * small_s:.0f} us per solve{ratio}\n")
        found["small"] = {"us_per_solve": 1e6 * small_s}
        if baseline:
            found["small"] |= {"speed_over_baseline": baseline_s[0] / small_s, "target": SMALL_TARGET}
        for number in discs:
            table = Table(workers, number, kinds, rounds)
            rows = {kind: {method: table.speed(method, kind) for method in ("pic", "pit")} for kind in kinds}
            recording = measure_recording(workers[0], number, rounds)
            print_table(number, rows, recording, bool(baseline))
            cost = {"times_none": recording, "target": RECORDING_TARGET}
            found["tables"].append({"discs": number, "kinds": rows, "recording": cost})
    if json_path is not None:
        json_path.write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8")


def _seconds(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"must be a number of seconds above 0, got {text!r}")
    return value


if __name__ == "__main__":
    command = parser("benchmarks.kinds", __doc__)
    command.add_argument("--discs", nargs="+", type=count, default=_SIZES, help="numbers of discs")
    command.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS), help="kinds of motion")
    command.add_argument(
        "--baseline", default="", metavar="PYTHON", help="Python interpreter with another version of Carom"
    )
    command.add_argument("--rounds", type=count, default=5, help="number of timings")
    command.add_argument("--limit", type=_seconds, default=10.0, metavar="SECONDS", help="time limit of a run")
    command.add_argument("--json", dest="json_path", type=Path, metavar="PATH", help="file for the numbers")
    run(command, main)
