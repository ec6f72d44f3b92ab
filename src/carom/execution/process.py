"""The parent's side of a worker process: starts it, asks it, and survives whatever an engine does to it.

Nothing here waits without a limit, holds more than a stated number of bytes, or runs code that came back.
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
from carom.execution.folder import Folder
from carom.execution.fork_server import ForkServer
from carom.execution.job import Answer, Status, Task
from carom.execution.worker import ANSWERS_CLOSED, TASK_END, codec_of
from carom.support.escaping import last_words

#: Longer answers are refused. Half a million impacts with all that is known of them are shorter.
MOST_ANSWER_BYTES = 2**27
#: Of what an engine prints, the end is kept.
MOST_PRINTED_BYTES = 2**16
#: More than a pipe holds by default, and what one can be made to hold.
MOST_PIPE_BYTES = 2**20
#: Of what is no answer, so much is shown.
SHOWN_BYTES = 60

#: How long a process that was told to end may take to do so, seconds: what the system takes to end it.
GRACE_S = 5.0
#: How often a caller that waits for an answer looks whether the worker was closed meanwhile, seconds.
CLOSED_CHECK_S = 0.2

T = TypeVar("T")


class ClosedError(Exception):
    """The caller was ended meanwhile, by Ctrl-C say, so that nobody waits for the answer."""


class Worker:
    """One worker process, started at the first task and again after one that ended it.

    Args:
        memory_bytes: Most that the process, or one that it starts, may take.
        template: What forks the process, where there is one.
    """

    def __init__(self, memory_bytes: int, template: ForkServer | None = None) -> None:
        if os.name != "posix":
            raise AdapterError("engines run in worker processes, which need a POSIX system: Linux, or macOS")
        self._memory_bytes, self._template = memory_bytes, template
        self._process: _Process | None = None
        self._closed = False
        self._lock = threading.Lock()  # of the process, between the thread that asks and the one that closes
        self._folder = Folder()

    def run_each(self, tasks: Sequence[Task[T]], time_limit_s: float) -> Iterator[Answer[T]]:
        """Send several tasks in one message and yield the answer to each, in their order, as soon as it is there.

        A task that ends the process, gives no answer within `time_limit_s` of the one before, or answers something else
        than was asked for, costs nobody else: its answer says so, and those behind it are sent again.

        Raises:
            ClosedError: The worker was closed meanwhile.
        """
        todo = list(tasks)
        try:
            while todo:
                with self._lock:
                    process = self._running()
                    process.send(todo)
                while todo and self._process is process:
                    with self._lock:
                        answer = self._receive(process, codec_of(type(todo[0])), time_limit_s)
                    del todo[0]
                    yield answer
        finally:
            if todo:  # the caller went away: what is still to come must not answer the next
                with self._lock:
                    self._end()

    def _running(self) -> _Process:
        if self._closed:
            raise ClosedError
        if self._process is None:
            self._process = _Process(os.fspath(self._folder.path), self._memory_bytes, self._template)
        return self._process

    def _receive(self, process: _Process, codec: Codec[tuple[int, Answer[T]]], time_limit_s: float) -> Answer[T]:
        """Return an answer; a process that gave none, or nonsense, is ended.

        What counts is the time waited for, and no more of a wait than was asked for: while the machine sleeps, or this
        process is stopped, the engine stands still as well.
        """
        left_s = time_limit_s
        while (line := process.line()) is None and not process.ended:
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
                if number == process.answered and (answer.value is not None) is (answer.status is Status.RAN):
                    said = process.last_printed() if answer.status is Status.FAILED else ""
                    process.answered += 1
                    return replace(answer, reason=f"{answer.reason}; {said}") if said else answer
            answer = Answer(Status.FAILED, f"answered nonsense: {_shown(line)}")
        self._end()
        return answer

    def printed(self) -> str:
        """Return the end of what the process has printed since it was started."""
        with self._lock:
            return self._process.printed() if self._process else ""

    def files(self) -> list[str]:
        """Return the names of the files that lie in the process's working folder, which was empty when it began."""
        return sorted(os.listdir(self._folder.path))

    def stop(self) -> None:
        """Let the caller that waits for an answer wait no longer, and nobody ask again."""
        self._closed = True

    def close(self) -> None:
        """End the process and remove what it left; who still waits for an answer is told so."""
        self.stop()
        with self._lock:
            self._end()
            self._folder.close()

    def _end(self) -> None:
        process, self._process = self._process, None
        if process is not None:
            process.end()


class _Process:
    """One process, from its start to its end.

    Attributes:
        answered: How many tasks it has answered.
        ended: Whether no further answer can come: it has ended, or closed its end, or answered too much.
    """

    def __init__(self, folder: str, memory_bytes: int, template: ForkServer | None) -> None:
        # The child must find exactly the adapters that this process finds, wherever they were put on the path. It works
        # in a folder of its own, so that an engine's log file lands there and not beside the user's scenes.
        path = os.pathsep.join(os.path.abspath(entry or os.curdir) for entry in sys.path)
        forked = template.start(folder, path, memory_bytes) if template is not None else None
        self._popen = forked or _fresh(folder, path, memory_bytes)
        requests, answers, printed = self._popen.stdin, self._popen.stdout, self._popen.stderr
        assert requests and answers and printed  # noqa: S101, PT018 - they were opened with pipes
        self._requests, self._answers, self._printed = requests.fileno(), answers.fileno(), printed.fileno()
        self._selector = selectors.DefaultSelector()
        for file in (self._answers, self._printed):
            os.set_blocking(file, False)
            self._selector.register(file, selectors.EVENT_READ)
        os.set_blocking(self._requests, False)
        self.answered, self.ended = 0, False
        self._unsent, self._found, self._searched = memoryview(b""), bytearray(), 0
        self._tail, self._tasks_ended = b"", 0

    def send(self, message: object) -> None:
        """Have a message sent while answers are waited for."""
        if not self._unsent:
            self._selector.register(self._requests, selectors.EVENT_WRITE)
        self._unsent = memoryview(bytes(self._unsent) + pickle.dumps(message, protocol=pickle.HIGHEST_PROTOCOL))

    def line(self) -> bytes | None:
        """Return the next whole line of what was answered; None where there is none yet."""
        end = self._found.find(b"\n", self._searched)
        if end < 0:
            self._searched = len(self._found)
            if len(self._found) <= MOST_ANSWER_BYTES:
                return None
            end = 2 * SHOWN_BYTES  # no answer is so long, and its beginning is none
        line = bytes(self._found[:end])
        del self._found[: end + 1]
        self._searched = 0
        return line

    def exchange(self, wait_s: float) -> None:
        """Send and take in what can be, after waiting for some time at most."""
        for key, _ in self._selector.select(wait_s):
            try:
                if key.fd == self._requests:
                    self._unsent = self._unsent[os.write(self._requests, self._unsent) :]
                    if not self._unsent:
                        self._selector.unregister(self._requests)
                elif chunk := os.read(key.fd, MOST_PRINTED_BYTES):
                    if key.fd == self._answers:
                        self._found += chunk
                    else:
                        self._tail = (self._tail + chunk)[-MOST_PRINTED_BYTES:]
                        self._tasks_ended += chunk.count(TASK_END)
                else:
                    self._selector.unregister(key.fd)
                    self.ended |= key.fd == self._answers
            except BlockingIOError:
                pass
            except BrokenPipeError:  # it ended before it had read all; the end of its answers says so
                self._selector.unregister(self._requests)

    def printed(self) -> str:
        """Return the end of what it has printed."""
        for _ in range(MOST_PIPE_BYTES // MOST_PRINTED_BYTES):
            self.exchange(0)
        return self._tail.replace(TASK_END, b"").decode(errors="replace")

    def last_printed(self) -> str:
        """Return what the task that is not yet answered has last printed, in a phrase; empty where that is nothing."""
        self.printed()
        since = self._tasks_ended - self.answered  # of the tasks that have ended, how many print no more
        parts = self._tail.split(TASK_END)
        printed = parts[-1 - since] if 0 <= since < len(parts) else b""  # further back it is forgotten
        said = last_words(printed.decode(errors="replace"))
        return f"it last printed: {said}" if said else ""

    def describe_end(self) -> Answer[Any]:
        """Return how it ended, and what it last printed; one that closed what it answers by has not crashed."""
        try:
            code = self._popen.wait(GRACE_S)
        except subprocess.TimeoutExpired:
            return Answer(Status.FAILED, "the engine closed what its process answers by, and ran on")
        status, how = Status.CRASHED, f"exit code {code}"
        if code < 0:
            how = f"the engine's process was ended by {_signal_name(-code)}"
        elif code == ANSWERS_CLOSED:
            status, how = Status.FAILED, f"the engine closed what its process answers by, which then ended ({how})"
        said = self.last_printed()
        return Answer(status, f"{how}; {said}" if said else how)

    def end(self) -> None:
        """End the process with all that it started."""
        self._popen.send_signal(signal.SIGCONT)  # its keeper can have been stopped
        for pipe in (self._popen.stdin, self._popen.stdout, self._popen.stderr):
            if pipe is not None:
                pipe.close()  # the end of its input is the keeper's sign
        self._popen.terminate()  # and so is this: what was forked meanwhile can hold the other end open
        self._selector.close()
        with suppress(subprocess.TimeoutExpired):
            self._popen.wait(GRACE_S)
            return
        self._popen.kill()  # its worker ends with it
        with suppress(subprocess.TimeoutExpired):
            self._popen.wait(GRACE_S)


def _fresh(folder: str, path: str, memory_bytes: int) -> subprocess.Popen[bytes]:
    """Return a keeper in an interpreter of its own."""
    return subprocess.Popen(  # noqa: S603 - our own interpreter and our own module
        [sys.executable, "-m", "carom.execution.watchdog", str(memory_bytes)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        bufsize=0,
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path},
        start_new_session=True,  # Ctrl-C in the terminal reaches the parent alone
    )


def _shown(line: bytes) -> str:
    """Return the first bytes of a line, such as can be printed."""
    text = "".join(chr(byte) if 32 <= byte < 127 else "." for byte in line[:SHOWN_BYTES])
    return f"{text!r} and more" if len(line) > SHOWN_BYTES else repr(text)


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:  # a real-time signal has no name
        return f"signal {number}"
