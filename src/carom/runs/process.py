"""The parent's side of a worker process: starts it, asks it, and survives whatever an engine does to it."""

from __future__ import annotations

import os
import pickle
import queue
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import cache
from typing import Any, TypeVar, get_type_hints

from carom.errors import AdapterError
from carom.runs.job import Answer, Status, Task

__all__ = ["ClosedError", "Worker"]

T = TypeVar("T")


class ClosedError(Exception):
    """Whoever asked was ended meanwhile, by Ctrl-C say, so that nobody waits for the answer."""


class Worker:
    """One worker process, started at the first task and again after one that ended it."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._closed = False
        self._answers: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._folder = tempfile.TemporaryDirectory(prefix="carom-", ignore_cleanup_errors=True)
        self._printed = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the worker

    def ask_each(self, tasks: Sequence[Task[T]], time_limit_s: float) -> Iterator[Answer[T]]:
        """Send several tasks in one message and yield the answer to each, in their order, as soon as it is there.

        A task that ends the process, or gives no answer within `time_limit_s` of the one before, costs nobody else:
        its answer says so, and those behind it are sent again.

        Raises:
            ClosedError: The worker was closed meanwhile.
            AdapterError: The process answers something else than was asked for.
        """
        todo = list(tasks)
        try:
            while todo:
                sent = self._send(todo)
                while todo:
                    answer, alive = self._receive(time_limit_s, sent)
                    _require_kind(answer, todo.pop(0))
                    yield answer
                    if not alive:
                        break
        finally:
            if todo:  # whoever asked went away: what is still to come must not answer the next
                self._kill()

    def _send(self, message: object) -> bool:
        """Send a message to the process, which is started where there is none; False where it has ended."""
        if self._closed:
            raise ClosedError
        process = self._process or self._start()
        assert process.stdin is not None  # noqa: S101 - it was opened with a pipe
        try:
            pickle.dump(message, process.stdin, protocol=pickle.HIGHEST_PROTOCOL)
            process.stdin.flush()
        except BrokenPipeError:
            return False
        return True

    def _receive(self, time_limit_s: float, sent: bool) -> tuple[Any, bool]:
        """Return an answer, and whether the process that gave it, or gave none, is still there."""
        try:
            answer = self._answers.get(timeout=time_limit_s) if sent else None
        except queue.Empty:
            self._kill()
            return Answer(Status.TIMED_OUT, f"no answer within {time_limit_s:g} s"), False
        return (Answer(Status.CRASHED, self._obituary()), False) if answer is None else (answer, True)

    def printed(self) -> str:
        """Return what the process has printed since it was started; the place where it prints next is left alone."""
        descriptor = self._printed.fileno()
        return os.pread(descriptor, os.fstat(descriptor).st_size, 0).decode(errors="replace")

    def files(self) -> list[str]:
        """Return the names of the files that lie in the process's working folder, which was empty when it began."""
        return sorted(os.listdir(self._folder.name))

    def close(self) -> None:
        """End the process and remove what it left; who still waits for an answer is told so."""
        self._closed = True
        self._kill()
        self._printed.close()
        self._folder.cleanup()

    def _start(self) -> subprocess.Popen[bytes]:
        # The child must find exactly the adapters that this process finds, wherever they were put on the path. It works
        # in a folder of its own, so that an engine's log file lands there and not beside the user's scenes.
        path = os.pathsep.join(os.path.abspath(entry or os.curdir) for entry in sys.path)
        self._printed.seek(0)
        self._printed.truncate()
        process = subprocess.Popen(
            [sys.executable, "-m", "carom.runs.worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._printed,
            cwd=self._folder.name,
            env={**os.environ, "PYTHONPATH": path},
            start_new_session=True,  # Ctrl-C in the terminal reaches the parent alone
        )
        self._process = process
        self._answers = queue.SimpleQueue()
        threading.Thread(target=_read, args=(process, self._answers), daemon=True).start()
        return process

    def _obituary(self) -> str:
        process, self._process = self._process, None
        if process is not None:
            code = process.wait()
            _close_pipes(process)
        if process is None or self._closed:  # ended by the thread that closes this worker
            raise ClosedError
        how = f"the engine's process was ended by {_signal_name(-code)}" if code < 0 else f"exit code {code}"
        printed = [line.strip() for line in self.printed().splitlines() if line.strip()]
        return f"{how}; it last printed: {printed[-1][:200]}" if printed else how

    def _kill(self) -> None:
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.wait()
            _close_pipes(process)


@cache
def _kind_of(task: type[Task[object]]) -> Any:
    return get_type_hints(task.carry_out)["return"]


def _require_kind(answer: object, task: Task[object]) -> None:
    kind = _kind_of(type(task))
    if isinstance(answer, Answer) and (answer.value is None or isinstance(answer.value, kind)):
        return
    found = answer.value if isinstance(answer, Answer) else answer
    raise AdapterError(f"a worker answered with {type(found).__name__} where {kind} was asked for")


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:  # a real-time signal has no name
        return f"signal {number}"


def _close_pipes(process: subprocess.Popen[bytes]) -> None:
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            with suppress(BrokenPipeError):
                pipe.close()


def _read(process: subprocess.Popen[bytes], answers: queue.SimpleQueue[object]) -> None:
    """Pass on answers until the process ends; None says that it has."""
    assert process.stdout is not None  # noqa: S101 - it was opened with a pipe
    with suppress(Exception):  # whatever a dying process left half written, it is no answer
        while True:
            answers.put(pickle.load(process.stdout))  # noqa: S301 - written by our own child process
    answers.put(None)
