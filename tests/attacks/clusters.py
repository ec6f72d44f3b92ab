"""Clusters of Dask that lose their worker or scheduler at any moment."""

import re
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from importlib import import_module
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from unittest import mock

from tests.attacks.guard import try_act
from tests.in_process_pool import InProcessPool
from tests.journal_lines import read_canonical_lines
from tests.processes import PATIENT_S
from tests.random_scenes import draw_scene

from carom.execution import cluster
from carom.execution.cluster import ClusterPool
from carom.execution.job import Job, Method
from carom.execution.pool import Pool
from carom.execution.score_jobs import score_jobs, score_journal

#: A cluster without a worker is given up after so long here, in seconds.
WORKERLESS_S = 3.0
#: Work that takes some seconds on a cluster of one worker.
DTS = tuple(0.1 / k for k in range(1, 13))


@contextmanager
def start_cluster(folder: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """Start a scheduler and one worker, as from a shell; give the scheduler's address and both processes."""
    log, dask = folder / "scheduler.log", [sys.executable, "-m", "dask"]
    running: list[subprocess.Popen[bytes]] = []
    with log.open("w") as file:
        try:
            listens = ["--port", "0", "--host", "127.0.0.1", "--no-dashboard"]
            running.append(subprocess.Popen([*dask, "scheduler", *listens], stderr=file, cwd=folder))
            address = _wait_for_log(log, r"tcp://127.0.0.1:\d+")
            works = [address, "--nthreads", "1", "--no-nanny", "--no-dashboard"]
            running.append(subprocess.Popen([*dask, "worker", *works], stderr=file, cwd=folder))
            _wait_for_log(log, "Register worker")
            yield address, running
        finally:
            for process in running:
                process.kill()
                process.wait(PATIENT_S)


def _wait_for_log(log: Path, words: str) -> str:
    """Wait until a log holds some words, and return them."""
    until = time.monotonic() + PATIENT_S
    while not (found := re.search(words, log.read_text())):
        if time.monotonic() > until:
            raise TimeoutError(f"the cluster did not start: {log.read_text()[-300:]}")
        time.sleep(0.1)
    return found[0]


def attack(rng: Random, folder: Path) -> Iterator[str]:
    """A cluster that loses its worker or its scheduler.

    Carom finishes the work or shows a message; a resumed run has a bit-identical journal.
    """
    import_module("distributed")  # half a minute on a machine that is busy: no part of what the guard allows
    while True:
        number, killed, after_s = rng.randrange(2**32), rng.randrange(2), rng.uniform(0.0, 4.0)
        path = folder / "journal.jsonl"
        path.unlink(missing_ok=True)
        _sweep(number, InProcessPool(), path)
        alone = read_canonical_lines(path)
        path.unlink()
        with TemporaryDirectory(dir=folder) as place, start_cluster(Path(place)) as (address, processes):
            killer = threading.Timer(after_s, processes[killed].kill)
            lost = try_act(
                partial(_sweep_on_cluster, number, address, path, killer), "--resume", limit_s=PATIENT_S, busy=1.0
            )
        _sweep(number, InProcessPool(), path)
        if not lost and read_canonical_lines(path) != alone:
            lost = "another journal"
        yield lost and f"{('scheduler', 'worker')[killed]} killed after {after_s:.2f} s, scene {number}: {lost}"


def _sweep_on_cluster(number: int, address: str, path: Path, killer: threading.Timer) -> str:
    """Sweep while a process of the cluster is killed; a loss of the cluster raises a ClusterError."""
    with mock.patch.multiple(cluster, WORKERLESS_S=WORKERLESS_S, CONNECT_S=PATIENT_S):
        try:
            with ClusterPool(address) as pool:
                killer.start()
                _sweep(number, pool, path)
        finally:
            killer.cancel()
    return ""


def _sweep(number: int, pool: Pool, path: Path) -> None:
    scene = draw_scene("anywhere", number).model_copy(update={"duration_s": 3.0})
    jobs = [Job(scene, Method(engine, "tuned"), dt_s) for engine in ("pit", "pic") for dt_s in DTS]
    with score_journal(path, resume=True) as journal:
        score_jobs(jobs, pool, journal)
