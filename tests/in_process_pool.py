"""A pool that carries out tasks in the process of the test."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TypeVar

from carom.execution.job import Answer, Task
from carom.execution.pool import Pool, TaskRunner
from carom.execution.workers.worker_main import carry_out

T = TypeVar("T")
Item = TypeVar("Item")


class InProcessPool(Pool):
    """Carries out all tasks in this process, one after another. If an engine crashes, this process also ends."""

    def run_each(self, tasks: Sequence[Task[T]]) -> Iterator[Answer[T]]:
        """Carry out tasks one after another."""
        return map(carry_out, tasks)

    def map_unordered(
        self, items: Iterable[tuple[str, Item]], work: Callable[[Item, TaskRunner], Iterable[T]]
    ) -> Iterator[list[T]]:
        """Process the items one after another."""
        return ([result] for _, item in items for result in work(item, self))
