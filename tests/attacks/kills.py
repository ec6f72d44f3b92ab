"""Commands killed outright at random moments and taken up again: the end is that of one left alone, nothing is left."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random
from shutil import rmtree
from typing import Any

from tests.attacks.guard import left_over

from carom.runs.journal import canonical

#: In the environment of all that is started, so that what is left over can be told.
MARK = "CAROM_ATTACK=kills"
#: Kills of one piece of work; then it is let end.
KILLS = 10


def _run(folder: Path) -> Any:
    """Return what a cross-check says, without its times."""
    head, *rows = [json.loads(line) for line in (folder / "results.jsonl").read_text().splitlines()]
    for row in rows:
        row.pop("timing", None)
    return [head["rows"], head["scenes"], head["sampling"], *(json.dumps(row, sort_keys=True) for row in rows)]


def _bench(folder: Path) -> Any:
    return canonical(folder / "journal.jsonl")


def _timed(folder: Path) -> Any:
    """Return what a bench has scored, and what it has timed, without the times."""
    timings = [json.loads(line) for line in (folder / "timings.jsonl").read_text().splitlines()[1:]]
    return [
        _bench(folder),
        *sorted(json.dumps(one["key"], sort_keys=True) for one in timings),
        (folder / "bench.json").exists(),
    ]


def _stress(folder: Path) -> Any:
    found = json.loads((folder / "stress.json").read_text())
    scenes = {path.name: path.read_bytes() for path in (folder / "scenes").iterdir()}
    return [json.dumps(found["lines"], sort_keys=True), scenes]


#: By name: the command, the option of its folder, and what must be equal.
WORK: dict[str, tuple[tuple[str, ...], str, Callable[[Path], Any]]] = {
    "run": (("run", "paper/late", "-e", "pit", "-e", "pic", "--no-timing", "--fail-on", "never"), "--report", _run),
    "bench": (
        ("bench", "paper/late", "-e", "pit", "-e", "pic", "--no-timing", "--dt", "1/60..1/4000:12"),
        "--out",
        _bench,
    ),
    "timing": (("bench", "paper/late", "-e", "pit", "--dt", "1/60", "--rounds", "3", "--budget", "6"), "--out", _timed),
    "stress": (("stress", "tunnelling", "-e", "pit", "--quick"), "--out", _stress),
}


def attack(rng: Random, folder: Path) -> Iterator[str]:
    """Kill each command a few times, then let it end."""
    temporary = folder / "temporary"
    while True:
        for name, (command, option, equal) in WORK.items():
            rmtree(folder / "work", ignore_errors=True)
            temporary.mkdir(exist_ok=True)
            began = time.monotonic()
            alone, out = folder / "work" / "alone", folder / "work" / "killed"
            done = carom(folder, *command, option, str(alone))
            took_s = time.monotonic() - began
            if done.returncode:
                yield f"{name}: exit code {done.returncode}: {done.stderr[-300:]}"
                continue
            for _ in range(KILLS):
                carom(folder, *command, option, str(out), "--resume", kill_after_s=rng.uniform(0.0, took_s))
                yield _orphans(name)
            done = carom(folder, *command, option, str(out), "--resume")
            if done.returncode or equal(out) != equal(alone):
                yield f"{name}: taken up {KILLS} times it is not what one left alone is: {done.stderr[-300:]}"
            yield left_over(MARK, temporary)


def carom(folder: Path, *arguments: str, kill_after_s: float | None = None) -> subprocess.CompletedProcess[str]:
    """Run a command with a folder of its own for temporary files; kill it outright after a while if it still runs."""
    name, _, value = MARK.partition("=")
    environment = {**os.environ, name: value, "TMPDIR": str(folder / "temporary")}
    process = subprocess.Popen(
        [sys.executable, "-m", "carom", *arguments],
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        _, said = process.communicate(timeout=300.0 if kill_after_s is None else kill_after_s)
    except subprocess.TimeoutExpired:
        process.kill()
        _, said = process.communicate()
    return subprocess.CompletedProcess(arguments, process.returncode, "", said)


def _orphans(name: str) -> str:
    """Say what processes of a killed command live on; its temporary folders may lie there until the next start."""
    found = left_over(MARK, Path("/nowhere"))
    return found and f"{name}: {found}"
