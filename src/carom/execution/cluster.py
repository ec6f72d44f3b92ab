"""A pool that is a Dask cluster: the same work, in the same worker processes, with the same results.

The cluster's tasks are the items of `ClusterPool.each`. Each starts engines in processes of their own, exactly as this
machine would, so that an engine's abort ends neither the cluster's worker nor anybody else's item. A cluster's worker
that is lost takes its items with it; the scheduler gives them to another.
"""

from __future__ import annotations

import importlib
import logging
import re
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from typing import Any, TypeVar

from carom.errors import CaromError, InputError, MissingExtraError
from carom.execution.cache_key import versions_of
from carom.execution.engines import engines
from carom.execution.job import Answer, Task
from carom.execution.pool import Lane, Pool, TaskRunner
from carom.support.checks import shown
from carom.support.limits import DEFAULT_TIME_LIMIT_S

#: How long to wait for the scheduler to answer at all, seconds.
CONNECT_S = 10

#: What was lost with a worker is tried again this many times by the scheduler.
RETRIES = 3

#: A cluster may be without any worker for so long, seconds: one that is started anew is there sooner.
WORKERLESS_S = 60.0
#: How often it is asked how many it has, seconds.
LOOK_S = 1.0

T = TypeVar("T")
Item = TypeVar("Item")


class ClusterError(CaromError, RuntimeError):
    """The cluster could not be reached, or lost work for good."""


class ClusterPool(Pool):
    """A Dask cluster; used as a context manager, it lets go of the cluster, which goes on without us.

    Args:
        scheduler: Address of the scheduler, such as ``tcp://10.0.0.1:8786``; for ``tls://`` the certificates are those
            of Dask's own configuration.
        time_limit_s: As of a `carom.execution.pool.Lane`.
        memory_limit_mb: As of a `carom.execution.pool.Lane`, on each of the cluster's machines.

    Raises:
        MissingExtraError: distributed, the extra `cluster`, is not installed.
        ClusterError: No scheduler answers there, or it has no worker.
        InputError: The versions of a worker are not those here: its results would not be the same ones.
    """

    def __init__(
        self, scheduler: str, time_limit_s: float = DEFAULT_TIME_LIMIT_S, memory_limit_mb: float | None = None
    ) -> None:
        try:
            distributed: Any = importlib.import_module("distributed")  # untyped
        except ImportError:
            raise MissingExtraError(
                "--scheduler needs distributed, which is not installed", hints=["pip install 'carom[cluster]'"]
            ) from None
        for name in ("distributed", "distributed.client"):  # what it says of a cluster that is lost is tracebacks
            logging.getLogger(name).setLevel(logging.CRITICAL)
        self._limits = (time_limit_s, memory_limit_mb)
        if not re.fullmatch(r"[a-z]+://\S+", scheduler):
            raise InputError(f"--scheduler must be an address such as tcp://host:8786, got {shown(scheduler)}")
        try:
            self._client: Any = distributed.Client(scheduler, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:  # its TimeoutError is an OSError; a TypeError lacks TLS
            reason = str(error) or type(error).__name__
            raise ClusterError(f"no Dask scheduler answers at {scheduler}: {reason}") from None
        try:
            self._require_same_versions(scheduler)
        except BaseException:
            self._client.close()
            raise

    def close(self) -> None:
        """Let go of the cluster."""
        self._client.close()

    def run_each(self, tasks: Sequence[Task[T]]) -> Iterator[Answer[T]]:
        """Have tasks of one engine carried out by one of the cluster's workers."""
        return (one for found in self.each([("", tasks)], _ask_each) for one in found)

    def each(
        self, items: Iterable[tuple[str, Item]], work: Callable[[Item, TaskRunner], Iterable[T]]
    ) -> Iterator[list[T]]:
        """Work on items on the cluster; the results of an item come together.

        Raises:
            ClusterError: Items were lost with their workers again and again, after all other results came; or the
                scheduler went away, or the last worker, and none came for `WORKERLESS_S`.
        """
        distributed: Any = importlib.import_module("distributed")
        submitted = {
            self._client.submit(_carry_out, work, item, self._limits, pure=False, retries=RETRIES): name
            for name, item in items
        }
        lost = []
        with self._watched(submitted) as gone:
            for future in distributed.as_completed(list(submitted), loop=self._client.loop):
                name = submitted.pop(future)
                try:
                    results: list[T] = future.result()
                except distributed.scheduler.KilledWorker:
                    lost.append(name)
                except (distributed.CancelledError, distributed.comm.CommClosedError):
                    why = "".join(gone) or "the cluster's scheduler went away"
                    left = len(submitted) + 1
                    raise ClusterError(
                        f"{why}; {left} pieces of work are left, and --resume goes on with them"
                    ) from None
                else:
                    yield results
                future.release()
        if lost:
            raise ClusterError(
                f"{len(lost)} pieces of work were lost with the cluster's workers, the first with {lost[0]}; --resume "
                "tries them again"
            )

    @contextmanager
    def _watched(self, submitted: Mapping[Any, str]) -> Iterator[list[str]]:
        """Give up what was submitted at the end, and when there is no worker for long; then yield why."""
        over, gone = threading.Event(), list[str]()

        def watch() -> None:
            seen = time.monotonic()
            while not over.wait(LOOK_S):
                with suppress(Exception):  # of a scheduler that does not answer it is not known either
                    if self._client.scheduler_info()["workers"]:
                        seen = time.monotonic()
                if time.monotonic() - seen > WORKERLESS_S:
                    gone.append(f"the cluster had no worker for {WORKERLESS_S:g} s")
                    break
            with suppress(Exception):  # a scheduler that is gone
                self._client.cancel(list(submitted))

        thread = threading.Thread(target=watch, daemon=True)
        thread.start()
        try:
            yield gone
        finally:
            over.set()
            thread.join(CONNECT_S)

    def _require_same_versions(self, scheduler: str) -> None:
        if not self._client.scheduler_info()["workers"]:
            raise ClusterError(f"the cluster at {scheduler} has no worker: start some with `dask worker {scheduler}`")
        here = _all_versions()
        for worker, there in self._client.run(_all_versions).items():
            for engine in sorted(here.keys() | there.keys()):
                if here.get(engine) != there.get(engine):
                    raise InputError(
                        f"{engine} on the cluster's worker {worker} is {_shown(there.get(engine))}, "
                        f"and here {_shown(here.get(engine))}: results would not be the same; install the same there"
                    )


def _all_versions() -> dict[str, tuple[tuple[str, str], ...]]:
    return {info.name: versions_of(info.name) for info in engines()}


def _shown(versions: tuple[tuple[str, str], ...] | None) -> str:
    return ", ".join(f"{name} {version or 'missing'}" for name, version in versions) if versions else "not known"


_OF_THREAD = threading.local()


def _carry_out(
    work: Callable[[Item, TaskRunner], Iterable[T]], item: Item, limits: tuple[float, float | None]
) -> list[T]:
    """Work on one item in the cluster's worker; engines stay up from one item to the next."""
    if not hasattr(_OF_THREAD, "lane"):
        _OF_THREAD.lane = Lane(*limits)  # its processes end by themselves when this one is gone
    return list(work(item, _OF_THREAD.lane))


def _ask_each(tasks: Sequence[Task[T]], runner: TaskRunner) -> Iterator[Answer[T]]:
    return runner.run_each(tasks)
