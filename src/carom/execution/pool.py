"""Where tasks are carried out: in worker processes of this machine, or in this very process.

A caller that runs engines asks a pool, and gets an `Answer` whatever an engine does. A third pool is a cluster
(`carom.execution.cluster`).
"""

from __future__ import annotations

import queue
import threading
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from typing import Generic, Self, TypeVar

from carom.execution.fork_server import ForkServer
from carom.execution.job import Answer, Task
from carom.execution.process import ClosedError, Worker
from carom.execution.worker import answer
from carom.support.limits import DEFAULT_TIME_LIMIT_S, require_megabytes
from carom.support.system import available_cores, available_memory


def memory_share(lanes: int) -> float:
    """Return how many megabytes each of this many processes at work may take, where one share is left for all else."""
    return available_memory() / (lanes + 1) / 1e6


T = TypeVar("T")
Item = TypeVar("Item")


class Closeable:
    """Something to be closed, as a context manager."""

    def close(self) -> None:
        """End whatever was started."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()


class TaskRunner(Closeable, ABC):
    """Answers one question at a time."""

    def run(self, task: Task[T]) -> Answer[T]:
        """Have a task carried out, alone."""
        (found,) = self.run_each([task])
        return found

    @abstractmethod
    def run_each(self, tasks: Sequence[Task[T]]) -> Iterator[Answer[T]]:
        """Have tasks of one engine carried out, one after another and alone, and yield the answer to each in turn."""


class Pool(TaskRunner):
    """Answers several questions at a time; used as a context manager, it ends whatever it has started."""

    def renew(self) -> None:
        """Have what is asked next carried out in processes in which nothing has been, where there are processes."""

    @abstractmethod
    def each(
        self, items: Iterable[tuple[str, Item]], work: Callable[[Item, TaskRunner], Iterable[T]]
    ) -> Iterator[list[T]]:
        """Do some work on each item, several at a time, and yield what comes of it as it comes, in no order.

        Args:
            items: Names of the engines that are asked for, and what is to be worked on.
            work: Yields what comes of an item; it asks whatever it is given with the item.
        """


class InProcessPool(Pool):
    """Carries everything out in this process, one after another: nothing to start, and nothing to be safe from."""

    def run_each(self, tasks: Sequence[Task[T]]) -> Iterator[Answer[T]]:
        """Carry tasks out."""
        return map(answer, tasks)

    def each(
        self, items: Iterable[tuple[str, Item]], work: Callable[[Item, TaskRunner], Iterable[T]]
    ) -> Iterator[list[T]]:
        """Work on one item after another."""
        return ([result] for _, item in items for result in work(item, self))


class Lane(TaskRunner):
    """Worker processes of one thread, one an engine, so that each has its engine warm and no other's.

    Args:
        time_limit_s: A task that gives no answer for so long is ended, and its answer says so.
        memory_limit_mb: Megabytes that a process may take; by default `memory_share` of this one lane.
        template: What forks the processes, where there is one.
    """

    def __init__(
        self,
        time_limit_s: float = DEFAULT_TIME_LIMIT_S,
        memory_limit_mb: float | None = None,
        template: ForkServer | None = None,
    ) -> None:
        self._template = template
        self._time_limit_s = time_limit_s
        if memory_limit_mb is not None:
            require_megabytes("the memory limit", memory_limit_mb)
        self._memory_bytes = round(1e6 * (memory_share(1) if memory_limit_mb is None else memory_limit_mb))
        self._workers: dict[str, Worker] = {}
        self._closed = False
        self._lock = threading.Lock()

    @property
    def engines(self) -> Collection[str]:
        """Names of the engines that it has a worker for."""
        return self._workers.keys()

    def of(self, engine: str) -> Worker:
        """Return the worker of an engine; its process is started when it is first asked."""
        with self._lock:
            if self._closed:
                raise ClosedError
            if engine not in self._workers:
                self._workers[engine] = Worker(self._memory_bytes, self._template)
            return self._workers[engine]

    def run_each(self, tasks: Sequence[Task[T]]) -> Iterator[Answer[T]]:
        """Have tasks of one engine carried out in its worker, by one message."""
        if not tasks:
            return iter(())
        limit_s = max(self._time_limit_s, getattr(tasks[0], "min_time_limit_s", 0.0))
        return self.of(tasks[0].engine).run_each(tasks, limit_s)

    def renew(self) -> None:
        """End the processes; the next task starts anew."""
        with self._lock:
            ended, self._workers = self._workers, {}
        for worker in ended.values():
            worker.close()

    def stop(self) -> None:
        """Let the caller that waits for an answer wait no longer, and nobody ask again."""
        with self._lock:
            self._closed = True
            for worker in self._workers.values():
                worker.stop()

    def close(self) -> None:
        """End the processes; who waits for an answer is told so."""
        self.stop()
        for worker in self._workers.values():
            worker.close()


class LocalPool(Pool):
    """Lanes of this machine, each with its own worker processes.

    Args:
        jobs: How many tasks are carried out at a time; as many as there are cores by default.
        time_limit_s: As of a `Lane`.
        memory_limit_mb: As of a `Lane`; by default each has the same share.
    """

    def __init__(
        self,
        jobs: int | None = None,
        time_limit_s: float = DEFAULT_TIME_LIMIT_S,
        memory_limit_mb: float | None = None,
    ) -> None:
        lanes = jobs or available_cores()
        share_mb = memory_share(lanes) if memory_limit_mb is None else memory_limit_mb
        self._template = ForkServer.forked()
        self._lanes = [Lane(time_limit_s, share_mb, self._template) for _ in range(lanes)]
        self._threads: list[threading.Thread] = []

    def close(self) -> None:
        """End the engines, and with them the threads that wait for their answers."""
        for lane in self._lanes:
            lane.stop()  # all at once, since each takes its time to end
        for lane in self._lanes:
            lane.close()
        for thread in self._threads:
            if thread.is_alive():  # a signal may have come before it was started
                thread.join()
        if self._template is not None:
            self._template.close()

    def worker(self, engine: str) -> Worker:
        """Return the worker of an engine in which what is asked alone is carried out: one that is there already."""
        return self._lane_of(engine).of(engine)

    def renew(self) -> None:
        """End the processes; the next tasks start anew."""
        for lane in self._lanes:
            lane.renew()

    def run_each(self, tasks: Sequence[Task[T]]) -> Iterator[Answer[T]]:
        """Have tasks carried out in a lane that has their engine already, or else in the first."""
        return self._lane_of(tasks[0].engine if tasks else "").run_each(tasks)

    def _lane_of(self, engine: str) -> Lane:
        return next((lane for lane in self._lanes if engine in lane.engines), self._lanes[0])

    def each(
        self, items: Iterable[tuple[str, Item]], work: Callable[[Item, TaskRunner], Iterable[T]]
    ) -> Iterator[list[T]]:
        """Work on items in all lanes; what has come by now comes together, so that it can be written together."""
        todo = _Todo(items)
        found: queue.SimpleQueue[tuple[T] | BaseException | None] = queue.SimpleQueue()

        def serve(lane: Lane) -> None:
            try:
                while (item := todo.take(lane)) is not None:
                    for result in work(item[0], lane):
                        found.put((result,))
                found.put(None)
            except BaseException as error:  # noqa: BLE001 - it is raised again where it can be seen
                found.put(error)

        threads = [threading.Thread(target=serve, args=(lane,), daemon=True) for lane in self._lanes]
        self._threads += threads
        for thread in threads:
            thread.start()
        running = len(threads)
        while running:
            results: list[T] = []
            for one in [found.get(), *(found.get() for _ in range(found.qsize()))]:
                if isinstance(one, BaseException):
                    raise one
                if one is None:
                    running -= 1
                else:
                    results += one
            if results:
                yield results


class _Todo(Generic[Item]):
    """What is still to be worked on: a lane stays with its engine, whose process then need not be started again."""

    def __init__(self, items: Iterable[tuple[str, Item]]) -> None:
        self._of: dict[str, deque[Item]] = {}
        for engine, item in items:
            self._of.setdefault(engine, deque()).append(item)
        self._engines: dict[Lane, str] = {}
        self._lock = threading.Lock()

    def take(self, lane: Lane) -> tuple[Item] | None:
        """Return the next item for a lane, None where there is none left."""
        with self._lock:
            engine = self._engines.get(lane)
            if engine is None or not self._of[engine]:
                served = set(self._engines.values())
                left = [name for name, items in self._of.items() if items]
                if not left:
                    return None
                engine = max(left, key=lambda name: (name not in served, name in lane.engines, len(self._of[name])))
                self._engines[lane] = engine
            return (self._of[engine].popleft(),)
