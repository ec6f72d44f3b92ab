"""Runs tasks on a Dask cluster. The results are the same as on this machine.

`ClusterPool.map_unordered` submits each item as a task to Dask. Each engine runs in its own process, as on this
machine. So an engine that aborts affects neither Dask's worker nor other items. If a Dask worker is lost, Dask's
scheduler sends that worker's items to another worker.
"""

from __future__ import annotations

import importlib
import logging
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from typing import Any

from carom.errors import CaromError, InputError, MissingExtraError
from carom.execution.cache_key import find_versions
from carom.execution.describe_engines import engines
from carom.execution.job import Answer, T, Task
from carom.execution.pool import Item, Lane, LocalPool, Pool, TaskRunner
from carom.support.limits import DEFAULT_TIME_LIMIT_S

#: Seconds to wait for the scheduler to accept the connection.
CONNECT_S = 10

#: Largest number of times that Dask's scheduler repeats an item whose worker was lost.
RETRIES = 3

#: Seconds that a cluster may be without a worker. A worker restarts in less time.
WORKERLESS_S = 60.0
#: Seconds between checks of the number of workers.
LOOK_S = 1.0

#: Hint in messages about a lost cluster.
_CONTINUE = "run the command again; if it has an output folder, --resume continues from the finished results"


class ClusterError(CaromError, RuntimeError):
    """The cluster could not be reached, or did not finish some tasks."""


class ClusterPool(Pool):
    """Pool on a Dask cluster.

    At the end of a ``with`` block, the pool disconnects from the cluster. The cluster continues to run.

    Args:
        scheduler: Address of the scheduler, such as ``tcp://10.0.0.1:8786``. For ``tls://``, the certificates in Dask's
            configuration are used.
        time_limit_s: Time limit of a task, in seconds, as in `carom.execution.pool.Lane`.
        memory_limit_mb: Memory limit of each process on the cluster, in megabytes, as in `carom.execution.pool.Lane`.

    Raises:
        MissingExtraError: distributed (the extra `cluster`) is not installed.
        ClusterError: No scheduler answers at the address, or the scheduler has no worker.
        InputError: A worker has other versions of an engine or of Carom than this machine, so results could differ.
    """

    def __init__(
        self, scheduler: str, time_limit_s: float = DEFAULT_TIME_LIMIT_S, memory_limit_mb: float | None = None
    ) -> None:
        try:
            distributed: Any = importlib.import_module("distributed")  # the package has no type hints
        except ImportError:
            problem = "--scheduler needs distributed, which is not installed"
            raise MissingExtraError(problem, hints=["pip install 'carom[cluster]'"]) from None
        for name in ("distributed", "distributed.client"):  # these loggers print tracebacks when a cluster is lost
            logging.getLogger(name).setLevel(logging.CRITICAL)
        self._limits, self._address = (time_limit_s, memory_limit_mb), scheduler
        try:
            self._client: Any = distributed.Client(scheduler, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:  # TypeError means that certificates for TLS are missing
            reason = str(error) or type(error).__name__
            hints = [f"start one with `dask scheduler`, and its workers with `dask worker {scheduler}`"]
            raise ClusterError(f"no Dask scheduler at {scheduler}: {reason}", hints=hints) from None
        try:
            self._require_same_versions()
        except BaseException:
            self._client.close()
            raise

    def close(self) -> None:
        """Disconnect from the cluster."""
        self._client.close()

    def to_local_pool(self) -> AbstractContextManager[Pool]:
        """Return a pool on this machine with one worker process for each engine."""
        return LocalPool(1, *self._limits)

    def run_each(self, tasks: Sequence[Task[T]]) -> Iterator[Answer[T]]:
        """Carry out tasks of one engine on one of the cluster's workers."""
        return (answer for answers in self.map_unordered([("", tasks)], _run_each) for answer in answers)

    def map_unordered(
        self, items: Iterable[tuple[str, Item]], work: Callable[[Item, TaskRunner], Iterable[T]]
    ) -> Iterator[list[T]]:
        """Process the items on the cluster. When an item is finished, yield the list of its results.

        Raises:
            ClusterError: Some items lost their workers repeatedly, the scheduler is gone, or the cluster had no worker
                for `WORKERLESS_S` seconds. The error about lost workers is raised after all other results have been
                yielded.
        """
        distributed: Any = importlib.import_module("distributed")
        submitted = {
            self._client.submit(_carry_out, work, item, self._limits, pure=False, retries=RETRIES): name
            for name, item in items
        }
        lost_tasks = []
        with self._watch_workers(submitted) as reasons:
            for future in distributed.as_completed(list(submitted), loop=self._client.loop):
                name = submitted[future]
                try:
                    results: list[T] = future.result()
                except distributed.scheduler.KilledWorker:
                    lost_tasks.append(name)
                except (distributed.CancelledError, distributed.comm.CommClosedError):
                    why = "".join(reasons) or f"the Dask scheduler at {self._address} went away"
                    raise ClusterError(f"{why}; tasks left: {len(submitted)}", hints=[_CONTINUE]) from None
                else:
                    yield results
                # A future is removed only after `result` returns. If a worker was lost after its task, `result` waits
                # until `watch` cancels the future.
                del submitted[future]
                future.release()
        if lost_tasks:
            problem = f"workers of the cluster at {self._address} ended; tasks lost"
            raise ClusterError(f"{problem}: {len(lost_tasks)}; the first is {lost_tasks[0]}", hints=[_CONTINUE])

    @contextmanager
    def _watch_workers(self, submitted: Mapping[Any, str]) -> Iterator[list[str]]:
        """Cancel the submitted items when the context ends, or when no worker has existed for `WORKERLESS_S` seconds.

        Yield a list that is empty at first. If the cluster lacks workers, the reason is appended to the list.
        """
        has_ended, reasons = threading.Event(), list[str]()

        def watch() -> None:
            last_seen_s = time.monotonic()
            while not has_ended.wait(LOOK_S):
                with suppress(Exception):  # a scheduler that does not answer counts as a scheduler without workers
                    if self._client.scheduler_info()["workers"]:
                        last_seen_s = time.monotonic()
                if time.monotonic() - last_seen_s > WORKERLESS_S:
                    reasons.append(f"the cluster at {self._address} had no worker for {WORKERLESS_S:g} s")
                    break
            with suppress(Exception):  # the scheduler may be gone
                self._client.cancel(list(submitted))

        thread = threading.Thread(target=watch, daemon=True)
        thread.start()
        try:
            yield reasons
        finally:
            has_ended.set()
            thread.join(CONNECT_S)

    def _require_same_versions(self) -> None:
        if not self._client.scheduler_info()["workers"]:
            hints = [f"start some with `dask worker {self._address}`"]
            raise ClusterError(f"the cluster at {self._address} has no worker", hints=hints)
        local_versions = _list_versions()
        for worker, its_versions in self._client.run(_list_versions).items():
            for engine in sorted(local_versions.keys() | its_versions.keys()):
                if local_versions.get(engine) != its_versions.get(engine):
                    there, here = (_format_versions(one.get(engine)) for one in (its_versions, local_versions))
                    problem = f"{engine} is {there} on the cluster's worker {worker}, but {here} on this machine"
                    hints = ["install the same versions on both"]
                    raise InputError(f"{problem}: results would not be the same", hints=hints)


def _list_versions() -> dict[str, tuple[tuple[str, str], ...]]:
    return {info.name: find_versions(info.name) for info in engines()}


def _format_versions(versions: tuple[tuple[str, str], ...] | None) -> str:
    return ", ".join(f"{name} {version or 'missing'}" for name, version in versions) if versions else "not known"


_THREAD_LOCAL = threading.local()


def _carry_out(
    work: Callable[[Item, TaskRunner], Iterable[T]], item: Item, limits: tuple[float, float | None]
) -> list[T]:
    """Process one item in a worker of the cluster. Engines keep running between items."""
    if not hasattr(_THREAD_LOCAL, "lane"):
        _THREAD_LOCAL.lane = Lane(*limits)  # never closed: the processes of the lane end when this process ends
    return list(work(item, _THREAD_LOCAL.lane))


def _run_each(tasks: Sequence[Task[T]], runner: TaskRunner) -> Iterator[Answer[T]]:
    return runner.run_each(tasks)
