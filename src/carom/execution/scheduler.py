"""Scheduler: runs a study's tasks on a pool, and stores each result in a journal.

Tasks whose results are in the journal are not run again, and refused tasks are not run at all. The pool runs all other
tasks, with the requested time and memory limits.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

from carom.execution.job import Answer, T, Task
from carom.execution.journal import JournalEntry, K, MemoryJournal
from carom.execution.pool import Pool, TaskRunner

#: Largest total number of steps of a batch, which is a group of tasks: about a second of work. So the cost of sending a
#: batch is negligible, and little work is lost if a batch is lost. `BATCH_TASKS` limits the number of tasks in a batch,
#: so that all workers finish at nearly the same time.
BATCH_STEPS = 50_000
BATCH_TASKS = 16

S = TypeVar("S")


class DependentTasks(ABC, Generic[T]):
    """Several tasks with one common result, such as a search. Later tasks depend on the answers to earlier tasks.

    Instances must be picklable, since a cluster pool pickles them.
    """

    @property
    @abstractmethod
    def engine(self) -> str:
        """Name of the adapter of the first task."""

    @abstractmethod
    def run(self, runner: TaskRunner) -> Answer[Any]:
        """Run the tasks and return their common result."""

    def complete(self, answer: Answer[Any]) -> Answer[T]:
        """Convert the result of `run` to the answer for the journal. This method runs in the study's process."""
        return answer


#: The types of tasks that a request can contain.
AnyTask = Task[T] | DependentTasks[T]

#: Tasks that are sent together. Each task has the key of its journal entry.
Batch = list[tuple[K, AnyTask[T]]]


@dataclass(frozen=True)
class TaskRequest(Generic[S, K, T]):
    """A task that a study requests.

    Attributes:
        subject: Any object by which the study recognises the task. `run_tasks` yields this object with the answer.
        key: Key of the task's journal entry. Tasks with the same key are the same task.
        task: Task to carry out.
        refused: Why the task can't be carried out; None if no reason is known. A refused task is not sent, and not
            stored in the journal.
        steps: Number of engine steps. Tasks with few steps share a batch. A task with many steps is a batch of its own.
    """

    subject: S
    key: K
    task: AnyTask[T]
    refused: Answer[Any] | None = None
    steps: float = math.inf


def run_tasks(
    requests: Iterable[TaskRequest[S, K, T]],
    pool: Pool,
    journal: MemoryJournal[K, T] | None = None,
    *,
    one_at_a_time: bool = False,
) -> Iterator[tuple[S, Answer[T]]]:
    """Yield subject and answer of each request: first known and refused tasks, then other tasks as they finish.

    Args:
        requests: The tasks. Tasks with the same key are carried out once.
        pool: Pool that carries out the tasks; the caller closes it.
        journal: Journal with the known answers. New answers are stored in the journal before they are yielded. By
            default, no answer is known, and no answer is stored.
        one_at_a_time: Whether tasks are carried out one at a time, while nothing else runs.
    """
    journal = MemoryJournal() if journal is None else journal
    pending: dict[K, list[TaskRequest[S, K, T]]] = {}
    for request in requests:
        if (known := journal.entries.get(request.key)) is not None:
            yield request.subject, known.answer
        elif request.refused is not None:
            yield request.subject, request.refused
        else:
            pending.setdefault(request.key, []).append(request)
    batches = build_batches((key, same_key[0].task, same_key[0].steps) for key, same_key in pending.items())
    results: Iterator[list[JournalEntry[K, Any]]]
    if one_at_a_time:
        results = ([entry] for _, batch in batches for entry in _run_batch(batch, pool))
    else:
        results = pool.map_unordered(batches, _run_batch)
    for several in results:
        entries = [_complete(entry, pending[entry.key][0].task) for entry in several]
        journal.add(entries)
        for entry in entries:
            for request in pending[entry.key]:
                yield request.subject, entry.answer


def _complete(entry: JournalEntry[K, Any], task: AnyTask[T]) -> JournalEntry[K, T]:
    return replace(entry, answer=task.complete(entry.answer)) if isinstance(task, DependentTasks) else entry


def build_batches(tasks: Iterable[tuple[K, AnyTask[T], float]]) -> list[tuple[str, Batch[K, T]]]:
    """Group tasks into batches, each of one engine. Tasks of an engine stay in order.

    Each task is given with its key and number of steps.
    """
    batches: list[tuple[str, Batch[K, T]]] = []
    batch_steps = 0.0
    for key, task, steps in sorted(tasks, key=lambda item: item[1].engine):
        full = not batches or batch_steps + steps > BATCH_STEPS or len(batches[-1][1]) >= BATCH_TASKS
        if full or batches[-1][0] != task.engine:
            batches.append((task.engine, []))
            batch_steps = 0.0
        batches[-1][1].append((key, task))
        batch_steps += steps
    return batches


def _run_batch(batch: Batch[K, T], runner: TaskRunner) -> Iterator[JournalEntry[K, Any]]:
    """Carry out the tasks of a batch."""
    tasks = [task for _, task in batch if not isinstance(task, DependentTasks)]
    # `build_batches` gives each `DependentTasks` a batch of its own.
    dependent = [task for _, task in batch if isinstance(task, DependentTasks)]
    answers = [task.run(runner) for task in dependent] if dependent else runner.run_each(tasks)
    for (key, _), answer in zip(batch, answers, strict=True):
        yield JournalEntry(key, answer)
