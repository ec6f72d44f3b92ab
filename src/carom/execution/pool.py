"""Pools: carry out tasks in worker processes of this machine.

A pool returns an `Answer` to every task, even if an engine crashes or hangs. The module `carom.execution.cluster`
contains the pool for a Dask cluster.
"""

from __future__ import annotations

import queue
import threading
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext, suppress
from typing import Generic, Self, TypeVar

from carom.engines.registry import list_adapter_points
from carom.errors import AdapterError
from carom.execution.job import Answer, T, Task
from carom.execution.workers.fork_server import ForkServer
from carom.execution.workers.worker_process import ClosedError, Worker
from carom.support.limits import DEFAULT_TIME_LIMIT_S
from carom.support.system import count_available_cores, measure_available_memory


def compute_memory_share(lanes: int) -> float:
    """Return the number of megabytes that each of `lanes` worker processes may use.

    The memory of the machine is divided into `lanes + 1` equal shares. One share is left to other processes.
    """
    return measure_available_memory() / (lanes + 1) / 1e6


Item = TypeVar("Item")


class Closeable:
    """Base class of classes with a method `close`, which is called at the end of a ``with`` block."""

    def close(self) -> None:
        """Release all resources."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()


class TaskRunner(Closeable, ABC):
    """Carries out one task at a time."""

    def run(self, task: Task[T]) -> Answer[T]:
        """Carry out one task."""
        (answer,) = self.run_each([task])
        return answer

    @abstractmethod
    def run_each(self, tasks: Sequence[Task[T]]) -> Iterator[Answer[T]]:
        """Carry out tasks of one engine one after another, and yield their answers in order."""


class Pool(TaskRunner):
    """Carries out several tasks at a time. At the end of a ``with`` block, the pool ends its worker processes."""

    def renew(self) -> None:
        """End the worker processes, if there are any, so that later tasks run in new processes."""

    def to_local_pool(self) -> AbstractContextManager[Pool]:
        """Return a pool on this machine, for measurements of run times."""
        return nullcontext(self)

    @abstractmethod
    def map_unordered(
        self, items: Iterable[tuple[str, Item]], work: Callable[[Item, TaskRunner], Iterable[T]]
    ) -> Iterator[list[T]]:
        """Apply a function to each item, several at a time, and yield the results as they finish, in any order.

        Args:
            items: Pairs of an engine's name and an item that needs this engine.
            work: Function that yields the results of an item. The function's second argument runs its tasks.
        """


class Lane(TaskRunner):
    """Worker processes that one thread uses, one process for each engine. So each engine is loaded only once.

    Args:
        time_limit_s: Time limit of a task, in seconds. A task that takes longer is ended and reported as timed out.
        memory_limit_mb: Memory limit of a process, in megabytes; by default the result of `compute_memory_share` for
            one lane.
        fork_server: The fork server that forks the processes. Without a server, new interpreters are started.
    """

    def __init__(
        self,
        time_limit_s: float = DEFAULT_TIME_LIMIT_S,
        memory_limit_mb: float | None = None,
        fork_server: ForkServer | None = None,
    ) -> None:
        self._fork_server = fork_server
        self._time_limit_s = time_limit_s
        self._memory_bytes = round(1e6 * (compute_memory_share(1) if memory_limit_mb is None else memory_limit_mb))
        self._workers: dict[str, Worker] = {}
        self._closed = False
        self._lock = threading.Lock()

    @property
    def engines(self) -> Collection[str]:
        """Names of the engines with a worker."""
        return self._workers.keys()

    def worker_of(self, engine: str) -> Worker:
        """Return the worker of an engine. The process starts with the first task."""
        with self._lock:
            if self._closed:
                raise ClosedError
            if engine not in self._workers:
                self._workers[engine] = Worker(self._memory_bytes, self._fork_server)
            return self._workers[engine]

    def run_each(self, tasks: Sequence[Task[T]]) -> Iterator[Answer[T]]:
        """Carry out tasks of one engine in the engine's worker. The tasks are sent as one message."""
        if not tasks:
            return iter(())
        limit_s = max(self._time_limit_s, getattr(tasks[0], "min_time_limit_s", 0.0))
        return self.worker_of(tasks[0].engine).run_each(tasks, limit_s)

    def renew(self) -> None:
        """End the processes; the next task starts a new process."""
        self.close()
        self._workers, self._closed = {}, False

    def stop(self) -> None:
        """Abort the task that is running, and refuse further tasks."""
        with self._lock:
            self._closed = True
            for worker in self._workers.values():
                worker.stop()

    def close(self) -> None:
        """End the processes. A caller that waits for an answer gets a `ClosedError`."""
        self.stop()
        for worker in self._workers.values():
            worker.close()


class LocalPool(Pool):
    """Pool of this machine. Each lane of the pool has its own worker processes, and carries out one task at a time.

    Args:
        jobs: Number of tasks carried out at a time; by default the number of cores.
        time_limit_s: Time limit of a task, as in `Lane`.
        memory_limit_mb: Memory limit of a process, as in `Lane`; by default `compute_memory_share` for all lanes.
    """

    def __init__(
        self, jobs: int | None = None, time_limit_s: float = DEFAULT_TIME_LIMIT_S, memory_limit_mb: float | None = None
    ) -> None:
        lanes = jobs or count_available_cores()
        share_mb = compute_memory_share(lanes) if memory_limit_mb is None else memory_limit_mb
        with suppress(AdapterError):  # the error is reported when an adapter is loaded
            # the list is cached before the forks, so that workers need not search the installed packages again
            list_adapter_points()
        self._fork_server = ForkServer.launch()
        self._lanes = [Lane(time_limit_s, share_mb, self._fork_server) for _ in range(lanes)]
        self._threads: list[threading.Thread] = []

    def close(self) -> None:
        """End the worker processes and the threads that wait for their answers."""
        for lane in self._lanes:
            lane.stop()  # closing takes time, so all lanes are stopped first
        for lane in self._lanes:
            lane.close()
        for thread in self._threads:
            if thread.is_alive():  # a signal can interrupt `map_unordered` before this thread starts
                thread.join()
        if self._fork_server is not None:
            self._fork_server.close()

    def worker_of(self, engine: str) -> Worker:
        """Return the worker that `run` uses for an engine. A worker that already exists is reused."""
        return self._lane_of(engine).worker_of(engine)

    def renew(self) -> None:
        """End the processes; the next tasks start new processes."""
        for lane in self._lanes:
            lane.renew()

    def run_each(self, tasks: Sequence[Task[T]]) -> Iterator[Answer[T]]:
        """Carry out tasks in a lane that has already started their engine, or else in the first lane."""
        return self._lane_of(tasks[0].engine if tasks else "").run_each(tasks)

    def _lane_of(self, engine: str) -> Lane:
        return next((lane for lane in self._lanes if engine in lane.engines), self._lanes[0])

    def map_unordered(
        self, items: Iterable[tuple[str, Item]], work: Callable[[Item, TaskRunner], Iterable[T]]
    ) -> Iterator[list[T]]:
        """Process items in all lanes.

        All results that are ready are yielded in one list, so that a journal can write them together.
        """
        pending = _PendingItems(items)
        messages: queue.SimpleQueue[tuple[T] | BaseException | None] = queue.SimpleQueue()

        def serve(lane: Lane) -> None:
            try:
                while (item := pending.take(lane)) is not None:
                    for result in work(item[0], lane):
                        messages.put((result,))
                messages.put(None)
            except BaseException as error:  # noqa: BLE001 - raised again in the caller's thread
                messages.put(error)

        # Lanes that have already started a required engine come first. There are at most as many threads as items.
        lanes = sorted(self._lanes, key=lambda lane: pending.engines.isdisjoint(lane.engines))[: pending.count]
        threads = [threading.Thread(target=serve, args=(lane,), daemon=True) for lane in lanes]
        self._threads += threads
        for thread in threads:
            thread.start()
        running = len(threads)
        while running:
            results: list[T] = []
            for message in [messages.get(), *(messages.get() for _ in range(messages.qsize()))]:
                if isinstance(message, BaseException):
                    raise message
                if message is None:
                    running -= 1
                else:
                    results += message
            if results:
                yield results


class _PendingItems(Generic[Item]):
    """Items that no lane has taken yet.

    A lane takes items of one engine until none is left, and then takes items of another engine. The lane prefers an
    engine whose items no other lane takes. The lane's second choice is an engine that the lane has already started, and
    the third choice is the engine with the most remaining items.

    Attributes:
        engines: Names of the engines that any of the items needs.
        count: Number of all items.
    """

    def __init__(self, items: Iterable[tuple[str, Item]]) -> None:
        self._items: dict[str, deque[Item]] = {}
        for engine, item in items:
            self._items.setdefault(engine, deque()).append(item)
        self.engines, self.count = self._items.keys(), sum(map(len, self._items.values()))
        self._engines: dict[Lane, str] = {}
        self._lock = threading.Lock()

    def take(self, lane: Lane) -> tuple[Item] | None:
        """Return the next item for a lane; None if no item is left."""
        with self._lock:
            engine = self._engines.get(lane)
            if engine is None or not self._items[engine]:
                served = set(self._engines.values())
                left = [name for name, items in self._items.items() if items]
                if not left:
                    return None
                engine = max(left, key=lambda name: (name not in served, name in lane.engines, len(self._items[name])))
                self._engines[lane] = engine
            return (self._items[engine].popleft(),)
