"""Pools of worker processes: equal results in each pool, interrupts at the start, and suspended machines."""

import importlib.util
import itertools
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from types import SimpleNamespace

import pytest
from tests.cases import each
from tests.in_process_pool import InProcessPool
from tests.processes import PATIENT_S, limit_only
from tests.scene_builders import disc_at, staged, wall_at

from carom.execution.job import Status
from carom.execution.pool import LocalPool, Pool
from carom.execution.results import Results
from carom.studies.cross_check.options import Options
from carom.studies.cross_check.plan import build_plan
from carom.studies.cross_check.run import execute

#: Engines that a process survives, and such as end it or never answer.
SOUND = ("pic", "pit", "raises", "goes-nan", "warns", "only-discs", "missing", "broken", "bad-profile")
DEADLY = ("aborts", "exits", "hangs")
#: Time limit of an engine that never answers.
LIMIT_S = 20.0


@contextmanager
def start_dask_pool() -> Iterator[Pool]:
    from distributed import LocalCluster

    from carom.execution.cluster import ClusterPool

    with (
        LocalCluster(n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None) as cluster,  # type: ignore[no-untyped-call] # distributed has no types
        ClusterPool(cluster.scheduler_address, LIMIT_S) as pool,
    ):
        yield pool


#: Pools with processes of their own.
POOLS: dict[str, Callable[[], AbstractContextManager[Pool]]] = {
    "one process": lambda: LocalPool(1, LIMIT_S),
    "three processes": lambda: LocalPool(3, LIMIT_S),
    "dask": start_dask_pool,
}


def run_engines(pool: Pool, *engines: str) -> Results:
    """Return a cross-check of two discs by these engines."""
    scene = staged("oblique", disc_at(0, 0, 1, 0), disc_at(3, 0.3, -1, 0), wall_at(-9, 0, 1, 0), duration_s=2)
    return execute(build_plan([scene], Options(engines, [0.1], ["tuned"], timing=False, samples=False), pool), pool)


@pytest.mark.release
@each("where", POOLS)
@pytest.mark.usefixtures("hostile")
@pytest.mark.filterwarnings("ignore")  # a Dask client leaves sockets behind that Python warns of
def test_every_pool_gives_the_same_results(where: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each pool gives the rows of a run in process to the bit; a crash, time-out or failure has its cause."""
    limit_only(monkeypatch, "hangs")
    if where == "dask" and importlib.util.find_spec("distributed") is None:
        pytest.skip("distributed, extra cluster, is missing")
    alone = {row.job.engine: row for row in run_engines(InProcessPool(), *SOUND).rows}
    with POOLS[where]() as pool:
        rows = {row.job.engine: row for row in run_engines(pool, *SOUND, *DEADLY).rows}
    for engine, status, words in (
        ("aborts", Status.CRASHED, "ended by SIGABRT; it last printed: assertion failed in solver.c:42"),
        ("exits", Status.CRASHED, "exit code 7"),
        ("raises", Status.FAILED, "; it last printed: chatter on standard error"),
        ("hangs", Status.TIMED_OUT, f"no answer within {LIMIT_S:g} s"),
    ):
        row = rows.pop(engine)
        assert row.status is status
        assert words in row.reason
    for engine, row in rows.items():
        same = alone[engine]
        assert (row.status, row.reason, row.trace) == (same.status, same.reason, same.trace)
        assert repr(row.score) == repr(same.score)


@each("first", [1, 2])
def test_interrupt_while_a_pool_starts_leaves_no_thread(first: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A KeyboardInterrupt at the start of a pool's thread is raised, and no thread of the pool stays alive."""
    started: list[threading.Thread] = []

    def start(thread: threading.Thread) -> None:
        started.append(thread)
        if len(started) == first:
            raise KeyboardInterrupt
        begin(thread)

    begin = threading.Thread.start
    monkeypatch.setattr(threading.Thread, "start", start)
    with pytest.raises(KeyboardInterrupt), LocalPool(2, LIMIT_S) as pool:
        list(pool.map_unordered([("pit", 1), ("pic", 2)], lambda item, _: [item]))
    assert not any(thread.is_alive() for thread in started)


def test_suspended_machine_causes_no_timeout(monkeypatch: pytest.MonkeyPatch) -> None:
    """An hour between two readings of the clock does not count against the time limit: the run completes."""
    hours = itertools.count()
    monkeypatch.setattr(
        "carom.execution.workers.worker_process.time", SimpleNamespace(monotonic=lambda: 3600.0 * next(hours))
    )
    with LocalPool(1, PATIENT_S) as pool:
        (row,) = run_engines(pool, "pit").rows
    assert row.status is Status.RAN
