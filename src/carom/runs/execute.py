"""Carrying out cells: each in a worker process of its engine's own, several at a time, none able to harm another."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import ExitStack
from dataclasses import replace
from threading import local
from types import TracebackType
from typing import Self, TypeVar

from carom.errors import AdapterError
from carom.registry import load_adapter, unavailable_reason
from carom.runs.drive import Timing, profile_settings
from carom.runs.messages import Failure, Request
from carom.runs.plan import capabilities_of, unsupported_reason
from carom.runs.process import Crashed, TimedOut, Worker
from carom.runs.results import Cell, Row, Status
from carom.trace import Trace

__all__ = ["MOST_DISCS_DRAWN", "Executor", "drawn", "refusal"]

#: Timed runs of a cell; the median of three throws one disturbed run away.
TIMING_RUNS = 3

#: More discs than this in one picture show nothing, and weigh megabytes.
MOST_DISCS_DRAWN = 64


Kind = TypeVar("Kind")
Answer = Trace | Timing | Failure


class Executor:
    """Runs cells in worker processes, one for each engine and thread; used as a context manager, it ends them all."""

    def __init__(self, jobs: int | None, time_limit_s: float) -> None:
        self._jobs = jobs or os.cpu_count() or 1
        self._time_limit_s = time_limit_s
        self._stack = ExitStack()
        self._of_thread = local()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()

    def observe(self, cell: Cell, *, samples: bool) -> Row:
        """Run one cell and return its row, not scored yet; whatever goes wrong is the row's status and reason."""
        refused = refusal(cell)
        if refused is not None:
            return refused
        answer = self._ask(cell, Request(cell.engine, cell.scene, cell.profile, cell.dt_s, samples=samples))
        return answer if isinstance(answer, Row) else Row(cell, Status.RAN, trace=_as(Trace, answer))

    def observe_all(self, cells: Sequence[Cell], *, samples: bool = True) -> Iterator[Row]:
        """Run many cells, yielding each row as it finishes.

        States are kept for drawing where somebody may draw them: at the coarsest step, of scenes that fit a picture.
        """
        with ThreadPoolExecutor(max_workers=self._jobs) as pool:
            futures = [pool.submit(self.observe, cell, samples=samples and drawn(cell)) for cell in cells]
            try:
                for future in as_completed(futures):
                    yield future.result()
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                self._stack.close()  # ends the engines, and with them the threads that wait for their answers
                raise

    def time(self, row: Row) -> Row:
        """Time the cell of a row that was run; the caller sees to it that nothing else is running."""
        if row.status is not Status.RAN:
            return row
        cell = row.cell
        request = Request(cell.engine, cell.scene, cell.profile, cell.dt_s, timing_runs=TIMING_RUNS)
        answer = self._ask(cell, request)
        if isinstance(answer, Row):
            return replace(row, untimed=f"{answer.status.value}: {answer.reason}")
        return replace(row, timing=_as(Timing, answer))

    def _ask(self, cell: Cell, request: Request) -> object:
        try:
            answer = self._worker(cell.engine).ask(request, self._time_limit_s)
        except Crashed as error:
            return Row(cell, Status.CRASHED, str(error))
        except TimedOut as error:
            return Row(cell, Status.TIMED_OUT, str(error))
        return Row(cell, Status.FAILED, answer.message) if isinstance(answer, Failure) else answer

    def _worker(self, engine: str) -> Worker[Answer]:
        if not hasattr(self._of_thread, "workers"):
            self._of_thread.workers = {}
        workers: dict[str, Worker[Answer]] = self._of_thread.workers
        if engine not in workers:
            workers[engine] = self._stack.enter_context(Worker())
        return workers[engine]


def drawn(cell: Cell) -> bool:
    """Whether a report may draw a cell."""
    return cell.refinement == 0 and len(cell.scene.discs) <= MOST_DISCS_DRAWN


def _as(kind: type[Kind], answer: object) -> Kind:
    if not isinstance(answer, kind):
        raise AdapterError(f"a worker answered with {type(answer).__name__} where {kind.__name__} was asked for")
    return answer


def refusal(cell: Cell) -> Row | None:
    """Return the row of a cell that can't be run, decided without starting the engine."""
    try:
        adapter = load_adapter(cell.engine)
    except AdapterError as error:
        return Row(cell, Status.UNAVAILABLE, str(error))
    missing = unavailable_reason(adapter.engine)
    if missing:
        return Row(cell, Status.UNAVAILABLE, missing)
    try:
        profile_settings(adapter, cell.profile, cell.dt_s)
    except AdapterError as error:
        return Row(cell, Status.FAILED, str(error))
    unsupported = unsupported_reason(cell.scene, capabilities_of(adapter, cell.profile), cell.dt_s)
    return Row(cell, Status.UNSUPPORTED, unsupported) if unsupported else None
