"""Commands that check random cases in processes, and add up the counts of all calls."""

from __future__ import annotations

import argparse
import json
import math
import signal
import sys
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from multiprocessing import get_context
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
    """A difference, a broken rule or a crash: the kind, which is counted, and a sentence."""

    kind: str
    text: str


@dataclass
class Checked:
    """Result of the checks of a case.

    Attributes:
        kind: Kind of the case, which has a row in the table.
        sums: Numbers that are added up over the cases of a kind.
        most: Numbers whose maximum over the cases is kept.
        findings: Errors that the checks found.
        seconds: Processor time.
    """

    kind: str = "none"
    sums: Mapping[str, float] = field(default_factory=dict)
    most: Mapping[str, float] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)
    seconds: float = 0.0


@dataclass
class Tally:
    """Counts of a campaign so far; `sums` and `most` are by kind and name."""

    begun: int = 0
    sums: dict[str, dict[str, float]] = field(default_factory=dict)
    most: dict[str, dict[str, float]] = field(default_factory=dict)
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
        if self.differences:
            lines += ["", "| finding | cases |", "| --- | ---: |"]
            lines += [f"| {name} | {number:,} |" for name, number in sorted(self.differences.items())]
        return "\n".join(lines)

    @classmethod
    def load(cls, path: Path) -> Tally | None:
        """Return the content of a state file; None if an earlier version has written other content."""
        held = json.loads(path.read_text(encoding="utf-8"))
        if not vars(cls()).keys() <= held.keys():
            return None
        kept = {name: held[name] for name in vars(cls())}
        kept["differences"] = Counter(kept["differences"])
        kept["findings"] = [tuple(finding) for finding in kept["findings"]]
        return cls(**kept)

    def save(self, path: Path) -> None:
        """Write the file completely or not at all."""
        write_file(path, json.dumps(vars(self), indent=1) + "\n")


def _start_worker() -> ProcessPoolExecutor:
    """Return a pool of one process, so that a crash ends one case only; the process ignores Ctrl-C."""
    ignore = (signal.SIGINT, signal.SIG_IGN)
    return ProcessPoolExecutor(1, get_context("spawn"), initializer=signal.signal, initargs=ignore)


def _check_in_time(check: Callable[[int], Checked], number: int, seconds: float) -> Checked:
    """Check a case; the operating system ends the process after some seconds, even in compiled code."""
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        return check(number)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


@dataclass(frozen=True)
class Campaign:
    """A command that checks cases.

    Attributes:
        program: Module of the command.
        about: Description of the command.
        case: Name of a case; the option of this name, for example `--gas 42`, checks one case.
        goal: "cases" or the name of a sum; the campaign ends when it reaches a number. Second, its default.
        check: Checks the case of a number, in another process.
        hanging_s: Seconds of clock time after which a process that checks one case is terminated.
        save: Saves a case with findings in the folder of `--out`, and returns a text to print.
    """

    program: str
    about: str | None
    case: str
    goal: tuple[str, float]
    check: Callable[[int], Checked]
    hanging_s: float
    save: Callable[[int, Checked, Path], str] = lambda *_: ""

    def main(self, arguments: Sequence[str] | None = None) -> int:
        """Run the command; return 1 after findings, 130 after Ctrl-C, else 0."""
        goal, default = self.goal
        many = f"{self.case}s" if goal == "cases" else goal
        parser = argparse.ArgumentParser(f"python -m {self.program}", description=self.about)
        parser.add_argument(f"--{many}", type=float, default=default, help=f"how many in all ({default:g})")
        parser.add_argument("--jobs", type=int, default=1, help="processes, one core each (1)")
        parser.add_argument("--state", type=Path, help="JSON file in which counts add up from call to call")
        out = Path("reports") / self.program.replace(".", "-")
        parser.add_argument("--out", type=Path, default=out, help=f"folder for cases with findings ({out})")
        parser.add_argument(f"--{self.case}", type=int, help="check only the case of this number")
        parser.add_argument("--from", type=int, default=0, help="number of the first case without a state (0)")
        chosen = vars(parser.parse_args(arguments))
        number, state, ended = chosen[self.case], chosen["state"], True
        has_state = state is not None and state.exists() and number is None
        tally = Tally.load(state) if has_state else Tally(begun=chosen["from"])
        if tally is None:
            parser.error(f"state of an earlier version: delete {state}")
        if number is None:
            ended = self.run(tally, chosen[many], chosen["jobs"], state, chosen["out"])
        else:
            self.count(tally, number, self.check(number), chosen["out"], printed=None)
        print(tally.table())
        return 1 if tally.differences else 0 if ended else INTERRUPTED

    def run(self, tally: Tally, goal: float, jobs: int = 1, state: Path | None = None, out: Path = Path()) -> bool:
        """Check cases up to the goal; return False after Ctrl-C."""
        goes_on, shown_s, before_s, total = True, -math.inf, tally.total("seconds"), self.goal[0]
        before = tally.total(total)

        def end(*_: object) -> None:
            nonlocal goes_on
            goes_on = False

        handler = signal.signal(signal.SIGINT, end)
        free, under_way = (
            [_start_worker() for _ in range(jobs)],
            dict[Future[Checked], tuple[int, ProcessPoolExecutor]](),
        )
        try:
            while True:
                while free and goes_on and goal - tally.total(total) > (len(under_way) if total == "cases" else 0):
                    worker = free.pop()
                    future = worker.submit(_check_in_time, self.check, tally.begun, self.hanging_s)
                    under_way[future] = tally.begun, worker
                    tally.begun += 1
                if not under_way:
                    return goes_on
                for future in wait(under_way, timeout=1.0, return_when=FIRST_COMPLETED).done:
                    number, worker = under_way.pop(future)
                    try:
                        checked = future.result()
                    except BrokenProcessPool:
                        worker = _start_worker()
                        text = f"the process crashed, or was terminated after {self.hanging_s:g} s"
                        checked = Checked(findings=[Finding("crash", text)])
                    except Exception as error:  # noqa: BLE001 - whatever a broken solver raises is a finding
                        checked = Checked(findings=[Finding("raised", f"{type(error).__name__}: {error}")])
                    free.append(worker)
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
            for worker in free:
                worker.shutdown()
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
