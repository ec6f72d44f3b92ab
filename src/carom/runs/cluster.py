"""Carrying out a sweep on a Dask cluster: the same cells, in the same worker processes, with the same results.

A task of the cluster is one message of cells. It starts the engines in processes of their own, exactly as this machine
would, so that an engine's abort ends neither the cluster's worker nor anybody else's cells. A cluster's worker that is
lost takes its messages with it; the scheduler gives them to another.
"""

from __future__ import annotations

import importlib
import threading
from collections.abc import Iterator, Sequence
from types import TracebackType
from typing import Any, Self

from carom.errors import CaromError, InputError, MissingExtraError
from carom.registry import engines
from carom.runs.cell_score import CellResult, versions_of
from carom.runs.results import Cell
from carom.runs.sweep import WorkersByEngine, carry_out

__all__ = ["ClusterError", "ClusterPool"]

#: How long to wait for the scheduler to answer at all, seconds.
CONNECT_S = 10

#: A message that was lost with its worker is tried again so many times, by the scheduler and then by hand.
RETRIES = 3


class ClusterError(CaromError, RuntimeError):
    """The cluster could not be reached, or lost cells for good."""


class ClusterPool:
    """A Dask cluster; used as a context manager, it lets go of the cluster, which goes on without us.

    Args:
        scheduler: Address of the scheduler, such as ``tcp://10.0.0.1:8786``.
        time_limit_s: A cell that gives no answer for so long is ended, and its result says so.

    Raises:
        MissingExtraError: distributed, the extra `cluster`, is not installed.
        ClusterError: No scheduler answers there, or it has no worker.
        InputError: The versions of a worker are not those here: its results would not be the same ones.
    """

    def __init__(self, scheduler: str, time_limit_s: float = 60.0) -> None:
        try:
            distributed: Any = importlib.import_module("distributed")  # untyped
        except ImportError:
            raise MissingExtraError(
                "--scheduler needs distributed, which is not installed: pip install 'carom[cluster]'"
            ) from None
        self._time_limit_s = time_limit_s
        try:
            self._client: Any = distributed.Client(scheduler, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError) as error:  # its TimeoutError is an OSError
            reason = str(error) or type(error).__name__
            raise ClusterError(f"no Dask scheduler answers at {scheduler}: {reason}") from None
        try:
            self._require_same_versions(scheduler)
        except BaseException:
            self._client.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._client.close()

    def score_all(self, batches: Sequence[Sequence[Cell]]) -> Iterator[list[CellResult]]:
        """Carry out all batches and yield the results of each as it comes.

        Raises:
            ClusterError: Cells were lost with their workers again and again; all other results came before.
        """
        distributed: Any = importlib.import_module("distributed")
        lost: list[Cell] = []
        todo = [list(batch) for batch in batches]
        for attempt in (1, 2):
            submitted = {
                self._client.submit(_score, batch, self._time_limit_s, pure=False, retries=RETRIES): batch
                for batch in todo
            }
            try:
                for future in distributed.as_completed(list(submitted), loop=self._client.loop):
                    batch = submitted.pop(future)
                    try:
                        results: list[CellResult] = future.result()
                    except distributed.scheduler.KilledWorker:
                        lost += batch
                    else:
                        yield results
                    future.release()
            finally:
                self._client.cancel(list(submitted))
            if not lost or attempt == 2:
                break
            todo, lost = [[cell] for cell in lost], []  # one by one, so that one cell takes no other with it
        if lost:
            first = lost[0]
            where = f"{first.scene.name} on {first.engine} ({first.profile}, dt = {first.dt_s:g} s)"
            raise ClusterError(
                f"{len(lost)} cells were lost with the cluster's workers, the first {where}; --resume tries them again"
            )

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


def _score(batch: Sequence[Cell], time_limit_s: float) -> list[CellResult]:
    """Carry out one message in the cluster's worker; engines stay up from one message to the next."""
    if not hasattr(_OF_THREAD, "workers"):
        _OF_THREAD.workers = WorkersByEngine()  # its processes end by themselves when this one is gone
    return list(carry_out(batch, _OF_THREAD.workers, time_limit_s))
