"""Carrying out a sweep on this machine, in worker processes that no engine's abort can bring down."""

from __future__ import annotations

import os
import queue
import threading
from collections.abc import Iterator, Sequence
from types import TracebackType
from typing import Self

from carom.runs.cell_score import CellResult
from carom.runs.results import Cell
from carom.runs.sweep import WorkersByEngine, carry_out

__all__ = ["LocalPool"]


class LocalPool:
    """So many worker processes of an engine at a time; used as a context manager, it ends them all.

    Args:
        jobs: How many cells are carried out at a time; as many as there are cores by default.
        time_limit_s: A cell that gives no answer for so long is ended, and its result says so.
    """

    def __init__(self, jobs: int | None = None, time_limit_s: float = 60.0) -> None:
        self._jobs = jobs or os.cpu_count() or 1
        self._time_limit_s = time_limit_s
        self._threads: list[threading.Thread] = []
        self._workers = [WorkersByEngine() for _ in range(self._jobs)]
        self._ended = threading.Event()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        for workers in self._workers:  # ends the engines, and with them the threads that wait for their answers
            workers.close()
        for thread in self._threads:
            thread.join()

    def score_all(self, batches: Sequence[Sequence[Cell]]) -> Iterator[list[CellResult]]:
        """Carry out all batches and yield each result as it comes."""
        todo: queue.SimpleQueue[Sequence[Cell]] = queue.SimpleQueue()
        for batch in batches:
            todo.put(batch)
        answers: queue.SimpleQueue[CellResult | BaseException | None] = queue.SimpleQueue()

        def serve(workers: WorkersByEngine) -> None:
            try:
                while not self._ended.is_set():
                    for result in carry_out(todo.get_nowait(), workers, self._time_limit_s):
                        if self._ended.is_set():  # what an ended process leaves is no result
                            return
                        answers.put(result)
            except queue.Empty:
                answers.put(None)
            except BaseException as error:  # noqa: BLE001 - it is raised again where it can be seen
                answers.put(error)

        threads = [threading.Thread(target=serve, args=(workers,), daemon=True) for workers in self._workers]
        self._threads += threads
        for thread in threads:
            thread.start()
        running = len(threads)
        while running:
            answer = answers.get()
            results: list[CellResult] = []
            while True:  # all that is there by now goes to the disc in one write
                if isinstance(answer, BaseException):
                    raise answer
                if answer is None:
                    running -= 1
                else:
                    results.append(answer)
                try:
                    answer = answers.get_nowait()
                except queue.Empty:
                    break
            yield results
