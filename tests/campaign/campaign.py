"""Commands that check random cases in worker processes and add up the findings from call to call."""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
import signal
import sys
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import NamedTuple

from carom.support.folders import write_file

#: Exit code of a program that Ctrl-C has ended.
INTERRUPTED = 130
#: Seconds between two lines of progress.
PROGRESS_S = 5.0
#: Findings that the state keeps, and that a campaign prints of one case; all are counted.
KEPT, PRINTED = 1000, 10


class Finding(NamedTuple):
    """A difference, a broken rule or a crash: its kind, which is counted, and a sentence."""

    kind: str
    text: str


@dataclass
class Checked:
    """Result of the checks of a case.

    Attributes:
        kind: Kind of the case: a row of the table.
        sums: Numbers that are added up over the cases of a kind.
        most: Numbers whose maximum is kept.
        features: Features of the case, to count the cases with each feature.
        findings: Errors.
        seconds: Processor time.
    """

    kind: str = "none"
    sums: Mapping[str, float] = field(default_factory=dict)
    most: Mapping[str, float] = field(default_factory=dict)
    features: Sequence[str] = ()
    findings: list[Finding] = field(default_factory=list)
    seconds: float = 0.0


@dataclass
class Tally:
    """Counts of a campaign; `sums` and `most` are by kind and name."""

    begun: int = 0
    sums: dict[str, dict[str, float]] = field(default_factory=dict)
    most: dict[str, dict[str, float]] = field(default_factory=dict)
    features: Counter[str] = field(default_factory=Counter)
    differences: Counter[str] = field(default_factory=Counter)
    findings: list[tuple[int, str, str]] = field(default_factory=list)

    def total(self, name: str) -> float:
        """Return a sum over all kinds."""
        return sum(row.get(name, 0) for row in self.sums.values())

    def add(self, number: int, checked: Checked) -> None:
        """Count one case."""
        sums, most = self.sums.setdefault(checked.kind, {}), self.most.setdefault(checked.kind, {})
        found = {"cases": 1, **checked.sums, "findings": len(checked.findings), "seconds": checked.seconds}
        for name, value in found.items():
            sums[name] = sums.get(name, 0) + value
        for name, value in checked.most.items():
            most[name] = max(most.get(name, value), value)
        self.features.update(checked.features)
        self.differences.update(finding.kind for finding in checked.findings)
        self.findings += [(number, *finding) for finding in checked.findings][: KEPT - len(self.findings)]

    def table(self) -> str:
        """Return the counts as Markdown tables."""
        sums, most = (list(dict.fromkeys(n for row in of.values() for n in row)) for of in (self.sums, self.most))
        lines = [f"| {' | '.join(['kind', *sums, *most])} |", "| --- |" + " ---: |" * len(sums + most)]
        for kind in [*self.sums, "all"]:
            rows = [*self.sums] if kind == "all" else [kind]
            values = [sum(self.sums[row].get(name, 0) for row in rows) for name in sums]
            values += [max(self.most[row].get(name, 0) for row in rows) for name in most]
            cells = (f"{value:,.4g}" if value % 1 else f"{value:,.0f}" for value in values)
            lines.append(f"| {kind} | {' | '.join(cells)} |")
        for what, counts in (("feature", self.features), ("finding", self.differences)):
            if counts:
                lines += ["", f"| {what} | cases |", "| --- | ---: |"]
                lines += [f"| {name} | {number:,} |" for name, number in sorted(counts.items())]
        return "\n".join(lines)

    @classmethod
    def load(cls, path: Path) -> Tally:
        """Return the content of a file, or an empty tally if it does not exist.

        Raises:
            ValueError: The file has not the content that this version writes.
        """
        if not path.exists():
            return cls()
        held = json.loads(path.read_text(encoding="utf-8"))
        if held.keys() != vars(cls()).keys():
            raise ValueError(f"state of an earlier version: delete {path}")
        counters = {name: Counter(held[name]) for name in ("features", "differences")}
        return cls(**{**held, **counters, "findings": [tuple(finding) for finding in held["findings"]]})

    def save(self, path: Path) -> None:
        """Write the counts to a file atomically."""
        write_file(path, json.dumps(vars(self), indent=1) + "\n")


def _check_case(check: Callable[[int], Checked], hanging_s: float, number: int) -> Checked:
    """Check a case in a worker process, which the system ends if the case takes too long."""
    signal.setitimer(signal.ITIMER_REAL, hanging_s)
    try:
        return check(number)
    except Exception as error:  # noqa: BLE001 - whatever a broken solver raises is a finding
        return Checked(findings=[Finding("raised", f"{type(error).__name__}: {error}")])
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def _start_worker() -> ProcessPoolExecutor:
    """Return a pool of one process, which ignores Ctrl-C and is replaced if it hangs or crashes."""
    context = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(1, context, initializer=signal.signal, initargs=(signal.SIGINT, signal.SIG_IGN))


@dataclass(frozen=True)
class Campaign:
    """A command that checks cases.

    Attributes:
        program: Module of the command.
        about: Description of the command.
        case: Word for a case: the option `--gas 42`, say, checks one.
        goal: What is counted up to the requested number ("cases", or the name of a sum), and the default number.
        check: Returns the result of the case of a number; called in another process.
        hanging_s: Seconds of clock time after which a process that checks one case is terminated.
        sizes: Options that are whole numbers, with their defaults; they are keywords of `check`.
        save: Saves a case with findings (number, result, folder of `--out`); returns a text to print.
    """

    program: str
    about: str | None
    case: str
    goal: tuple[str, float]
    check: Callable[..., Checked]
    hanging_s: float
    sizes: Mapping[str, int] = field(default_factory=dict)
    save: Callable[[int, Checked, Path], str] = lambda *_: ""

    def main(self, arguments: Sequence[str] | None = None) -> int:
        """Return 1 if anything was found, 130 after Ctrl-C, else 0."""
        goal, default = self.goal
        many = f"{self.case}s" if goal == "cases" else goal
        parser = argparse.ArgumentParser(f"python -m {self.program}", description=self.about)
        parser.add_argument(f"--{many}", type=float, default=default, help=f"how many in all ({default:g})")
        parser.add_argument("--jobs", type=int, default=1, help="processes, one core each (1)")
        parser.add_argument("--minutes", type=float, default=float("inf"), help="for how long at most")
        parser.add_argument("--state", type=Path, help="JSON file in which counts add up from call to call")
        out = Path("reports") / self.program.replace(".", "-")
        parser.add_argument("--out", type=Path, default=out, help=f"folder for cases with findings ({out})")
        parser.add_argument(f"--{self.case}", type=int, help="check only the case of this number")
        parser.add_argument("--from", type=int, default=0, help="number of the first case without a state (0)")
        for name, size in self.sizes.items():
            parser.add_argument(f"--{name.replace('_', '-')}", type=int, default=size, help=f"({size})")
        chosen = vars(parser.parse_args(arguments))
        check = partial(self.check, **{name: chosen[name] for name in self.sizes})
        number, state, ended = chosen[self.case], chosen["state"], True
        try:
            has_state = state is not None and state.exists() and number is None
            tally = Tally.load(state) if has_state else Tally(begun=chosen["from"])
        except ValueError as error:
            parser.error(str(error))
        if number is None:
            end_s = time.monotonic() + 60.0 * chosen["minutes"]
            ended = self.run(tally, check, chosen[many], chosen["jobs"], end_s, state, chosen["out"])
        else:
            self.count(tally, number, check(number), chosen["out"], printed=None)
        print(tally.table())
        return 1 if tally.differences else 0 if ended else INTERRUPTED

    def run(
        self,
        tally: Tally,
        check: Callable[[int], Checked],
        goal: float,
        jobs: int = 1,
        end_s: float = float("inf"),
        state: Path | None = None,
        out: Path = Path(),
    ) -> bool:
        """Check cases up to the goal, or for a time; return False after Ctrl-C."""
        goes_on, shown_s, before_s, total = True, -math.inf, tally.total("seconds"), self.goal[0]
        before = tally.total(total)

        def end(*_: object) -> None:
            nonlocal goes_on
            goes_on = False

        handler = signal.signal(signal.SIGINT, end)
        workers = [_start_worker() for _ in range(jobs)]
        running = dict[int, tuple[Future[Checked], int]]()  # future and case, by worker
        try:
            while True:
                for k, worker in enumerate(workers):
                    left = goal - tally.total(total) - (len(running) if total == "cases" else 0)
                    if k not in running and goes_on and left > 0 and time.monotonic() < end_s:
                        future = worker.submit(_check_case, check, self.hanging_s, tally.begun)
                        running[k] = (future, tally.begun)
                        tally.begun += 1
                if not running:
                    return goes_on
                wait([future for future, _ in running.values()], 1.0, FIRST_COMPLETED)
                for k, (future, number) in list(running.items()):
                    if not future.done():
                        continue
                    del running[k]
                    if isinstance(future.exception(), BrokenProcessPool):
                        workers[k] = _start_worker()
                        text = f"the process crashed, or was terminated after {self.hanging_s:g} s"
                        checked = Checked(findings=[Finding("process ended", text)])
                    else:
                        checked = future.result()
                    self.count(tally, number, checked, out)
                if time.monotonic() - shown_s > PROGRESS_S:
                    shown_s, done = time.monotonic(), max(1, tally.total(total) - before)
                    rate = (tally.total("seconds") - before_s) / done
                    text = f"{tally.total('cases'):,.0f} cases, {tally.total(total):,.0f} {total}, "
                    text += f"{rate:.3g} s of processor time each; {tally.total('findings'):,.0f} findings"
                    print(text, file=sys.stderr, flush=True)
                    if state is not None:
                        tally.save(state)
        finally:
            for worker in workers:
                worker.shutdown(cancel_futures=True)
            if state is not None:
                tally.save(state)
            signal.signal(signal.SIGINT, handler)

    def count(self, tally: Tally, number: int, checked: Checked, out: Path, *, printed: int | None = PRINTED) -> None:
        """Count a case; print its findings, or the first ones, and the command that repeats it."""
        tally.add(number, checked)
        if checked.findings:
            for finding in checked.findings[:printed]:
                print(f"{self.case} {number}: {finding.kind}: {finding.text}")
            print(
                f"    again: python -m {self.program} --{self.case} {number}{self.save(number, checked, out)}",
                flush=True,
            )
