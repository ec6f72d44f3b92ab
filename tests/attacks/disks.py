"""Disks that are full at some byte: a sentence and exit code 2; with room again the work goes on to the same end."""

import resource
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from random import Random
from shutil import rmtree

from tests.journal_lines import read_canonical_lines

COMMAND = (
    sys.executable,
    *["-m", "carom", "bench", "paper/late", "-e", "pit", "--no-timing", "--dt", "1/60..1/1000:6", "--out"],
)


def attack(rng: Random, folder: Path) -> Iterator[str]:
    """A disk that becomes full while Carom writes.

    Carom shows a message and exits with 2; with free space the final result is the same.
    """
    rmtree(folder / "work", ignore_errors=True)
    alone, out = folder / "work" / "alone", folder / "work" / "full"
    _run_bench(alone, None)
    while True:
        rmtree(out, ignore_errors=True)
        most = rng.choice((1, 100, 1000, 5000, 20_000, rng.randrange(1, 100_000)))
        done = _run_bench(out, most)
        if done.returncode not in (0, 2) or "Traceback" in done.stderr or (done.returncode and not done.stderr):
            yield f"{most} bytes a file: exit code {done.returncode}: {done.stderr[-300:]}"
            continue
        done = _run_bench(out, None, "--resume")
        journals = [read_canonical_lines(path / "journal.jsonl") for path in (out, alone) if not done.returncode]
        held = not done.returncode and journals[0] == journals[1]
        yield "" if held else f"{most} bytes a file, then room: {done.returncode}: {done.stderr[-300:]}"
        with Path("/dev/full").open("wb") as full:
            command = [*COMMAND[:3], "scenes"]
            printed = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
        held = printed.returncode == 2 and printed.stderr.count("\n") == 1
        yield "" if held else f"/dev/full: {printed.stderr[-300:]}"


def _run_bench(out: Path, most: int | None, *options: str) -> subprocess.CompletedProcess[str]:
    def limit() -> None:
        if most is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))

    command = [*COMMAND, str(out), *options]
    return subprocess.run(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, preexec_fn=limit, check=False
    )
