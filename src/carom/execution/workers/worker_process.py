"""Starts worker processes, sends them tasks, receives their answers, and turns each failure into an `Answer`.

Every wait has a time limit, and every buffer has a size limit. Answers are data, so a worker can't make the parent run
code.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

from pydantic import ValidationError

from carom.errors import AdapterError
from carom.execution.codec import Codec
from carom.execution.job import Answer, Status, T, Task
from carom.execution.workers.fork_server import ForkServer, list_search_path
from carom.execution.workers.worker_main import ANSWERS_CLOSED, TASK_END, build_codec
from carom.execution.workers.working_folder import Folder
from carom.support.escaping import find_last_message
from carom.support.pipes import LinePipes

#: Largest size of an answer. An answer with half a million impacts is smaller.
MOST_ANSWER_BYTES = 2**27
#: Number of bytes that are kept from the end of an engine's output.
MOST_PRINTED_BYTES = 2**16
#: Number of bytes that a message shows of an invalid answer.
SHOWN_BYTES = 60

#: Seconds that the system may take to end a process.
GRACE_S = 5.0
#: Seconds between checks whether the worker was closed, during a wait for an answer.
CLOSED_CHECK_S = 0.2


class ClosedError(Exception):
    """The worker was closed during a task, for example after Ctrl-C, so the task has no answer."""


class Worker:
    """One worker process. The process starts with the first task.

    If the process ends during a task, the next task starts a new process.

    Args:
        memory_bytes: Memory limit of the process, and of each process that it starts.
        fork_server: The fork server that forks the process. Without a server, a new interpreter is started.
    """

    def __init__(self, memory_bytes: int, fork_server: ForkServer | None = None) -> None:
        if os.name != "posix":
            raise AdapterError("engines run in worker processes, which need Linux or macOS")
        self._memory_bytes, self._fork_server = memory_bytes, fork_server
        self._process: _Process | None = None
        self._closed = False
        self._lock = threading.Lock()  # the sending thread and the closing thread share the process
        self._folder = Folder()

    def run_each(self, tasks: Sequence[Task[T]], time_limit_s: float) -> Iterator[Answer[T]]:
        """Send tasks in one message, and yield the answers in order as soon as they arrive.

        If a task ends the process, exceeds `time_limit_s` or returns an invalid answer, only this task fails. The
        answer to this task contains the reason, and later tasks are sent to a new process.

        Raises:
            ClosedError: The worker was closed during a task.
        """
        todo = list(tasks)
        try:
            while todo:
                with self._lock:
                    if self._closed:
                        raise ClosedError
                    if self._process is None:
                        self._process = _Process(os.fspath(self._folder.path), self._memory_bytes, self._fork_server)
                    process = self._process
                    process.send(pickle.dumps(todo, protocol=pickle.HIGHEST_PROTOCOL))
                while todo and self._process is process:
                    with self._lock:
                        answer = self._receive(process, build_codec(type(todo[0])), time_limit_s)
                    del todo[0]
                    yield answer
        finally:
            # the caller stopped early; a later call must not receive the remaining answers
            if todo:
                with self._lock:
                    self._end()

    def _receive(self, process: _Process, codec: Codec[tuple[int, Answer[T]]], time_limit_s: float) -> Answer[T]:
        """Return the next answer. If the process returns no answer or an invalid answer, end the process.

        If the machine sleeps or this process is stopped, a wait lasts longer than requested. The additional time does
        not count towards the time limit, since the engine does not run during this time.
        """
        left_s = time_limit_s
        while (line := process.take_line()) is None and not process.has_ended:
            if self._closed:
                raise ClosedError
            if left_s <= 0:
                self._end()
                return Answer(Status.TIMED_OUT, f"no answer within {time_limit_s:g} s")
            began_s, wait_s = time.monotonic(), min(left_s, CLOSED_CHECK_S)
            process.exchange(wait_s)
            left_s -= min(time.monotonic() - began_s, wait_s)
        if line is None:
            answer: Answer[T] = process.describe_end()
        else:
            with suppress(ValidationError):
                number, answer = codec.loads(line)
                if number == process.answers_received and (answer.value is not None) is (answer.status is Status.RAN):
                    last_output = process.describe_last_output() if answer.status is Status.FAILED else ""
                    process.answers_received += 1
                    return replace(answer, reason=f"{answer.reason}; {last_output}") if last_output else answer
            answer = Answer(Status.FAILED, f"invalid answer: {_format_line(line)}")
        self._end()
        return answer

    def read_output(self) -> str:
        """Return the last part of the output that the process has printed since its start."""
        with self._lock:
            printed = self._process.read_printed() if self._process else b""
        return printed.replace(TASK_END, b"").decode(errors="replace")

    def list_files(self) -> list[str]:
        """Return the names of the files in the process's working folder, which is empty at the start."""
        return sorted(os.listdir(self._folder.path))

    def stop(self) -> None:
        """Abort the task that is running, and refuse further tasks."""
        self._closed = True

    def close(self) -> None:
        """End the process and remove its folder. A caller that waits for an answer gets a `ClosedError`."""
        self.stop()
        with self._lock:
            self._end()
            self._folder.close()

    def _end(self) -> None:
        process, self._process = self._process, None
        if process is not None:
            process.end()


class _Process(LinePipes):
    """A worker's process, from its start to its end.

    Attributes:
        answers_received: Number of tasks answered.
    """

    def __init__(self, folder: str, memory_bytes: int, fork_server: ForkServer | None) -> None:
        # The child works in a folder of its own, so that an engine's log file is not written next to the user's scenes.
        path = os.pathsep.join(list_search_path())
        forked = fork_server.start(folder, path, memory_bytes) if fork_server is not None else None
        self._popen = forked or _start_watchdog(folder, path, memory_bytes)
        super().__init__(self._popen.stdin, self._popen.stdout, self._popen.stderr, MOST_PRINTED_BYTES)
        self.answers_received, self._tasks_ended = 0, 0

    def take_line(self) -> bytes | None:
        """Return the next line of the answers, or the beginning of a line that is too long to be an answer."""
        line = super().take_line()
        if line is None and len(self.answered) > MOST_ANSWER_BYTES:
            return bytes(self.answered[: 2 * SHOWN_BYTES])
        return line

    def keep_printed(self, chunk: bytes) -> None:
        """Keep the last output, and count the tasks that have ended."""
        super().keep_printed(chunk)
        self._tasks_ended += chunk.count(TASK_END)

    def describe_last_output(self) -> str:
        """Return a phrase with the last output of the first unanswered task; empty if the task printed nothing."""
        parts = self.read_printed().split(TASK_END)
        since = self._tasks_ended - self.answers_received  # tasks whose answers have not been counted yet
        printed = parts[-1 - since] if 0 <= since < len(parts) else b""  # older output is no longer kept
        message = find_last_message(printed.decode(errors="replace"))
        return f"it last printed: {message}" if message else ""

    def describe_end(self) -> Answer[Any]:
        """Return an answer that describes how the process ended, with its last output.

        A process that only closed its answer pipe has not crashed.
        """
        try:
            code = self._popen.wait(GRACE_S)
        except subprocess.TimeoutExpired:
            return Answer(Status.FAILED, "the engine closed the pipe for answers, and continued")
        status, how = Status.CRASHED, f"exit code {code}"
        if code < 0:
            how = f"the engine's process was ended by {_format_signal(-code)}"
        elif code == ANSWERS_CLOSED:
            status, how = Status.FAILED, f"the engine closed the pipe for answers; its process then ended ({how})"
        last_output = self.describe_last_output()
        return Answer(status, f"{how}; {last_output}" if last_output else how)

    def end(self) -> None:
        """End the process and all processes that it started."""
        self._popen.send_signal(signal.SIGCONT)  # SIGCONT continues a stopped watchdog
        self.close()  # the watchdog ends when its input is closed
        # A forked process can hold the other end of the pipe open, so signals are sent too. When the watchdog ends, the
        # worker also ends.
        for number in (signal.SIGTERM, signal.SIGKILL):
            self._popen.send_signal(number)
            with suppress(subprocess.TimeoutExpired):
                self._popen.wait(GRACE_S)
                return


def _start_watchdog(folder: str, path: str, memory_bytes: int) -> subprocess.Popen[bytes]:
    """Start a watchdog in a new interpreter."""
    return subprocess.Popen(  # noqa: S603 - our own interpreter and our own module
        [sys.executable, "-m", "carom.execution.workers.watchdog", str(memory_bytes)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        bufsize=0,
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path},
        start_new_session=True,  # Ctrl-C in the terminal reaches only the parent
    )


def _format_line(line: bytes) -> str:
    """Return the first bytes of a line as printable text."""
    text = "".join(chr(byte) if 32 <= byte < 127 else "." for byte in line[:SHOWN_BYTES])
    return f"{text!r} and more" if len(line) > SHOWN_BYTES else repr(text)


def _format_signal(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:  # a real-time signal has no name
        return f"signal {number}"
