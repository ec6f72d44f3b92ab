"""A cluster that loses its last worker, or its scheduler, ends in a sentence, and not in silence."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.attacks.clusters import Processes, started

from carom.runs import cluster
from carom.runs.cluster import ClusterError, ClusterPool

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(
        importlib.util.find_spec("distributed") is None, reason="distributed, extra cluster, is missing"
    ),
]


@pytest.fixture
def processes(tmp_path: Path) -> Iterator[Processes]:
    """A scheduler and one worker."""
    with started(tmp_path) as found:
        yield found


@pytest.mark.parametrize(
    ("which", "words"),
    [("worker", "the cluster had no worker for 3 s; "), ("scheduler", "the cluster's scheduler went away|no worker")],
)
def test_a_cluster_that_goes_away_is_told(
    processes: Processes, monkeypatch: pytest.MonkeyPatch, which: str, words: str
) -> None:
    """The pieces that are left are counted, and what is finished was handed over before."""
    monkeypatch.setattr(cluster, "WORKERLESS_S", 3.0)

    def work(item: float, asker: object) -> list[float]:  # of this function, so that its code travels
        import time

        del asker
        time.sleep(item)
        return [item]

    with ClusterPool(processes.address) as pool:
        found = pool.each([("quick", 0.0), ("slow", 600.0), ("slow", 601.0)], work)
        assert next(found) == [0.0]
        getattr(processes, which).kill()
        with pytest.raises(ClusterError, match=f"({words}).*2 pieces of work are left, and --resume goes on"):
            next(found)
