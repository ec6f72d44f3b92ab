"""A sweep that is killed outright. Run as a script, this file is the process that is killed: jobs, and a journal."""

from __future__ import annotations

import itertools
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from tests.stage import disc_at, staged

from carom.runs.job import Job, Method
from carom.runs.journal import canonical
from carom.runs.pool import LocalPool
from carom.runs.scoring import score_journal, sweep

#: Steps of a run: few, since it is the journal that is tried.
STEPS = 20


def cheap_jobs(count: int) -> list[Job]:
    scene = staged("campaign", disc_at(0.0, 0.0, 1.0, 0.0), disc_at(3.0, 0.3, -1.0, 0.0), duration_s=2.0)
    kinds = itertools.product(range(count), ("pit", "pic"), ("default", "tuned"), (0.0, 0.25, 0.5, 0.75))
    return [
        Job(scene, Method(engine, profile), scene.duration_s / (STEPS + 0.01 * k), 0, phase)
        for k, engine, profile, phase in itertools.islice(kinds, count)
    ]


def sitting(count: int, path: Path) -> None:
    with LocalPool(2) as pool, score_journal(path, resume=True) as journal:
        sweep(cheap_jobs(count), pool, journal)


def results_in(path: Path) -> int:
    return max(0, path.read_bytes().count(b"\n") - 1) if path.exists() else 0


@pytest.mark.long
def test_a_sweep_killed_three_times_ends_as_one_left_alone(tmp_path: Path) -> None:
    """Killed outright three times and gone on with, a sweep ends with the journal of one that was left alone."""
    jobs, kills, path = 96, 3, tmp_path / "killed.jsonl"
    at = []
    for k in range(kills):
        with subprocess.Popen([sys.executable, __file__, str(jobs), str(path)]) as process:
            while process.poll() is None and results_in(path) < jobs * (k + 1) // (4 * kills):
                time.sleep(0.002)  # of so many the rest takes longer than this process may be kept waiting
            process.send_signal(signal.SIGKILL)
        at.append(results_in(path))
    sitting(jobs, path)
    sitting(jobs, tmp_path / "alone.jsonl")
    assert canonical(path) == canonical(tmp_path / "alone.jsonl")
    assert len(canonical(path)) == jobs + 1  # and the line that says what it is of: nothing was run twice
    assert all(0 < number < jobs for number in at)
    assert at == sorted(at)


if __name__ == "__main__":
    sitting(int(sys.argv[1]), Path(sys.argv[2]))
