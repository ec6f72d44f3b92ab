"""Compare PIC on random scenes in which all features meet: ``python -m tests.campaign.features --scenes 20000``.

Each scene is run by PIC and compared with a certified run, with the run in pieces, and with the run by all pairs. It is
also compared with PIC on the same scene rotated by 90 degrees and with its discs in reverse order.
`tests.campaign.envelope` and `tests.campaign.certified_comparison` derive how far roundings may have a run off. Every
difference is saved as a scene file with its reason. With ``--state`` counts add up from call to call. Ctrl-C ends with
the scenes under way. Exit code 1 reports a difference.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import signal
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from tests.campaign.feature_checks import Check, CheckedScene, Finding, check_scene
from tests.campaign.feature_scenes import Law, draw_scene, features_of, law_of

from carom import save_scene
from carom.support.folders import write_file

#: Exit code of a program that Ctrl-C has ended.
INTERRUPTED = 130
#: Seconds of clock time after which a process that checks one scene is terminated.
HANGING_S = 600.0
#: Seconds between two lines of progress, and scenes between two writes of the state.
PROGRESS_S, BETWEEN = 5.0, 50
#: Findings that the state keeps; all are counted, and saved as scenes.
KEPT = 1000
OUT = Path("reports/campaign-features")


@dataclass
class Count:
    """Counts over all scenes of a law; `findings` by check and kind."""

    scenes: int = 0
    impacts: int = 0
    certified: int = 0
    proven: int = 0
    modes: int = 0
    low_hops: int = 0
    seconds: float = 0.0
    findings: dict[str, int] = field(default_factory=dict)


@dataclass
class Tally:
    """All that has been compared so far."""

    begun: int = 0
    counts: dict[str, Count] = field(default_factory=lambda: {law.value: Count() for law in Law})
    features: dict[str, int] = field(default_factory=dict)
    findings: list[tuple[int, str, str, str]] = field(default_factory=list)

    @property
    def scenes(self) -> int:
        """Scenes compared."""
        return sum(count.scenes for count in self.counts.values())

    @property
    def differences(self) -> dict[str, int]:
        """How many scenes differ, by check and kind."""
        found: dict[str, int] = {}
        for count in self.counts.values():
            for name, number in count.findings.items():
                found[name] = found.get(name, 0) + number
        return dict(sorted(found.items()))

    def add(self, number: int, law: Law, features: Sequence[str], checked: CheckedScene) -> None:
        """Count one scene."""
        count = self.counts[law.value]
        count.scenes += 1
        for name in ("impacts", "certified", "proven", "modes", "low_hops", "seconds"):
            setattr(count, name, getattr(count, name) + getattr(checked, name))
        for name in features:
            self.features[name] = self.features.get(name, 0) + 1
        for finding in checked.findings:
            kind = f"{finding.check.value}: {finding.kind}"
            count.findings[kind] = count.findings.get(kind, 0) + 1
            if len(self.findings) < KEPT:
                self.findings.append((number, finding.check.value, finding.kind, finding.text))

    def table(self) -> str:
        """Return the counts as Markdown tables."""
        heads = (
            "law",
            "scenes",
            "impacts",
            "certified",
            "order proven",
            "changes of modes",
            "contact from low hops",
            "differences",
            "s a scene",
        )
        lines = [f"| {' | '.join(heads)} |", "| --- |" + " ---: |" * (len(heads) - 1)]
        total = Count()
        for name, count in (*self.counts.items(), ("all", total)):
            numbers = (count.scenes, count.impacts, count.certified, count.proven, count.modes, count.low_hops)
            cells = [f"{number:,}" for number in (*numbers, sum(count.findings.values()))]
            lines.append(f"| {name} | {' | '.join(cells)} | {count.seconds / max(1, count.scenes):.2f} |")
            if count is not total:
                for part in ("scenes", "impacts", "certified", "proven", "modes", "low_hops", "seconds"):
                    setattr(total, part, getattr(total, part) + getattr(count, part))
                for kind, many in count.findings.items():
                    total.findings[kind] = total.findings.get(kind, 0) + many
        lines += ["", "Scenes with each feature: " + ", ".join(f"{n} {k:,}" for n, k in sorted(self.features.items()))]
        if self.differences:
            lines += ["", "| difference | scenes |", "| --- | ---: |"]
            lines += [f"| {name} | {number:,} |" for name, number in self.differences.items()]
        return "\n".join(lines)

    @classmethod
    def load(cls, path: Path) -> Tally:
        """Return what a file holds, nothing done if it does not exist."""
        if not path.exists():
            return cls()
        held: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        counts = {name: Count(**row) for name, row in held["counts"].items()}
        findings = [(int(k), str(a), str(b), str(c)) for k, a, b, c in held["findings"]]
        return cls(held["begun"], counts, held["features"], findings)

    def save(self, path: Path) -> None:
        """Write all to a file, whole or not at all."""
        write_file(path, json.dumps(asdict(self), indent=1) + "\n")


# Processes ------------------------------------------------------------------------------------------------------------


class Worker:
    """A process that checks one scene after another, and is replaced where it hangs or crashes."""

    def __init__(self) -> None:
        self.number: int | None = None
        self.since_s = 0.0
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection: Connection
        self.connection, theirs = context.Pipe()
        self.process: BaseProcess = context.Process(target=_serve, args=(theirs,), daemon=True)
        self.process.start()
        theirs.close()

    def check(self, number: int) -> None:
        """Begin to check a scene."""
        self.number, self.since_s = number, time.monotonic()
        self.connection.send(number)

    def result(self) -> CheckedScene:
        """Return what the scene that is finished has shown."""
        try:
            found: CheckedScene = self.connection.recv()
        except (EOFError, ConnectionError):
            found = CheckedScene(findings=[Finding(Check.PROCESS, "crash", "the process ended in this scene")])
            self.replace()
        self.number = None
        return found

    def replace(self) -> None:
        """Terminate the process, and start another."""
        self.end()
        self._start()

    def end(self) -> None:
        """Terminate the process."""
        self.process.kill()
        self.process.join()
        self.connection.close()


def _serve(connection: Connection) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    while True:
        try:
            number = connection.recv()
        except EOFError:
            return
        connection.send(check_scene(draw_scene(number)))


class Campaign:
    """Checks scene after scene in processes, and counts."""

    def __init__(self, tally: Tally, state: Path | None, out: Path) -> None:
        self.tally, self._state, self._out = tally, state, out
        self._goes_on = True
        self._shown_s = self._begin_s = time.monotonic()
        self._before = tally.scenes

    def run(self, scenes: int, jobs: int, minutes: float) -> bool:
        """Check scenes up to a number in all, or for some minutes; return False after Ctrl-C."""
        heard = signal.signal(signal.SIGINT, self._end)
        workers = [Worker() for _ in range(jobs)]
        end_s = time.monotonic() + 60.0 * minutes
        try:
            while True:
                under_way = sum(worker.number is not None for worker in workers)
                for worker in workers:
                    wanted = self._goes_on and self.tally.scenes + under_way < scenes and time.monotonic() < end_s
                    if worker.number is None and wanted:
                        worker.check(self.tally.begun)
                        self.tally.begun += 1
                        under_way += 1
                if not under_way:
                    return self._goes_on
                self._collect(workers)
        finally:
            for worker in workers:
                worker.end()
            if self._state is not None:
                self.tally.save(self._state)
            signal.signal(signal.SIGINT, heard)

    def _end(self, *_: object) -> None:
        self._goes_on = False

    def _collect(self, workers: Sequence[Worker]) -> None:
        """Wait for a result or a second, and count what is there."""
        ready = wait([worker.connection for worker in workers if worker.number is not None], timeout=1.0)
        for worker in workers:
            if worker.number is None:
                continue
            number, hangs = worker.number, time.monotonic() - worker.since_s > HANGING_S
            if worker.connection in ready:
                self._count(number, worker.result())
            elif hangs:
                worker.replace()
                worker.number = None
                text = f"the process was terminated after {HANGING_S:g} s"
                self._count(number, CheckedScene(findings=[Finding(Check.TIME_LIMIT, "hangs", text)]))
        if time.monotonic() - self._shown_s > PROGRESS_S:
            self._show()

    def _count(self, number: int, checked: CheckedScene) -> None:
        scene = draw_scene(number)
        self.tally.add(number, law_of(scene), features_of(scene), checked)
        save_findings(number, checked, self._out)
        if self._state is not None and self.tally.scenes % BETWEEN == 0:
            self.tally.save(self._state)

    def _show(self) -> None:
        """Print a line of progress."""
        now_s, tally = time.monotonic(), self.tally
        self._shown_s, done = now_s, tally.scenes - self._before
        impacts = sum(count.certified for count in tally.counts.values())
        rate = (now_s - self._begin_s) / max(1, done)
        found = sum(tally.differences.values())
        text = f"{tally.scenes:,} scenes, {impacts:,} impacts compared, {found:,} differences; {rate:.2f} s a scene"
        print(text, file=sys.stderr, flush=True)


def save_findings(number: int, checked: CheckedScene, out: Path) -> list[Path]:
    """Save a scene once for each difference that was found in it, with the reason as its description."""
    scene, paths = draw_scene(number), []
    for finding in checked.findings:
        out.mkdir(parents=True, exist_ok=True)
        name = f"{finding.check.value} {finding.kind}".replace(" ", "-")
        path = out / f"{number}-{name}.toml"
        reason = f"{finding.check.value}: {finding.kind}: {finding.text}"
        save_scene(scene.model_copy(update={"description": reason}), path)
        paths.append(path)
        print(f"scene {number}: {reason}\n    {path}; again: python -m tests.campaign.features --scene {number}")
    sys.stdout.flush()
    return paths


def main(arguments: Sequence[str] | None = None) -> int:
    """Return 1 if a scene differs, 130 after Ctrl-C, else 0."""
    parser = argparse.ArgumentParser("python -m tests.campaign.features", description=__doc__)
    parser.add_argument("--scenes", type=int, default=100, help="how many in all, those of --state included (100)")
    parser.add_argument("--jobs", type=int, default=1, help="processes, one core each (1)")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="for how long at most")
    parser.add_argument("--state", type=Path, help="JSON file in which counts add up from call to call")
    parser.add_argument("--out", type=Path, default=OUT, help=f"folder for scenes that differ ({OUT})")
    parser.add_argument("--scene", type=int, help="check only the scene of this number")
    options = parser.parse_args(arguments)
    tally = Tally() if options.state is None or options.scene is not None else Tally.load(options.state)
    ended = True
    if options.scene is None:
        ended = Campaign(tally, options.state, options.out).run(options.scenes, options.jobs, options.minutes)
    else:
        scene, checked = draw_scene(options.scene), check_scene(draw_scene(options.scene))
        tally.add(options.scene, law_of(scene), features_of(scene), checked)
        save_findings(options.scene, checked, options.out)
    print(tally.table())
    return 1 if tally.differences else 0 if ended else INTERRUPTED


if __name__ == "__main__":
    sys.exit(main())
