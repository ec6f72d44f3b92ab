"""Starts worker processes, sends them tasks, receives their answers, and turns each failure into an `Answer`.

Every wait has a time limit, and every buffer has a size limit. Answers are data, so a worker can't make the parent run
code.
"""

from __future__ import annotations

import os
import pickle
import selectors
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any, TypeVar

from pydantic import ValidationError

from carom.errors import AdapterError
from carom.execution.codec import Codec
from carom.execution.job import Answer, Status, Task
from carom.execution.workers.fork_server import ForkServer, list_search_path
from carom.execution.workers.worker_main import ANSWERS_CLOSED, TASK_END, build_codec
from carom.execution.workers.working_folder import Folder
from carom.support.escaping import find_last_message

#: Largest size of an answer. An answer with half a million impacts is smaller.
MOST_ANSWER_BYTES = 2**27
#: Number of bytes that are kept from the end of an engine's output.
MOST_PRINTED_BYTES = 2**16
#: The largest capacity that a pipe can have. The default is smaller.
MOST_PIPE_BYTES = 2**20
#: Number of bytes of an invalid answer that are shown.
SHOWN_BYTES = 60

#: Seconds that the system may take to end a process.
GRACE_S = 5.0
#: Seconds between checks whether the worker was closed, during a wait for an answer.
CLOSED_CHECK_S = 0.2

T = TypeVar("T")


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
                    process = self._ensure_running()
                    process.send(todo)
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

    def _ensure_running(self) -> _Process:
        if self._closed:
            raise ClosedError
        if self._process is None:
            self._process = _Process(os.fspath(self._folder.path), self._memory_bytes, self._fork_server)
        return self._process

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
            return self._process.read_output() if self._process else ""

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


class _Process:
    """A worker's process, from its start to its end.

    Attributes:
        answers_received: Number of tasks answered.
        has_ended: Whether the process has ended or closed its answer pipe, so that no further answer can come.
    """

    def __init__(self, folder: str, memory_bytes: int, fork_server: ForkServer | None) -> None:
        # The child works in a folder of its own, so that an engine's log file is not written next to the user's scenes.
        path = os.pathsep.join(list_search_path())
        forked = fork_server.start(folder, path, memory_bytes) if fork_server is not None else None
        self._popen = forked or _start_watchdog(folder, path, memory_bytes)
        requests, answers, printed = self._popen.stdin, self._popen.stdout, self._popen.stderr
        assert requests and answers and printed  # noqa: S101, PT018 - all three are pipes, because of the arguments of Popen
        self._requests, self._answers, self._printed = requests.fileno(), answers.fileno(), printed.fileno()
        self._selector = selectors.DefaultSelector()
        for file in (self._answers, self._printed):
            os.set_blocking(file, False)
            self._selector.register(file, selectors.EVENT_READ)
        os.set_blocking(self._requests, False)
        self.answers_received, self.has_ended = 0, False
        self._unsent, self._answer_bytes, self._searched = memoryview(b""), bytearray(), 0
        self._last_output, self._tasks_ended = b"", 0

    def send(self, message: object) -> None:
        """Queue a message; `exchange` sends the message."""
        if not self._unsent:
            self._selector.register(self._requests, selectors.EVENT_WRITE)
        self._unsent = memoryview(bytes(self._unsent) + pickle.dumps(message, protocol=pickle.HIGHEST_PROTOCOL))

    def take_line(self) -> bytes | None:
        """Return the next complete line of the answers; None if no line is complete yet."""
        end = self._answer_bytes.find(b"\n", self._searched)
        if end < 0:
            self._searched = len(self._answer_bytes)
            if len(self._answer_bytes) <= MOST_ANSWER_BYTES:
                return None
            end = 2 * SHOWN_BYTES  # the line is too long to be an answer; the message shows only its beginning
        line = bytes(self._answer_bytes[:end])
        del self._answer_bytes[: end + 1]
        self._searched = 0
        return line

    def exchange(self, wait_s: float) -> None:
        """Wait at most `wait_s` seconds until data can be sent or received, and send and receive what is possible."""
        for key, _ in self._selector.select(wait_s):
            try:
                if key.fd == self._requests:
                    self._unsent = self._unsent[os.write(self._requests, self._unsent) :]
                    if not self._unsent:
                        self._selector.unregister(self._requests)
                elif chunk := os.read(key.fd, MOST_PRINTED_BYTES):
                    if key.fd == self._answers:
                        self._answer_bytes += chunk
                    else:
                        self._last_output = (self._last_output + chunk)[-MOST_PRINTED_BYTES:]
                        self._tasks_ended += chunk.count(TASK_END)
                else:
                    self._selector.unregister(key.fd)
                    self.has_ended |= key.fd == self._answers
            except BlockingIOError:
                pass
            except BrokenPipeError:  # the process ended early, and its missing answers are reported later
                self._selector.unregister(self._requests)

    def read_output(self) -> str:
        """Return the last part of the output that the process has printed."""
        for _ in range(MOST_PIPE_BYTES // MOST_PRINTED_BYTES):
            self.exchange(0)
        return self._last_output.replace(TASK_END, b"").decode(errors="replace")

    def describe_last_output(self) -> str:
        """Return a phrase with the last output of the first unanswered task; empty if the task printed nothing."""
        self.read_output()
        # Tasks that have ended, but whose answers have not been counted yet.
        since = self._tasks_ended - self.answers_received
        parts = self._last_output.split(TASK_END)
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
        self._popen.send_signal(signal.SIGCONT)  # continues a stopped watchdog
        for pipe in (self._popen.stdin, self._popen.stdout, self._popen.stderr):
            if pipe is not None:
                pipe.close()  # the watchdog ends when its input is closed
        self._selector.close()
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
