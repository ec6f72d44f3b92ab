"""The same work here, in workers and on a Dask cluster: the same journal to the bit."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import Any

from tests.drawn import drawn

from carom.execution.job import Job, Method
from carom.execution.journal import canonical
from carom.execution.pool import InProcessPool, LocalPool, Pool
from carom.execution.sweep import score_journal, sweep


def attack(rng: Random, folder: Path) -> Iterator[str]:
    """Sweep a scene drawn by lot in each of these ways."""
    while True:
        number = rng.randrange(2**32)
        path = folder / "digest.jsonl"
        alone = _swept(number, InProcessPool(), path)
        for workers in (1, 2):
            with LocalPool(workers) as pool:
                yield "" if _swept(number, pool, path) == alone else f"scene {number}: {workers} workers"
        yield "" if _on_a_cluster(number, path) == alone else f"scene {number}: on a cluster"


def _swept(number: int, pool: Pool, path: Path) -> list[bytes]:
    scene = drawn("anywhere", number).model_copy(update={"duration_s": 3.0})
    jobs = [
        Job(scene, Method(engine, "tuned"), dt, 0, phase)
        for engine in ("pit", "pic")
        for dt in (0.1, 0.01)
        for phase in (0.0, 0.5)
    ]
    path.unlink(missing_ok=True)
    with score_journal(path) as journal:
        sweep(jobs, pool, journal)
    return canonical(path)


def _on_a_cluster(number: int, path: Path) -> list[bytes]:
    distributed: Any = importlib.import_module("distributed")  # untyped
    from carom.execution.cluster import ClusterPool

    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None, silence_logs=50
        ) as cluster,
        ClusterPool(cluster.scheduler_address) as pool,
    ):
        return _swept(number, pool, path)
