"""A cluster that loses its last worker, or its scheduler, ends in a sentence, and not in silence."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from carom.runs import cluster
from carom.runs.cluster import ClusterError, ClusterPool

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(
        importlib.util.find_spec("distributed") is None, reason="distributed, extra cluster, is missing"
    ),
]

PATIENT_S = 120.0


@pytest.fixture
def processes(tmp_path: Path) -> Iterator[dict[str, Any]]:
    """A scheduler and one worker, as somebody starts them from a shell, and the scheduler's address."""
    log = tmp_path / "scheduler.log"
    with log.open("w") as file:
        dask = [sys.executable, "-m", "dask"]
        scheduler = subprocess.Popen(
            [*dask, "scheduler", "--port", "0", "--host", "127.0.0.1", "--no-dashboard"], stderr=file, cwd=tmp_path
        )
        until = time.monotonic() + PATIENT_S
        while not (found := re.search(r"tcp://127.0.0.1:\d+", log.read_text())):
            assert time.monotonic() < until
            time.sleep(0.1)
        asked = [*dask, "worker", found[0], "--nthreads", "1", "--no-nanny", "--no-dashboard"]
        worker = subprocess.Popen(asked, stderr=file, cwd=tmp_path)
        until = time.monotonic() + PATIENT_S
        while "Register worker" not in log.read_text():
            assert time.monotonic() < until
            time.sleep(0.1)
        yield {"address": found[0], "worker": worker, "scheduler": scheduler}
        for process in (worker, scheduler):
            process.kill()
            process.wait(PATIENT_S)


@pytest.mark.parametrize(
    ("which", "words"),
    [("worker", "the cluster had no worker for 3 s; "), ("scheduler", "the cluster's scheduler went away|no worker")],
)
def test_a_cluster_that_goes_away_is_told(
    processes: dict[str, Any], monkeypatch: pytest.MonkeyPatch, which: str, words: str
) -> None:
    """The pieces that are left are counted, and what is finished was handed over before."""
    monkeypatch.setattr(cluster, "WORKERLESS_S", 3.0)

    def work(item: float, asker: object) -> list[float]:  # of this function, so that its code travels
        import time

        del asker
        time.sleep(item)
        return [item]

    with ClusterPool(processes["address"]) as pool:
        found = pool.each([("quick", 0.0), ("slow", 600.0), ("slow", 601.0)], work)
        assert next(found) == [0.0]
        processes[which].kill()
        with pytest.raises(ClusterError, match=f"({words}).*2 pieces of work are left, and --resume goes on"):
            next(found)
