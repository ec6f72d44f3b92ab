"""A Dask cluster that loses its worker or its scheduler at any moment: the end is a sentence, and what is done is kept.

The rest, taken up in this process, gives the journal of a sweep that was left alone, to the bit.
"""

import re
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from unittest import mock

from tests.attacks.guard import HangError, limit_time
from tests.in_process_pool import InProcessPool
from tests.journal_lines import read_canonical_lines
from tests.random_scenes import draw_scene

from carom.execution import cluster
from carom.execution.cluster import ClusterError, ClusterPool
from carom.execution.job import Job, Method
from carom.execution.pool import Pool
from carom.execution.score_jobs import score_jobs, score_journal

#: Long enough for a process to start on a machine that is busy.
PATIENT_S = 120.0
#: A cluster without a worker is given up after so long here, in seconds.
WORKERLESS_S = 3.0
#: Work that takes some seconds on a cluster of one worker.
DTS = tuple(0.1 / k for k in range(1, 13))


@dataclass(frozen=True)
class Processes:
    """A scheduler and one worker, as somebody starts them from a shell, and the scheduler's address."""

    address: str
    scheduler: subprocess.Popen[bytes]
    worker: subprocess.Popen[bytes]


@contextmanager
def start_cluster(folder: Path) -> Iterator[Processes]:
    """Start a cluster of one worker; at the end both are killed."""
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
            yield Processes(address, *running)
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
    """Kill a worker or a scheduler at a moment drawn by lot."""
    import_module("distributed")  # half a minute on a machine that is busy: no part of what the guard allows
    while True:
        yield _find_loss(rng, rng.choice(("worker", "scheduler")), folder)


def _find_loss(rng: Random, which: str, folder: Path) -> str:
    """Return what is wrong after a cluster went away; empty where nothing is."""
    number, path, after_s = rng.randrange(2**32), folder / "journal.jsonl", rng.uniform(0.0, 4.0)
    what = f"{which} killed after {after_s:.2f} s, scene {number}"
    path.unlink(missing_ok=True)
    _sweep(number, InProcessPool(), path)
    alone = read_canonical_lines(path)
    path.unlink()
    try:
        with (
            TemporaryDirectory(dir=folder) as place,
            start_cluster(Path(place)) as processes,
            mock.patch.object(cluster, "WORKERLESS_S", WORKERLESS_S),
            limit_time(PATIENT_S, busy=1.0),
            mock.patch.object(cluster, "CONNECT_S", PATIENT_S),
        ):
            killer = threading.Timer(after_s, getattr(processes, which).kill)
            try:
                with ClusterPool(processes.address) as pool:
                    killer.start()
                    _sweep(number, pool, path)
            finally:
                killer.cancel()
    except ClusterError as error:
        if not re.search(r"tasks left: \d+; .*--resume continues", str(error)):
            return f"{what}: it does not say how to go on: {error}"
    except HangError:
        return f"{what}: no end after {PATIENT_S:g} s"
    except Exception as error:  # noqa: BLE001 - this is what is looked for
        return f"{what}: {type(error).__name__}: {str(error)[:200]!r}"
    _sweep(number, InProcessPool(), path)
    return "" if read_canonical_lines(path) == alone else f"{what}: another journal"


def _sweep(number: int, pool: Pool, path: Path) -> None:
    scene = draw_scene("anywhere", number).model_copy(update={"duration_s": 3.0})
    jobs = [Job(scene, Method(engine, "tuned"), dt_s) for engine in ("pit", "pic") for dt_s in DTS]
    with score_journal(path, resume=True) as journal:
        score_jobs(jobs, pool, journal)
