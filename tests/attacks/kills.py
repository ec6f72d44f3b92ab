"""Commands that are killed at random moments and resumed: the result is that of an undisturbed command."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from random import Random
from shutil import rmtree
from typing import Any

from tests.attacks.guard import find_leftovers
from tests.journal_lines import read_canonical_lines

#: Mark in the environment of all started processes, so that remaining ones can be identified.
MARK = "CAROM_ATTACK=kills"
#: Kills of one piece of work; then it is let end.
KILLS = 10
#: No command hangs: seconds that one may take that is left alone, also on a machine that is busy.
LONGEST_S = 1800.0


def _read_cross_check(folder: Path) -> Any:
    """Return what a cross-check says, without its times."""
    head, *rows = [json.loads(line) for line in (folder / "results.jsonl").read_text().splitlines()]
    for row in rows:
        row.pop("timing", None)
    return [head["rows"], head["scenes"], head["sampling"], *(json.dumps(row, sort_keys=True) for row in rows)]


def _read_journal(folder: Path) -> Any:
    """Return the journal of a command, and the scenes that it has saved."""
    scenes = {path.name: path.read_bytes() for path in folder.glob("scenes/*")}
    return [read_canonical_lines(folder / "journal.jsonl"), scenes]


def _read_timings(folder: Path) -> Any:
    """Return what a bench has scored, and what it has timed, without the times."""
    timings = [json.loads(line) for line in (folder / "timings.jsonl").read_text().splitlines()[1:]]
    keys = sorted(json.dumps(one["key"], sort_keys=True) for one in timings)
    return [_read_journal(folder), *keys, (folder / "bench.json").exists()]


def _read_files(folder: Path) -> Any:
    """Return all files of a command that has no journal, and so begins again, and what it has printed."""
    return {path.name: path.read_bytes() for path in folder.iterdir()}


#: By name: the command, the option of its folder, and what must be equal. FOLDER is the folder of this attack.
WORK: dict[str, tuple[str, str, Callable[[Path], Any]]] = {
    "run": ("run paper/late -e pit -e pic --no-timing --fail-on never --resume", "--report", _read_cross_check),
    "bench": ("bench paper/late -e pit -e pic --no-timing --dt 1/60..1/4000:12 --resume", "--out", _read_journal),
    "timing": ("bench paper/late -e pit --dt 1/60 --rounds 3 --budget 1e5 --resume", "--out", _read_timings),
    "stress": ("stress tunnelling -e pit --quick --resume", "--out", _read_journal),
    "tune": ("tune pymunk paper/late --trials 6 --resume", "--out", _read_journal),
    "advise": ("advise paper/late -e pit --phases 2 --budget 20000", "", _read_files),
    "certify": ("certify paper/late classics/bank-shot --digits 30", "--out", _read_files),
    "diff": ("diff FOLDER/old FOLDER/new --engine pymunk=box2d --fail-on never", "--page", _read_files),
}
#: What two reports are made of, for `diff`.
REPORTS = {"old": "pymunk", "new": "box2d"}


def attack(rng: Random, folder: Path) -> Iterator[str]:
    """Commands killed at a random moment and resumed.

    The final result is the same; no process and no folder remains.
    """
    temporary = folder / "temporary"
    temporary.mkdir(exist_ok=True)
    _make_reports(folder)
    while True:
        for name, (_, _, equal) in WORK.items():
            rmtree(folder / "work", ignore_errors=True)
            began = time.monotonic()
            alone, out = folder / "work" / "alone", folder / "work" / "killed"
            done = _run_work(name, folder, alone)
            took_s = time.monotonic() - began
            if done.returncode:
                yield f"{name}: exit code {done.returncode}: {done.stderr[-300:]}"
                continue
            for _ in range(KILLS):
                _run_work(name, folder, out, kill_after_s=rng.uniform(0.0, took_s))
                # Its temporary folders may remain until the next start.
                left = find_leftovers(MARK, Path("/nowhere"))
                yield left and f"{name}: {left}"
            done = _run_work(name, folder, out)
            if done.returncode or equal(out) != equal(alone):
                yield f"{name}: taken up {KILLS} times it is not what one left alone is: {done.stderr[-300:]}"
            yield find_leftovers(MARK, temporary)


def _make_reports(folder: Path) -> None:
    """Make the two reports that are compared."""
    for name, engine in REPORTS.items():
        if not (folder / name / "results.jsonl").exists():
            words = f"run paper -e {engine} --no-timing --fail-on never --dt 1/60 --report".split()
            _run_carom(folder, [*words, str(folder / name)])


def _run_work(
    name: str, folder: Path, out: Path, kill_after_s: float | None = None
) -> subprocess.CompletedProcess[str]:
    """Do a piece of work into a folder, or go on with it."""
    command, option, read = WORK[name]
    words = command.replace("FOLDER", str(folder)).split()
    if option:
        words += [option, str(out / "page.html" if option == "--page" else out)]
    printed = Path(os.devnull)
    if read is _read_files and option != "--out":
        out.mkdir(parents=True, exist_ok=True)
        printed = out / "printed.txt"
    return _run_carom(folder, words, printed, kill_after_s)


def _run_carom(
    folder: Path, words: Sequence[str], printed: Path = Path(os.devnull), kill_after_s: float | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a command with a folder of its own for temporary files; kill it after a while if it still runs."""
    name, _, value = MARK.partition("=")
    environment = {**os.environ, name: value, "TMPDIR": str(folder / "temporary")}
    with printed.open("w") as out:
        command = [sys.executable, "-m", "carom", *words]
        process = subprocess.Popen(command, env=environment, stdout=out, stderr=subprocess.PIPE, text=True)
        try:
            _, told = process.communicate(timeout=LONGEST_S if kill_after_s is None else kill_after_s)
        except subprocess.TimeoutExpired:
            process.kill()
            _, told = process.communicate()
    return subprocess.CompletedProcess(command, process.returncode, "", told)
