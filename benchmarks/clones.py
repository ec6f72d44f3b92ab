"""Time of the first commands in clones of HEAD and another commit: ``python -m benchmarks.clones --since COMMIT``.

The benchmark clones HEAD and the other commit into a temporary folder, and times both in turn. First `make report` runs
with nothing installed. After `make test` has installed packages, all commands are timed again. The benchmark takes a
quarter of an hour and needs the network.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from benchmarks.arguments import count, parser, run

from carom.errors import CaromError

ROOT = Path(__file__).parents[1]
#: Environment without variables of an active virtual environment, so that make uses the clone's environment.
_ENVIRONMENT = {name: value for name, value in os.environ.items() if name not in {"VIRTUAL_ENV", "MAKEFLAGS"}}
_CELL = (".venv/bin/carom", "run", "paper/missed", "-e", "pymunk", "-p", "tuned", "--dt", "1/24", "--fail-on", "never")
#: Like `make report`, but with one run at a time, so that no run waits for another.
_SUITE = (".venv/bin/carom", "run", "--no-timing", "--jobs", "1", "--fail-on", "never", "--out", "reports/untimed")


def called(command: tuple[str, ...], folder: Path) -> tuple[float, float]:
    """Run a command in a folder. Return the elapsed seconds, and the seconds of processor time.

    Raises:
        CaromError: The command failed. The message contains the end of the command's output.
    """
    before, began_s = os.times(), time.perf_counter()
    done = subprocess.run(  # noqa: S603 - our own commands
        command, cwd=folder, env=_ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False
    )
    took_s, after = time.perf_counter() - began_s, os.times()
    if done.returncode:
        last = "\n".join(done.stdout.splitlines()[-20:])
        raise CaromError(f"{' '.join(command)!r} in {folder} ended with {done.returncode}:\n{last}")
    return took_s, sum(after[2:4]) - sum(before[2:4])


def clone(commit: str, folder: Path) -> Path:
    """Clone a commit, and return the folder."""
    called(("git", "clone", "--quiet", str(ROOT), str(folder)), ROOT)
    called(("git", "checkout", "--quiet", commit), folder)
    return folder


def elapsed_s(*command: str, folder: Path) -> float:
    """Return the elapsed seconds of a command in a clone."""
    return called(command, folder)[0]


def processor_s(*command: str, folder: Path) -> float:
    """Return the seconds of processor time of a command and all its child processes in a clone."""
    return called(command, folder)[1]


def row(name: str, timed: Callable[..., float], clones: list[Path], repeats: int) -> None:
    """Print the medians of both clones, and their ratio."""
    taken: list[list[float]] = [[], []]
    for _ in range(repeats):
        for times, folder in zip(taken, clones, strict=True):
            times.append(timed(folder=folder))
    ours, theirs = map(statistics.median, taken)
    print(f"{name:48} {ours:8.2f} {theirs:8.2f} {ours / theirs:6.2f}", flush=True)


def main(since: str, repeats: int) -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as folder:
        clones = [clone("HEAD", Path(folder, "here")), clone(since, Path(folder, "there"))]
        print(f"{'seconds':48} {'HEAD':>8} {since[:8]:>8} {'ratio':>6}")
        row("make report, nothing installed", partial(elapsed_s, "make", "report"), clones, 1)
        for one in clones:
            called(("make", "test"), one)
        row("make test, installed", partial(elapsed_s, "make", "test"), clones, repeats)
        row("make report, installed: the suite", partial(elapsed_s, "make", "report"), clones, repeats)
        row("make report, installed: processor time", partial(processor_s, "make", "report"), clones, 1)
        row("the suite without timing, processor time", partial(processor_s, *_SUITE), clones, repeats)
        row("one cell, processor time", partial(processor_s, *_CELL), clones, 3 * repeats)


if __name__ == "__main__":
    command = parser("benchmarks.clones", __doc__)
    command.add_argument("--since", default="HEAD~1", metavar="COMMIT", help="the other commit, such as HEAD~1")
    command.add_argument("--repeats", type=count, default=3, help="number of measurements of each command")
    run(command, main)
