"""A sweep killed outright, again and again, beside one left alone: ``python -m carom.bench.campaign [cells] [kills]``.

Both must end with the same journal. The cells are cheap: PIT and PIC on two discs at steps and phases of their own.
"""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import tempfile
import time
from argparse import SUPPRESS
from dataclasses import dataclass
from pathlib import Path

from carom.bench.arguments import count, parser, run
from carom.runs.journal import Journal, canonical
from carom.runs.local import LocalPool
from carom.runs.results import Cell
from carom.runs.sweep import sweep
from carom.scene import Disc, Scene

__all__ = ["Campaign", "campaign", "campaign_cells", "main"]

#: Steps of a run: few, since it is the journal that is tried.
_STEPS = 20


@dataclass(frozen=True)
class Campaign:
    """What a campaign found.

    Attributes:
        cells: How many cells there were.
        kills: After how many lines of the journal the sweep was killed, one number a kill.
        torn: How many of the kills left a torn last line.
        lines: Lines of the killed sweep's journal in the end.
        equal: Whether both journals hold the same, to the bit.
        undisturbed_s: Seconds of the sweep that was left alone.
        killed_s: Seconds of all sittings of the other.
    """

    cells: int
    kills: tuple[int, ...]
    torn: int
    lines: int
    equal: bool
    undisturbed_s: float
    killed_s: float


def campaign_cells(count: int) -> list[Cell]:
    """Return so many cheap cells, all different."""
    scene = Scene(
        name="campaign",
        discs=[
            Disc(position_m=(0.0, 0.0), velocity_m_s=(1.0, 0.0), radius_m=0.5),
            Disc(position_m=(3.0, 0.3), velocity_m_s=(-1.0, 0.0), radius_m=0.5),
        ],
        duration_s=2.0,
    )
    kinds = itertools.product(range(count), ("pit", "pic"), ("default", "tuned"), (0.0, 0.25, 0.5, 0.75))
    return [
        Cell(scene, engine, profile, scene.duration_s / (_STEPS + 0.01 * k), 0, phase)
        for k, engine, profile, phase in itertools.islice(kinds, count)
    ]


def campaign(cells: int, kills: int, folder: Path, jobs: int = 2) -> Campaign:
    """Run a sweep twice, once left alone and once killed outright so many times, and compare the journals."""
    alone, killed = folder / "undisturbed.jsonl", folder / "killed.jsonl"
    started = time.perf_counter()
    _run(cells, alone, jobs)
    undisturbed_s, started = time.perf_counter() - started, time.perf_counter()
    at, torn = [], 0
    for k in range(kills):
        with subprocess.Popen(_command(cells, killed, jobs)) as process:  # noqa: S603 - our own interpreter and module
            wanted = cells * (k + 1) // (kills + 1)
            while process.poll() is None and _lines(killed) < wanted:
                time.sleep(0.002)
            process.send_signal(signal.SIGKILL)
        at.append(_lines(killed))
        torn += not killed.read_bytes().endswith(b"\n")
    _run(cells, killed, jobs)
    return Campaign(
        cells,
        tuple(at),
        torn,
        _lines(killed),
        canonical(alone) == canonical(killed) and len(canonical(alone)) == cells,
        undisturbed_s,
        time.perf_counter() - started,
    )


def _command(cells: int, path: Path, jobs: int) -> list[str]:
    return [sys.executable, "-m", "carom.bench.campaign", str(cells), "--sitting", str(path), "--jobs", str(jobs)]


def _run(cells: int, path: Path, jobs: int) -> None:
    subprocess.run(_command(cells, path, jobs), check=True)  # noqa: S603 - our own interpreter and module


def _sitting(cells: int, path: Path, jobs: int) -> None:
    with LocalPool(jobs) as pool, Journal(path, resume=True) as journal:
        sweep(campaign_cells(cells), pool, journal)


def _lines(path: Path) -> int:
    return path.read_bytes().count(b"\n") if path.exists() else 0


def main(cells: int, kills: int, sitting: Path | None, jobs: int) -> None:
    """Print what came of it; the exit code is 1 where the journals differ."""
    if sitting is not None:
        _sitting(cells, sitting, jobs)
        return
    with tempfile.TemporaryDirectory(prefix="carom-campaign-") as folder:
        found = campaign(cells, kills, Path(folder), jobs)
    print(f"{found.cells} cells; left alone: {found.undisturbed_s:.0f} s")
    print(f"killed after {', '.join(map(str, found.kills))} lines ({found.torn} of them torn): {found.killed_s:.0f} s")
    print(f"journals: {found.lines} lines, {'the same content' if found.equal else 'DIFFERENT CONTENT'}")
    if not found.equal:
        raise SystemExit(1)


if __name__ == "__main__":
    command = parser("carom.bench.campaign", __doc__)
    command.add_argument("cells", nargs="?", type=count, default=10_000, help="cells of the sweep")
    command.add_argument("kills", nargs="?", type=count, default=3, help="how often it is killed")
    command.add_argument("--sitting", type=Path, metavar="JOURNAL", help=SUPPRESS)  # one that is killed: for `_command`
    command.add_argument("--jobs", type=count, default=os.cpu_count() or 1, help="processes of the sweep")
    run(command, main)
