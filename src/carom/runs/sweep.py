"""Sweeps: many cells, carried out here or on a cluster, each finished one in a journal, resumable at any time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any, Protocol

from carom.runs.cell_score import CellKey, CellResult, ScoreTask, cell_key, failed, refused, result_of
from carom.runs.journal import Journal
from carom.runs.process import Crashed, TimedOut, Worker
from carom.runs.results import Cell, Status

__all__ = ["Pool", "WorkersByEngine", "batches", "carry_out", "sweep"]

#: A message holds as many cells as take so many steps together, a second or so: then what a message costs is nothing,
#: and what is lost with one is little. So many cells at most, that workers have equal shares to the end.
BATCH_STEPS = 50_000
BATCH_CELLS = 64

Progress = Callable[[int, int, str], None]


class Pool(AbstractContextManager["Pool"], Protocol):
    """Where cells are carried out: here (`carom.runs.local`) or on a cluster (`carom.runs.cluster`)."""

    def score_all(self, batches: Sequence[Sequence[Cell]]) -> Iterator[list[CellResult]]:
        """Carry out all batches, several at a time, and yield results as they come, in no order."""


def sweep(
    cells: Sequence[Cell], pool: Pool, journal: Journal | None = None, progress: Progress | None = None
) -> Mapping[CellKey, CellResult]:
    """Carry out the cells that the journal does not hold, write each to it, and return the results of all.

    Args:
        cells: What is to be run; a cell that is there twice is run once.
        pool: Where; it stays open.
        journal: What is finished already, and where results go; None to keep them in memory alone.
        progress: Called with (done, all, what) as cells finish, first with what was finished before.
    """
    wanted = {cell_key(cell): cell for cell in cells}
    found = {key: result for key, result in journal.results.items() if key in wanted} if journal else {}
    missing = [cell for key, cell in wanted.items() if key not in found]
    if progress is not None:
        progress(len(found), len(wanted), "")
    for results in pool.score_all(batches(missing)):
        if journal is not None:
            journal.add(results)
        found.update((result.key, result) for result in results)
        if progress is not None and results:
            progress(len(found), len(wanted), f"{results[-1].scene} on {results[-1].key.engine}")
    return found


def batches(cells: Sequence[Cell]) -> list[list[Cell]]:
    """Return the cells in messages, each of one engine, so that a crash of one engine is no other's."""
    # A worker keeps the references of the last few starts, so those of one start stand together.
    ordered = sorted(cells, key=lambda cell: (cell.engine, cell.scene.name, cell.phase * cell.dt_s, cell.dt_s))
    found: list[list[Cell]] = []
    steps, engine = 0.0, ""
    for cell in ordered:
        cost = cell.scene.duration_s / cell.dt_s
        if not found or cell.engine != engine or steps + cost > BATCH_STEPS or len(found[-1]) >= BATCH_CELLS:
            found.append([])
            steps, engine = 0.0, cell.engine
        found[-1].append(cell)
        steps += cost
    return found


class WorkersByEngine:
    """Worker processes of one thread, one an engine, started when first asked for."""

    def __init__(self) -> None:
        self._workers: dict[str, Worker[Any]] = {}

    def of(self, engine: str) -> Worker[Any]:
        """Return the worker of an engine."""
        return self._workers.setdefault(engine, Worker()) if engine not in self._workers else self._workers[engine]

    def close(self) -> None:
        """End them all."""
        for worker in self._workers.values():
            worker.close()
        self._workers.clear()


def carry_out(batch: Sequence[Cell], workers: WorkersByEngine, time_limit_s: float) -> Iterator[CellResult]:
    """Run the cells of one message and yield each result; an engine that ends its process costs its cell alone."""
    todo: list[Cell] = []
    for cell in batch:
        result = refused(cell)
        if result is None:
            todo.append(cell)
        else:
            yield result
    while todo:
        done = 0
        try:
            for answer in workers.of(todo[0].engine).ask_each([ScoreTask(cell) for cell in todo], time_limit_s):
                done += 1
                yield result_of(todo[done - 1], answer)
        except (Crashed, TimedOut) as error:
            status = Status.CRASHED if isinstance(error, Crashed) else Status.TIMED_OUT
            yield failed(todo[done], status, str(error))
            done += 1
        todo = todo[done:]
